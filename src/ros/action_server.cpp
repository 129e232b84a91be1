#include "sentree/ros/action_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "sentree/idl/conform.h"
#include "sentree/ros/address.h"
#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"
#include "sentree/ros/detail/node.h"
#include "sentree/ros/detail/service.h"

namespace sentree::ros {
namespace {

using Octets = std::vector<std::uint8_t>;

// Of one goal; whoever asks beyond that hears nothing.
constexpr std::size_t kAskersMax = 16;

constexpr std::int8_t kUnknown = 0;
constexpr std::int8_t kExecuting = 2;
constexpr std::int8_t kCanceling = 3;

// Of CancelGoal.
constexpr std::uint8_t kNone = 0;
constexpr std::uint8_t kRejected = 1;
constexpr std::uint8_t kUnknownGoal = 2;
constexpr std::uint8_t kEnded = 3;

}  // namespace

class ActionServer::Impl {
 public:
  Impl(idl::ServicePtr interface, ActionServerOptions options)
      : interface_(std::move(interface)), options_(std::move(options)) {}
  ~Impl() {
    std::vector<std::string> open;
    {
      const std::lock_guard lock(mutex_);
      for (const Goal& goal : goals_) {
        if (!goal.result) open.push_back(goal.id);
      }
    }
    for (const std::string& id : open) end(id, GoalEnd::kAborted, Value());
    servers_.clear();
    worker_.stop();
  }

  Result<void> open(const GraphAddress& address) {
    const TypeName type = *type_name(interface_->name);
    result_type_ = interface_->find("result")->arguments.find(std::string_view("result"))->type;
    feedback_type_ = interface_->find("feedback")->arguments.find(std::string_view("feedback"))->type;
    const std::pair<std::optional<Codec>*, const idl::Struct*> codecs[] = {
        {&goal_, &interface_->find("send_goal")->arguments},
        {&result_, result_type_->structure},
        {&feedback_, feedback_type_->structure}};
    for (const auto& [codec, of] : codecs) {
      auto made = Codec::make(*of);
      if (!made) return tl::unexpected(std::move(made.error()));
      *codec = std::move(*made);
    }
    auto node = Node::of(address);
    if (!node) return tl::unexpected(std::move(node.error()));
    name_ = address.name;
    const std::string base = address.name + "/_action/";
    const auto nothing = [](const std::string&) {};
    auto feedback =
        (*node)->write({fmt::format("rt{}feedback", base), dds_name(type, "_FeedbackMessage"), {}}, nothing);
    if (!feedback) return tl::unexpected(std::move(feedback.error()));
    feedback_writer_ = std::move(*feedback);
    auto status = (*node)->write({fmt::format("rt{}status", base),
                                  dds_name({"action_msgs", "msg", "GoalStatusArray"}),
                                  {.reliable = true, .transient_local = true, .depth = 1}},
                                 nothing);
    if (!status) return tl::unexpected(std::move(status.error()));
    status_writer_ = std::move(*status);
    const TypeName cancel{"action_msgs", "srv", "CancelGoal"};
    struct Part {
      const char* name;
      TypeName type;
      const char* prefix;
      void (Impl::*handle)(const Octets&, const ServiceServer::Answer&);
    };
    for (const Part& part : {Part{"cancel_goal", cancel, "", &Impl::take_cancel},
                             Part{"get_result", type, "_GetResult", &Impl::take_get_result},
                             Part{"send_goal", type, "_SendGoal", &Impl::take_goal}}) {
      const std::string prefix = part.prefix;
      auto server = ServiceServer::open(
          *node,
          {base + part.name, dds_name(part.type, prefix + "_Request"), dds_name(part.type, prefix + "_Response")},
          worker_,
          [this, handle = part.handle](const Octets& request, const ServiceServer::Answer& answer) {
            // What has no identity is nobody's goal.
            if (request.size() >= kEncapsulation + kGoalIdSize) (this->*handle)(request, answer);
          },
          options_.problem);
      if (!server) return tl::unexpected(std::move(server.error()));
      servers_.push_back(std::move(*server));
    }
    return {};
  }

  void feedback(const std::string& id, Value value) {
    {
      const std::lock_guard lock(mutex_);
      const Goal* goal = find(id);
      if (goal == nullptr || goal->result) return;
    }
    Octets message;
    begin_message(message);
    put_goal_id(message, id);
    if (write(*feedback_, *feedback_type_, std::move(value), "feedback", message))
      static_cast<void>(feedback_writer_->writer()->write(message, nullptr));
  }

  void end(const std::string& id, GoalEnd how, Value value) {
    Octets reply;
    begin_message(reply);
    reply.push_back(static_cast<std::uint8_t>(how));
    if (!write(*result_, *result_type_, std::move(value), "result", reply)) return;
    std::vector<ServiceServer::Answer> askers;
    {
      const std::lock_guard lock(mutex_);
      Goal* goal = find(id);
      if (goal == nullptr || goal->result) return;
      goal->status = static_cast<std::int8_t>(how);
      goal->result = reply;
      askers.swap(goal->askers);
      tell_statuses();
    }
    for (const ServiceServer::Answer& answer : askers) answer(reply);
  }

 private:
  struct Goal {
    std::string id;
    std::int32_t sec = 0;
    std::uint32_t nanosec = 0;
    std::int8_t status = kExecuting;
    std::optional<Octets> result;
    std::vector<ServiceServer::Answer> askers;
  };

  Goal* find(const std::string& id) {
    const auto found = std::find_if(goals_.begin(), goals_.end(), [&](const Goal& goal) { return goal.id == id; });
    return found == goals_.end() ? nullptr : &*found;
  }

  bool write(const Codec& codec, const idl::Type& type, Value value, const char* what, Octets& out) {
    auto whole = idl::conform(type, value.is_null() ? Value(Map()) : std::move(value), what);
    const auto written = whole ? codec.write(out, *whole) : Result<void>(tl::unexpected(whole.error()));
    if (!written && options_.problem) options_.problem(fmt::format("{}: {}", name_, written.error().message));
    return written.has_value();
  }

  void put_info(Octets& out, const Goal& goal) const {
    put_goal_id(out, goal.id);
    put_number(out, static_cast<std::uint32_t>(goal.sec));
    put_number(out, goal.nanosec);
  }

  // With the lock held, so that they are told in their order.
  void tell_statuses() {
    Octets out;
    begin_message(out);
    put_number(out, static_cast<std::uint32_t>(goals_.size()));
    // An identity is octets, which are aligned to nothing.
    for (const Goal& goal : goals_) {
      put_info(out, goal);
      out.push_back(static_cast<std::uint8_t>(goal.status));
    }
    static_cast<void>(status_writer_->writer()->write(out, nullptr));
  }

  void take_goal(const Octets& request, const ServiceServer::Answer& answer) {
    const std::string id = goal_id_at(request, kEncapsulation);
    auto fields = goal_->read(request, kEncapsulation + kGoalIdSize);
    if (!fields && options_.problem)
      options_.problem(fmt::format("a goal of {} cannot be read: {}", name_, fields.error().message));
    bool accepted = fields.has_value();
    Goal goal;
    goal.id = id;
    const double now = options_.now ? options_.now() : 0.0;
    goal.sec = static_cast<std::int32_t>(std::floor(now));
    // Rounded, as the same moment is elsewhere.
    goal.nanosec = std::min(static_cast<std::uint32_t>(std::llround((now - std::floor(now)) * 1e9)), 999'999'999U);
    if (accepted) {
      const std::lock_guard lock(mutex_);
      const auto ended =
          std::find_if(goals_.begin(), goals_.end(), [](const Goal& each) { return each.result.has_value(); });
      if (goals_.size() >= kServedGoalsMax && ended != goals_.end()) goals_.erase(ended);
      accepted = find(id) == nullptr && goals_.size() < kServedGoalsMax;
      // Before it is started, which may end it.
      if (accepted) goals_.push_back(goal);
    }
    const bool known = accepted;
    accepted = accepted && options_.accept && options_.accept(id, *fields);
    {
      const std::lock_guard lock(mutex_);
      if (known && !accepted) std::erase_if(goals_, [&](const Goal& each) { return each.id == id; });
      if (accepted) tell_statuses();
    }
    Octets reply;
    begin_message(reply);
    reply.push_back(accepted ? 1 : 0);
    put_number(reply, static_cast<std::uint32_t>(goal.sec));
    put_number(reply, goal.nanosec);
    answer(reply);
  }

  void take_get_result(const Octets& request, const ServiceServer::Answer& answer) {
    Octets reply;
    {
      const std::lock_guard lock(mutex_);
      Goal* goal = find(goal_id_at(request, kEncapsulation));
      if (goal != nullptr && !goal->result) {
        if (goal->askers.size() < kAskersMax) goal->askers.push_back(answer);
        return;
      }
      if (goal != nullptr) reply = *goal->result;
    }
    if (reply.empty()) {
      begin_message(reply);
      reply.push_back(static_cast<std::uint8_t>(kUnknown));
      if (!write(*result_, *result_type_, Value(), "result", reply)) return;
    }
    answer(reply);
  }

  // An id and no time: that goal; neither: all; a time: those accepted up to then too.
  void take_cancel(const Octets& request, const ServiceServer::Answer& answer) {
    if (request.size() < kEncapsulation + kGoalIdSize + 8) return;
    const std::string id = goal_id_at(request, kEncapsulation);
    const bool names_one = id != std::string(2 * kGoalIdSize, '0');
    const auto sec = static_cast<std::int32_t>(number_at(request, kEncapsulation + kGoalIdSize));
    const std::uint32_t nanosec = number_at(request, kEncapsulation + kGoalIdSize + 4);
    const bool has_time = sec != 0 || nanosec != 0;
    std::vector<Goal> wanted;
    std::uint8_t code = names_one ? kUnknownGoal : kNone;
    {
      const std::lock_guard lock(mutex_);
      for (const Goal& goal : goals_) {
        const bool is_it = names_one && goal.id == id;
        const bool is_before = has_time && std::pair(goal.sec, goal.nanosec) <= std::pair(sec, nanosec);
        if (!is_it && !is_before && (names_one || has_time)) continue;
        if (is_it) code = goal.result ? kEnded : kNone;
        if (!goal.result) wanted.push_back({goal.id, goal.sec, goal.nanosec, goal.status, {}, {}});
      }
    }
    std::erase_if(wanted, [&](const Goal& goal) { return !options_.cancel || !options_.cancel(goal.id); });
    if (code == kNone && names_one && wanted.empty()) code = kRejected;
    {
      const std::lock_guard lock(mutex_);
      for (const Goal& each : wanted) {
        if (Goal* goal = find(each.id); goal != nullptr && !goal->result) goal->status = kCanceling;
      }
      if (!wanted.empty()) tell_statuses();
    }
    Octets reply;
    begin_message(reply);
    reply.push_back(code);
    put_number(reply, static_cast<std::uint32_t>(wanted.size()));
    for (const Goal& goal : wanted) put_info(reply, goal);
    answer(reply);
  }

  const idl::ServicePtr interface_;
  const ActionServerOptions options_;
  std::string name_;
  const idl::Type* result_type_ = nullptr;
  const idl::Type* feedback_type_ = nullptr;
  std::optional<Codec> goal_;
  std::optional<Codec> result_;
  std::optional<Codec> feedback_;
  std::mutex mutex_;
  std::deque<Goal> goals_;
  ToldPtr feedback_writer_;
  ToldPtr status_writer_;
  Worker worker_;
  std::vector<std::unique_ptr<ServiceServer>> servers_;
};

ActionServer::ActionServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ActionServer::~ActionServer() = default;

Result<std::unique_ptr<ActionServer>> ActionServer::open(const std::string& address, idl::ServicePtr interface,
                                                         ActionServerOptions options) {
  const auto parsed = GraphAddress::parse(address);
  if (!parsed) return tl::unexpected(parsed.error());
  if (form_of(*interface) != Form::kAction)
    return fail("ros.type", fmt::format("\"{}\" is no action", interface->name));
  auto impl = std::make_unique<Impl>(std::move(interface), std::move(options));
  if (auto opened = impl->open(*parsed); !opened) return tl::unexpected(std::move(opened.error()));
  return std::unique_ptr<ActionServer>(new ActionServer(std::move(impl)));
}

void ActionServer::feedback(const std::string& goal_id, Value feedback) {
  impl_->feedback(goal_id, std::move(feedback));
}
void ActionServer::end(const std::string& goal_id, GoalEnd how, Value result) {
  impl_->end(goal_id, how, std::move(result));
}

}  // namespace sentree::ros
