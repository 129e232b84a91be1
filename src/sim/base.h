#pragma once

#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/sim/geometry.h"

namespace sentree::sim {

/// What the wheels can do.
struct MotionLimits {
  double speed_m_s = 0.30;
  double turn_rad_s = 0.70;
  double acceleration_m_s2 = 0.50;
  double turn_acceleration_rad_s2 = 2.0;

  friend bool operator==(const MotionLimits&, const MotionLimits&) = default;
};

/// Errors of the odometry; all 0 by default, as in the paper's experiments.
struct OdometryNoise {
  double scale = 0.0;       ///< Constant relative error of the distance, e.g. 0.03 for a wheel 3 % too large.
  double turn_scale = 0.0;  ///< The same of the angle.
  double white = 0.0;       ///< Standard deviation relative to each motion, e.g. 0.1.

  friend bool operator==(const OdometryNoise&, const OdometryNoise&) = default;
};

/// Velocity towards which the wheels accelerate, and until when.
struct VelocityCommand {
  Twist2 twist;
  TimePoint until = kNever;

  friend bool operator==(const VelocityCommand&, const VelocityCommand&) = default;
};

/// The velocity after `dt` of accelerating from `now` towards `wanted`, both within the limits.
[[nodiscard]] Twist2 accelerate(const MotionLimits& limits, const Twist2& now, const Twist2& wanted, Duration dt);

/// The motion in base_link of `dt` at constant velocity: an arc.
[[nodiscard]] Pose2 arc(const Twist2& twist, Duration dt);

/// What the odometry reports for that motion. Draws nothing where the noise is 0.
[[nodiscard]] Pose2 measured(const OdometryNoise& noise, const Pose2& motion, Rng& rng);

}  // namespace sentree::sim
