#include "sentree/ros/detail/action.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/goal_id.h"

namespace sentree::ros {
namespace {

using SteadyClock = std::chrono::steady_clock;

}  // namespace

Result<std::shared_ptr<ActionClient>> ActionClient::of(const std::shared_ptr<Node>& node,
                                                       const idl::ServicePtr& interface, const std::string& name) {
  return node->shared<ActionClient>(
      fmt::format("action {} {}", name, interface->name), [&]() -> Result<std::shared_ptr<ActionClient>> {
        auto type = ActionType::make(interface, name);
        if (!type) return tl::unexpected(std::move(type.error()));
        std::shared_ptr<ActionClient> out(new ActionClient(interface, name, std::move(*type)));
        if (auto opened = out->open(node); !opened) return tl::unexpected(std::move(opened.error()));
        return out;
      });
}

Result<void> ActionClient::open(const std::shared_ptr<Node>& node) {
  other_type_ = [weak = std::weak_ptr(node), topic = fmt::format("rq{}Request", type_.send_goal.name),
                 request = type_.send_goal.request_type] {
    const auto there = weak.lock();
    return there != nullptr ? there->other_type(topic, request) : std::string();
  };
  const struct {
    std::shared_ptr<ServiceClient>& client;
    const ServiceName& service;
  } services[] = {{send_goal_, type_.send_goal}, {get_result_, type_.get_result}, {cancel_goal_, type_.cancel_goal}};
  // Not by the node's list of shared ones, which is being filled in.
  for (const auto& [client, service] : services) {
    auto made = ServiceClient::make(node, service);
    if (!made) return tl::unexpected(std::move(made.error()));
    client = std::move(*made);
  }
  on_change_ = std::make_shared<std::function<void()>>([this] {
    {
      const std::lock_guard lock(mutex_);
      looked_ = false;
    }
    changed_.notify_all();
  });
  get_result_->also_tell(on_change_);
  send_goal_->also_tell(on_change_);
  cancel_goal_->also_tell(on_change_);
  const auto nothing = [](const std::string&) {};
  auto feedback_reader = node->read(
      type_.feedback_topic,
      [this](dds::Sample sample) {
        auto kept = std::make_shared<Octets>(std::move(sample.octets));
        if (!worker_.post([this, kept] { take_feedback(*kept); }))
          trouble(fmt::format("feedback of {} comes faster than it is heard: the oldest is lost", name_));
      },
      nothing);
  if (!feedback_reader) return tl::unexpected(std::move(feedback_reader.error()));
  feedback_reader_ = std::move(*feedback_reader);
  auto status_reader = node->read(
      type_.status_topic,
      [this](dds::Sample sample) {
        auto kept = std::make_shared<Octets>(std::move(sample.octets));
        worker_.post([this, kept] { take_statuses(*kept); });
      },
      nothing);
  if (!status_reader) return tl::unexpected(std::move(status_reader.error()));
  status_reader_ = std::move(*status_reader);
  try {
    follower_ = std::thread([this] { follow(); });
  } catch (const std::system_error& e) {
    return fail("rpc.exhausted", std::string("no thread is left: ") + e.what());
  }
  return {};
}

ActionClient::~ActionClient() {
  feedback_reader_.reset();
  status_reader_.reset();
  worker_.stop();
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  if (follower_.joinable()) follower_.join();
  send_goal_.reset();
  get_result_.reset();
  cancel_goal_.reset();
}

int ActionClient::hear(Take take, Problem problem) {
  const std::lock_guard lock(listeners_mutex_);
  listeners_[++last_] = {std::move(take), std::move(problem)};
  return last_;
}

void ActionClient::forget(int number) {
  const std::lock_guard lock(listeners_mutex_);
  listeners_.erase(number);
}

void ActionClient::publish(const char* method, const Map& arguments) {
  const idl::Method& of = *interface_->find(method);
  const std::lock_guard lock(listeners_mutex_);
  for (const auto& [number, listener] : listeners_) listener.take(of, Value(arguments));
}

void ActionClient::trouble(const std::string& what) {
  const std::lock_guard lock(listeners_mutex_);
  for (const auto& [number, listener] : listeners_) {
    if (listener.problem) listener.problem(what);
  }
}

bool ActionClient::is_available() const {
  return send_goal_->is_available() && get_result_->is_available() && cancel_goal_->is_available();
}

bool ActionClient::wait_available(rpc::Deadline deadline, const std::function<bool()>& interrupted) {
  return send_goal_->wait_available(deadline, interrupted) && get_result_->wait_available(deadline, interrupted) &&
         cancel_goal_->wait_available(deadline, interrupted);
}

bool ActionClient::is_open(const std::string& goal_id) const {
  const std::lock_guard lock(mutex_);
  return goals_.contains(goal_id);
}

void ActionClient::wake() {
  send_goal_->wake();
  cancel_goal_->wake();
}

// GoalInfo: the id and a time of nothing, which together are that goal; without an id all.
ActionClient::Octets ActionClient::cancel_request(const std::string& goal_id) const {
  Octets out;
  begin_message(out);
  put_goal_id(out, goal_id);
  out.insert(out.end(), 8, 0);
  return out;
}

void ActionClient::cancel_now(const std::vector<std::string>& goal_ids) {
  for (const std::string& id : goal_ids) {
    if (is_open(id)) static_cast<void>(cancel_goal_->send(cancel_request(id)));
  }
}

rpc::Outcome ActionClient::call(const idl::Method& method, const Value& arguments, rpc::Deadline deadline,
                                const std::function<bool()>& interrupted) {
  const auto failed = [&](rpc::CallErrorKind kind, const std::string& why) {
    return tl::unexpected(rpc::CallError{kind, why, {}, {}});
  };
  if (!wait_available(deadline, interrupted))
    return failed(rpc::CallErrorKind::kUnreachable,
                  fmt::format("no server of the action {} is there{}", name_, other_type_()));
  // Without an id, all goals would be cancelled: whatever else is asked for must not come to that.
  const bool is_goal = method.name == "send_goal";
  if (!is_goal && method.name != "cancel_goal")
    return failed(rpc::CallErrorKind::kArguments,
                  fmt::format("the action {} is asked for send_goal and cancel_goal, not for {}", name_, method.name));
  const std::string id = is_goal ? new_goal_id() : std::string(arguments.find("goal_id")->text());
  Octets request;
  if (is_goal) {
    begin_message(request);
    put_goal_id(request, id);
    if (auto written = type_.write_goal(request, arguments); !written)
      return failed(rpc::CallErrorKind::kArguments, fmt::format("a goal of {}: {}", name_, written.error().message));
    const std::lock_guard lock(mutex_);
    if (goals_.size() >= kGoalsMax)
      return failed(rpc::CallErrorKind::kUnreachable, fmt::format("{} goals of {} have not ended", kGoalsMax, name_));
  } else {
    if (!id.empty() && !read_goal_id(id))
      return failed(rpc::CallErrorKind::kArguments,
                    fmt::format("\"{}\" is no goal_id, which has 32 hexadecimal digits", id));
    request = cancel_request(id);
  }
  ServiceClient& client = is_goal ? *send_goal_ : *cancel_goal_;
  const auto key = client.send(request);
  if (!key) return failed(rpc::CallErrorKind::kUnreachable, fmt::format("the server of the action {} has gone", name_));
  const auto reply = client.wait(*key, deadline, interrupted);
  if (!reply) {
    if (SteadyClock::now() >= deadline) return failed(rpc::CallErrorKind::kLate, name_ + " did not answer in time");
    return failed(rpc::CallErrorKind::kUnreachable, interrupted()
                                                        ? "the client has been closed"
                                                        : fmt::format("the server of the action {} has gone", name_));
  }
  if (reply->size() < kEncapsulation + 1)
    return failed(rpc::CallErrorKind::kProtocol, fmt::format("the reply of {} is too short", name_));
  const std::uint8_t first = (*reply)[kEncapsulation];
  if (is_goal) {
    if (first != 0) {
      {
        const std::lock_guard lock(mutex_);
        goals_[id];
        looked_ = false;
      }
      changed_.notify_all();
    }
    return Value(Map{{"accepted", first != 0}, {"goal_id", id}});
  }
  return *ActionType::read_cancelled(*reply);
}

// Asks for the result of each goal that was accepted, and tells of those that come. If the server goes, nobody will.
void ActionClient::follow() {
  std::unique_lock lock(mutex_);
  while (!stopped_) {
    if (looked_) {
      changed_.wait(lock, [&] { return stopped_ || !looked_; });
      continue;
    }
    looked_ = true;
    std::map<std::string, Goal> goals = goals_;
    lock.unlock();
    const bool is_there = get_result_->is_available();
    std::vector<std::pair<std::string, Map>> ended;
    for (auto& [id, goal] : goals) {
      if (!goal.asked) {
        Octets request;
        begin_message(request);
        put_goal_id(request, id);
        goal.asked = get_result_->send(request);
      }
      const auto reply = goal.asked ? get_result_->take(*goal.asked) : std::nullopt;
      if (!reply && is_there) continue;
      Map told = type_.unknown_result(id);
      if (reply && reply->size() > kEncapsulation) {
        told["status"] = type_.read_status(*reply);
        if (auto result = type_.read_result(id, *reply))
          told = std::move(*result);
        else
          trouble(result.error().message);
      }
      ended.emplace_back(id, std::move(told));
    }
    lock.lock();
    for (const auto& [id, goal] : goals) {
      if (const auto known = goals_.find(id); known != goals_.end()) known->second = goal;
    }
    for (const auto& [id, told] : ended) goals_.erase(id);
    lock.unlock();
    for (const auto& [id, told] : ended) publish("result", told);
    lock.lock();
  }
}

void ActionClient::take_feedback(const Octets& message) {
  if (message.size() < kEncapsulation + kGoalIdSize) return;
  auto feedback = type_.read_feedback(message);
  if (!feedback) return trouble(feedback.error().message);
  publish("feedback", *feedback);
}

void ActionClient::take_statuses(const Octets& message) {
  for (const Map& told : type_.read_statuses(message, statuses_)) publish("status", told);
}

}  // namespace sentree::ros
