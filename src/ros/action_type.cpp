#include "sentree/ros/detail/action_type.h"

#include <fmt/format.h>

#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"

namespace sentree::ros {
namespace {

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

Result<ActionType> ActionType::make(const idl::ServicePtr& interface, const std::string& name) {
  ActionType out(interface, name);
  const struct {
    std::optional<Codec>& codec;
    const idl::Struct& of;
  } codecs[] = {{out.goal_, interface->find("send_goal")->arguments},
                {out.result_, *argument_type(*interface, "result", "result")->structure},
                {out.feedback_, *argument_type(*interface, "feedback", "feedback")->structure}};
  for (const auto& [codec, of] : codecs) {
    auto made = Codec::make(of);
    if (!made) return tl::unexpected(std::move(made.error()));
    codec = std::move(*made);
  }
  const TypeName type = *type_name(interface->name);
  const TypeName cancel{"action_msgs", "srv", "CancelGoal"};
  const std::string base = name + "/_action/";
  out.send_goal = {base + "send_goal", dds_name(type, "_SendGoal_Request"), dds_name(type, "_SendGoal_Response")};
  out.get_result = {base + "get_result", dds_name(type, "_GetResult_Request"), dds_name(type, "_GetResult_Response")};
  out.cancel_goal = {base + "cancel_goal", dds_name(cancel, "_Request"), dds_name(cancel, "_Response")};
  out.feedback_topic = {fmt::format("rt{}feedback", base), dds_name(type, "_FeedbackMessage"), {}};
  out.status_topic = {fmt::format("rt{}status", base),
                      dds_name({"action_msgs", "msg", "GoalStatusArray"}),
                      {.reliable = true, .transient_local = true, .depth = 1}};
  return out;
}

tl::unexpected<Diagnostic> ActionType::unread(const std::string& what, const Diagnostic& why) const {
  return fail("ros.message",
              fmt::format("{} of {} cannot be read: {}; is the definition of {} that of the robot's release?", what,
                          name_, why.message, interface_->name));
}

Result<Value> ActionType::read_goal(const Octets& request) const {
  auto goal = goal_->read(request, kEncapsulation + kGoalIdSize);
  if (!goal) return unread("a goal", goal.error());
  return goal;
}

Result<Map> ActionType::read_feedback(const Octets& message) const {
  auto feedback = feedback_->read(message, kEncapsulation + kGoalIdSize);
  if (!feedback) return unread("feedback", feedback.error());
  return Map{{"goal_id", goal_id_at(message, kEncapsulation)}, {"feedback", std::move(*feedback)}};
}

Map ActionType::unknown_result(const std::string& goal_id) const {
  Map out{{"goal_id", goal_id}, {"status", "UNKNOWN"}};
  const idl::Field* empty = interface_->find("result")->arguments.find(std::string_view("result"));
  if (empty->default_value) out["result"] = *empty->default_value;
  return out;
}

Result<Map> ActionType::read_result(const std::string& goal_id, const Octets& reply) const {
  auto result = result_->read(reply, kEncapsulation + 1);
  if (!result) return unread("the result of a goal", result.error());
  return Map{{"goal_id", goal_id}, {"status", read_status(reply)}, {"result", std::move(*result)}};
}

std::string ActionType::read_status(const Octets& reply) const {
  return status_name(argument_type(*interface_, "result", "status"), static_cast<std::int8_t>(reply[kEncapsulation]));
}

std::optional<Value> ActionType::read_cancelled(const Octets& reply) {
  if (reply.size() < kEncapsulation + 1) return std::nullopt;
  constexpr std::size_t kInfo = kGoalIdSize + 8;
  constexpr std::size_t kFirst = kEncapsulation + 8;
  List canceling;
  if (reply.size() >= kFirst) {
    const std::uint32_t count = number_at(reply, kEncapsulation + 4);
    for (std::uint32_t i = 0; i < count && kFirst + (i + 1) * kInfo <= reply.size(); ++i)
      canceling.emplace_back(goal_id_at(reply, kFirst + i * kInfo));
  }
  return Value(Map{{"return_code", static_cast<std::int64_t>(static_cast<std::int8_t>(reply[kEncapsulation]))},
                   {"goals_canceling", std::move(canceling)}});
}

// GoalStatusArray: all goals that the server remembers.
std::vector<Map> ActionType::read_statuses(const Octets& message, std::map<std::string, std::string>& known) const {
  constexpr std::size_t kFirst = kEncapsulation + 4;
  std::vector<Map> out;
  if (message.size() < kFirst) return out;
  const idl::Type* type = argument_type(*interface_, "status", "status");
  const std::uint32_t count = number_at(message, kEncapsulation);
  std::map<std::string, std::string> now;
  std::size_t at = kFirst;
  for (std::uint32_t i = 0; i < count && i < kStatusesMax; ++i) {
    // An identity, which is aligned to nothing, as octets are; a time, which is; and the status.
    const std::size_t status_at = (at + kGoalIdSize + 3) / 4 * 4 + 8;
    if (status_at >= message.size()) break;
    now[goal_id_at(message, at)] = status_name(type, static_cast<std::int8_t>(message[status_at]));
    at = status_at + 1;
  }
  for (const auto& [id, status] : now) {
    const auto before = known.find(id);
    if (before == known.end() || before->second != status) out.push_back(Map{{"goal_id", id}, {"status", status}});
  }
  known = std::move(now);
  return out;
}

}  // namespace sentree::ros
