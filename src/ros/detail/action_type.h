#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/service.h"

/// What the messages of an action are, for who sends goals and for who listens to others. Private to the library.
namespace sentree::ros {

class ActionType {
 public:
  using Octets = std::vector<std::uint8_t>;

  /// @param name  Of the action, in the graph. Error: ros.type.
  [[nodiscard]] static Result<ActionType> make(const idl::ServicePtr& interface, const std::string& name);

  ServiceName send_goal;
  ServiceName get_result;
  ServiceName cancel_goal;
  dds::Channel feedback_topic;
  dds::Channel status_topic;

  /// The fields of a goal, in a message that begins with its id.
  [[nodiscard]] Result<void> write_goal(Octets& out, const Value& goal) const { return goal_->write(out, goal); }
  [[nodiscard]] Result<Value> read_goal(const Octets& request) const;
  /// Arguments of the topics `feedback` and `result`. Errors say what to look at.
  [[nodiscard]] Result<Map> read_feedback(const Octets& message) const;
  [[nodiscard]] Result<Map> read_result(const std::string& goal_id, const Octets& reply) const;
  /// How a goal ended, also where its result cannot be read.
  [[nodiscard]] std::string read_status(const Octets& reply) const;
  /// Of a goal whose server has gone.
  [[nodiscard]] Map unknown_result(const std::string& goal_id) const;
  /// What `cancel_goal` returns. Of a message that is no reply: nothing.
  [[nodiscard]] static std::optional<Value> read_cancelled(const Octets& reply);
  /// Arguments of the topic `status` for those goals whose status is another one than in `known`, which becomes what
  /// the message says.
  [[nodiscard]] std::vector<Map> read_statuses(const Octets& message, std::map<std::string, std::string>& known) const;

 private:
  ActionType(idl::ServicePtr interface, std::string name) : interface_(std::move(interface)), name_(std::move(name)) {}
  [[nodiscard]] tl::unexpected<Diagnostic> unread(const std::string& what, const Diagnostic& why) const;

  idl::ServicePtr interface_;
  std::string name_;
  std::optional<Codec> goal_;
  std::optional<Codec> result_;
  std::optional<Codec> feedback_;
};

}  // namespace sentree::ros
