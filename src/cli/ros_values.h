#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "sentree/base/value.h"

namespace sentree::cli {

/// Of a simulated robot: metres and radians in the map.
struct Pose {
  double x = 0;
  double y = 0;
  double theta = 0;
};

/// a after b: where a frame is in the world that is at `b` in the frame at `a`.
inline Pose operator*(const Pose& a, const Pose& b) {
  return {a.x + std::cos(a.theta) * b.x - std::sin(a.theta) * b.y,
          a.y + std::sin(a.theta) * b.x + std::cos(a.theta) * b.y, a.theta + b.theta};
}
inline Pose inverse(const Pose& p) {
  return {-std::cos(p.theta) * p.x - std::sin(p.theta) * p.y, std::sin(p.theta) * p.x - std::cos(p.theta) * p.y,
          -p.theta};
}
/// Of robot.thrift's Pose2D; null is the origin.
inline Pose pose_of(const Value* value) {
  if (value == nullptr) return {};
  return {value->find("x")->number(), value->find("y")->number(), value->find("theta")->number()};
}
/// Of a geometry_msgs/Pose.
inline Pose pose_of_ros(const Value& pose) {
  const auto part = [&](const char* of, const char* axis) { return pose.at({of, axis})->number(); };
  return {part("position", "x"), part("position", "y"),
          2 * std::atan2(part("orientation", "z"), part("orientation", "w"))};
}
inline Map to_pose2d(const Pose& p) { return Map{{"x", p.x}, {"y", p.y}, {"theta", p.theta}}; }

inline Map ros_vector(double x, double y, double z) { return Map{{"x", x}, {"y", y}, {"z", z}}; }
inline Map ros_rotation(double theta) {
  return Map{{"x", 0.0}, {"y", 0.0}, {"z", std::sin(theta / 2)}, {"w", std::cos(theta / 2)}};
}
inline Map ros_pose(const Pose& p) {
  return Map{{"position", ros_vector(p.x, p.y, 0)}, {"orientation", ros_rotation(p.theta)}};
}
/// builtin_interfaces/Time or Duration of seconds.
inline Map ros_stamp(double time) {
  const double whole = std::floor(time);
  return Map{{"sec", static_cast<std::int64_t>(whole)},
             {"nanosec", std::min<std::int64_t>(std::llround((time - whole) * 1e9), 999'999'999)}};
}
inline double seconds_of_ros(const Value& stamp) {
  return stamp.find("sec")->number() + stamp.find("nanosec")->number() * 1e-9;
}
inline Map ros_header(double time, const std::string& frame) {
  return Map{{"stamp", ros_stamp(time)}, {"frame_id", frame}};
}

}  // namespace sentree::cli
