#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/processes/component.h"
#include "sentree/rpc/middleware.h"

namespace sentree::cli {

/// The simulated robots as programs for ROS 2 expect one: /battery_state, /odom, /tf, /scan, /map, /amcl_pose and
/// /clock published, /cmd_vel heard, and what `RosActions` serves. With several robots in the world all but /tf and
/// /clock is below its name. Ends when it is destroyed, which must be before the server goes.
class RosRobot {
 public:
  /// Errors: rpc.address (no ROS in this build), those of the interfaces.
  [[nodiscard]] static Result<std::unique_ptr<RosRobot>> start(processes::SimServer& server, const sim::World& world,
                                                               std::function<void(const std::string&)> problem);
  ~RosRobot();
  RosRobot(const RosRobot&) = delete;
  RosRobot& operator=(const RosRobot&) = delete;

 private:
  class Impl;
  explicit RosRobot(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::cli
