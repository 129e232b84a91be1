#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

namespace sentree::ros {

/// Goals that are remembered: those under way, and the last ones that have ended.
inline constexpr std::size_t kServedGoalsMax = 100;

/// How a goal ends, with the numbers of ROS.
enum class GoalEnd : std::int8_t { kSucceeded = 4, kCanceled = 5, kAborted = 6 };

struct ActionServerOptions {
  /// A goal with the fields of the action's: false refuses it. From a thread of the server, as `cancel`.
  std::function<bool(const std::string& goal_id, const Value& goal)> accept;
  /// Somebody wants it to end; false refuses. `end` says when it has.
  std::function<bool(const std::string& goal_id)> cancel;
  /// Seconds of the clock by which goals are accepted.
  std::function<double()> now;
  std::function<void(const std::string&)> problem;
};

/// An action of ours in a graph of ROS 2. Thread-safe.
class ActionServer {
 public:
  /// @param address  What stands behind "ros:". Errors: rpc.address, ros.type, rpc.exhausted.
  [[nodiscard]] static Result<std::unique_ptr<ActionServer>> open(const std::string& address, idl::ServicePtr interface,
                                                                  ActionServerOptions options);
  /// Goals under way are aborted.
  ~ActionServer();
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

  /// `feedback` are its fields; those that are absent are zero. Of a goal that is not under way it is nothing.
  void feedback(const std::string& goal_id, Value feedback);
  /// Once; afterwards the goal is only remembered.
  void end(const std::string& goal_id, GoalEnd how, Value result);

 private:
  class Impl;
  explicit ActionServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::ros
