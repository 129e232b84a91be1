#include "sentree/sim/base.h"

#include <algorithm>
#include <cmath>

namespace sentree::sim {

Twist2 accelerate(const MotionLimits& limits, const Twist2& now, const Twist2& wanted, Duration dt) {
  const double s = seconds(dt);
  const auto towards = [](double from, double to, double step) { return from + std::clamp(to - from, -step, step); };
  const double vx = std::clamp(wanted.vx, -limits.speed_m_s, limits.speed_m_s);
  const double omega = std::clamp(wanted.omega, -limits.turn_rad_s, limits.turn_rad_s);
  return {towards(now.vx, vx, limits.acceleration_m_s2 * s),
          towards(now.omega, omega, limits.turn_acceleration_rad_s2 * s)};
}

Pose2 arc(const Twist2& twist, Duration dt) {
  const double s = seconds(dt);
  const double angle = twist.omega * s;
  const double length = twist.vx * s;
  // The chord of the arc; its factor sin(a)/a is 1 to double precision for small a.
  const double half = angle / 2;
  if (half == 0.0) return {length, length * half, angle};
  const double chord = std::abs(half) < 1e-8 ? length : length * std::sin(half) / half;
  return {chord * std::cos(half), chord * std::sin(half), angle};
}

Pose2 measured(const OdometryNoise& noise, const Pose2& motion, Rng& rng) {
  Pose2 seen = motion;
  double along = 1.0 + noise.scale;
  double around = 1.0 + noise.turn_scale;
  if (noise.white > 0.0) {
    along += noise.white * rng.normal();
    around += noise.white * rng.normal();
  }
  seen.x *= along;
  seen.y *= along;
  seen.theta *= around;
  return seen;
}

}  // namespace sentree::sim
