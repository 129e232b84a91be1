#pragma once

#include <cstdint>

#include "sentree/sim/geometry.h"

namespace sentree::sim {

/// Where the robot really is. For physics, sensors, test control and drawing: the robot's own software (localization,
/// navigation) must not include this file; a test of the include graph says so.
struct GroundTruth {
  Pose2 pose;  ///< In the map frame.
  Twist2 twist;
  std::int64_t collisions = 0;  ///< Motions that a wall or an obstacle stopped.

  friend bool operator==(const GroundTruth&, const GroundTruth&) = default;
};

}  // namespace sentree::sim
