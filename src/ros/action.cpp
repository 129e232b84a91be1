#include "sentree/ros/detail/action.h"

#include <algorithm>
#include <system_error>

#include "sentree/ros/cdr.h"
#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"

namespace sentree::ros {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kStatusesMax = 1000;

const idl::Type* argument_type(const idl::Service& interface, const char* method, const char* argument) {
  const idl::Method* found = interface.find(method);
  const idl::Field* field = found != nullptr ? found->arguments.find(std::string_view(argument)) : nullptr;
  return field != nullptr ? field->type : nullptr;
}

std::string status_name(const idl::Type* type, std::int64_t number) {
  const idl::Enumerator* found = type != nullptr ? type->enumeration->find(number) : nullptr;
  return found != nullptr ? found->name : "UNKNOWN";
}

}  // namespace

Result<std::shared_ptr<ActionClient>> ActionClient::of(const std::shared_ptr<Node>& node,
                                                       const idl::ServicePtr& interface, const std::string& name) {
  return node->shared<ActionClient>("action " + name + " " + interface->name,
                                    [&]() -> Result<std::shared_ptr<ActionClient>> {
                                      std::shared_ptr<ActionClient> out(new ActionClient(interface, name));
                                      if (auto opened = out->open(node); !opened)
                                        return tl::unexpected(std::move(opened.error()));
                                      return out;
                                    });
}

Result<void> ActionClient::open(const std::shared_ptr<Node>& node) {
  const TypeName type = *type_name(interface_->name);
  const idl::Type* result = argument_type(*interface_, "result", "result");
  const idl::Type* feedback = argument_type(*interface_, "feedback", "feedback");
  const struct {
    std::optional<Codec>& codec;
    const idl::Struct& of;
  } codecs[] = {{goal_, interface_->find("send_goal")->arguments},
                {result_, *result->structure},
                {feedback_, *feedback->structure}};
  for (const auto& [codec, of] : codecs) {
    auto made = Codec::make(of);
    if (!made) return tl::unexpected(std::move(made.error()));
    codec = std::move(*made);
  }
  const TypeName cancel{"action_msgs", "srv", "CancelGoal"};
  const struct {
    std::shared_ptr<ServiceClient>& client;
    const char* name;
    std::string request;
    std::string reply;
  } services[] = {
      {send_goal_, "send_goal", dds_name(type, "_SendGoal_Request"), dds_name(type, "_SendGoal_Response")},
      {get_result_, "get_result", dds_name(type, "_GetResult_Request"), dds_name(type, "_GetResult_Response")},
      {cancel_goal_, "cancel_goal", dds_name(cancel, "_Request"), dds_name(cancel, "_Response")}};
  other_type_ = [weak = std::weak_ptr(node), topic = "rq" + name_ + "/_action/send_goalRequest",
                 request = services[0].request] {
    const auto there = weak.lock();
    return there != nullptr ? there->other_type(topic, request) : std::string();
  };
  // Not by the node's list of shared ones, which is being filled in.
  for (const auto& [client, service, request, reply] : services) {
    auto made = ServiceClient::make(node, {name_ + "/_action/" + service, request, reply});
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
      {"rt" + name_ + "/_action/feedback", dds_name(type, "_FeedbackMessage"), {}},
      [this](dds::Sample sample) {
        auto kept = std::make_shared<Octets>(std::move(sample.octets));
        if (!worker_.post([this, kept] { take_feedback(*kept); }))
          trouble("feedback of " + name_ + " comes faster than it is heard: the oldest is lost");
      },
      nothing);
  if (!feedback_reader) return tl::unexpected(std::move(feedback_reader.error()));
  feedback_reader_ = std::move(*feedback_reader);
  auto status_reader = node->read(
      {"rt" + name_ + "/_action/status",
       dds_name({"action_msgs", "msg", "GoalStatusArray"}),
       {.reliable = true, .transient_local = true, .depth = 1}},
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

void ActionClient::publish(const char* method, Map arguments) {
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
    return failed(rpc::CallErrorKind::kUnreachable, "no server of the action " + name_ + " is there" + other_type_());
  const bool is_goal = method.name == "send_goal";
  const std::string id = is_goal ? new_goal_id() : std::string(arguments.find("goal_id")->text());
  Octets request;
  if (is_goal) {
    begin_message(request);
    put_goal_id(request, id);
    if (auto written = goal_->write(request, arguments); !written)
      return failed(rpc::CallErrorKind::kArguments, "a goal of " + name_ + ": " + written.error().message);
    const std::lock_guard lock(mutex_);
    if (goals_.size() >= kGoalsMax)
      return failed(rpc::CallErrorKind::kUnreachable,
                    std::to_string(kGoalsMax) + " goals of " + name_ + " have not ended");
  } else {
    if (!id.empty() && !read_goal_id(id))
      return failed(rpc::CallErrorKind::kArguments, "\"" + id + "\" is no goal_id, which has 32 hexadecimal digits");
    request = cancel_request(id);
  }
  ServiceClient& client = is_goal ? *send_goal_ : *cancel_goal_;
  const auto key = client.send(request);
  if (!key) return failed(rpc::CallErrorKind::kUnreachable, "the server of the action " + name_ + " has gone");
  const auto reply = client.wait(*key, deadline, interrupted);
  if (!reply) {
    if (SteadyClock::now() >= deadline) return failed(rpc::CallErrorKind::kLate, name_ + " did not answer in time");
    return failed(rpc::CallErrorKind::kUnreachable,
                  interrupted() ? "the client has been closed" : "the server of the action " + name_ + " has gone");
  }
  if (reply->size() < kEncapsulation + 1)
    return failed(rpc::CallErrorKind::kProtocol, "the reply of " + name_ + " is too short");
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
  List canceling;
  constexpr std::size_t kInfo = kGoalIdSize + 8;
  if (reply->size() >= kEncapsulation + 8) {
    const std::uint32_t count = number_at(*reply, kEncapsulation + 4);
    for (std::uint32_t i = 0; i < count && kEncapsulation + 8 + (i + 1) * kInfo <= reply->size(); ++i)
      canceling.emplace_back(goal_id_at(*reply, kEncapsulation + 8 + i * kInfo));
  }
  return Value(Map{{"return_code", static_cast<std::int64_t>(static_cast<std::int8_t>(first))},
                   {"goals_canceling", std::move(canceling)}});
}

// Asks for the result of each goal that was accepted, and tells of those that come. If the server goes, nobody will.
void ActionClient::follow() {
  const idl::Type* status = argument_type(*interface_, "result", "status");
  const idl::Field* empty = interface_->find("result")->arguments.find(std::string_view("result"));
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
      Map told{{"goal_id", id}, {"status", "UNKNOWN"}};
      if (empty->default_value) told["result"] = *empty->default_value;
      if (reply && reply->size() > kEncapsulation) {
        told["status"] = status_name(status, static_cast<std::int8_t>((*reply)[kEncapsulation]));
        auto result = result_->read(*reply, kEncapsulation + 1);
        if (result)
          told["result"] = std::move(*result);
        else
          trouble("the result of a goal of " + name_ + " cannot be read: " + result.error().message +
                  "; is the definition of " + interface_->name + " that of the robot's release?");
      }
      ended.emplace_back(id, std::move(told));
    }
    lock.lock();
    for (const auto& [id, goal] : goals) {
      if (const auto known = goals_.find(id); known != goals_.end()) known->second = goal;
    }
    for (const auto& [id, told] : ended) goals_.erase(id);
    lock.unlock();
    for (auto& [id, told] : ended) publish("result", std::move(told));
    lock.lock();
  }
}

void ActionClient::take_feedback(const Octets& message) {
  if (message.size() < kEncapsulation + kGoalIdSize) return;
  auto feedback = feedback_->read(message, kEncapsulation + kGoalIdSize);
  if (!feedback)
    return trouble("feedback of " + name_ + " cannot be read: " + feedback.error().message + "; is the definition of " +
                   interface_->name + " that of the robot's release?");
  publish("feedback", Map{{"goal_id", goal_id_at(message, kEncapsulation)}, {"feedback", std::move(*feedback)}});
}

// GoalStatusArray: all goals that the server remembers; told are those whose status is another one.
void ActionClient::take_statuses(const Octets& message) {
  constexpr std::size_t kFirst = kEncapsulation + 4;
  constexpr std::size_t kItem = kGoalIdSize + 8 + 4;  // with the padding behind the status
  if (message.size() < kFirst) return;
  const idl::Type* type = argument_type(*interface_, "status", "status");
  const std::uint32_t count = number_at(message, kEncapsulation);
  std::map<std::string, std::string> now;
  for (std::uint32_t i = 0; i < count && i < kStatusesMax; ++i) {
    const std::size_t at = kFirst + i * kItem;
    if (at + kGoalIdSize + 9 > message.size()) break;
    now[goal_id_at(message, at)] = status_name(type, static_cast<std::int8_t>(message[at + kGoalIdSize + 8]));
  }
  for (const auto& [id, status] : now) {
    const auto before = statuses_.find(id);
    if (before != statuses_.end() && before->second == status) continue;
    publish("status", Map{{"goal_id", id}, {"status", status}});
  }
  statuses_ = std::move(now);
}

}  // namespace sentree::ros
