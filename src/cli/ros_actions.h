#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/cli/ros_values.h"

namespace sentree::cli {

/// What Nav2 serves, of one simulated robot: the actions /navigate_to_pose, /navigate_through_poses,
/// /compute_path_to_pose, /follow_path, /spin, /backup and /dock_robot, and the services that clear the global and the
/// local costmap, of which the robot has one. As the robot does one thing at a time, a goal that drives ends the one
/// before it. Poses are in map, odom or base_link; what is in another frame is aborted. Thread-safe.
class RosActions {
 public:
  struct Options {
    std::string prefix;  ///< Before every name; "" or "/ROBOT".
    /// Calls the robot; null: it does not say.
    std::function<Value(const char* interface, const char* method, Map arguments)> ask;
    std::function<double()> now;  ///< [s] of the simulated clock.
    std::function<void(const std::string&)> problem;
  };
  /// Errors: those of the interfaces, and of names that cannot be served.
  [[nodiscard]] static Result<std::unique_ptr<RosActions>> open(Options options);
  /// Goals under way are aborted.
  ~RosActions();
  RosActions(const RosActions&) = delete;
  RosActions& operator=(const RosActions&) = delete;

  /// Ends the goals that have ended. @param tells  whether those under way get feedback.
  void step(double now, const Pose& believed, bool tells);

 private:
  class Impl;
  explicit RosActions(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::cli
