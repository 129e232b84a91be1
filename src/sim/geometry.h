#pragma once

#include <cmath>
#include <limits>
#include <numbers>

namespace sentree::sim {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A point or a displacement [m].
struct Vec2 {
  double x = 0.0;
  double y = 0.0;

  friend bool operator==(const Vec2&, const Vec2&) = default;
  friend Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2 operator*(double s, Vec2 v) { return {s * v.x, s * v.y}; }
};

[[nodiscard]] inline double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
[[nodiscard]] inline double norm(Vec2 v) { return std::sqrt(dot(v, v)); }
[[nodiscard]] inline double distance(Vec2 a, Vec2 b) { return norm(b - a); }

/// Position [m] and heading [rad], counter-clockwise from +x (REP 103).
struct Pose2 {
  double x = 0.0;
  double y = 0.0;
  double theta = 0.0;

  [[nodiscard]] Vec2 position() const { return {x, y}; }
  friend bool operator==(const Pose2&, const Pose2&) = default;
};

/// Velocity in base_link: forward [m/s] and turning [rad/s].
struct Twist2 {
  double vx = 0.0;
  double omega = 0.0;

  friend bool operator==(const Twist2&, const Twist2&) = default;
};

/// The same angle in (-pi, pi].
[[nodiscard]] inline double wrap_angle(double angle) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  if (angle > -std::numbers::pi && angle <= std::numbers::pi) return angle;
  const double wrapped = angle - kTurn * std::floor((angle + std::numbers::pi) / kTurn);
  return wrapped <= -std::numbers::pi ? wrapped + kTurn : wrapped;
}

[[nodiscard]] inline Vec2 rotated(Vec2 v, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}

/// A point given in `frame`, in the frame's parent.
[[nodiscard]] inline Vec2 transform(const Pose2& frame, Vec2 point) {
  return frame.position() + rotated(point, frame.theta);
}

/// A point of the parent, in `frame`.
[[nodiscard]] inline Vec2 inverse_transform(const Pose2& frame, Vec2 point) {
  return rotated(point - frame.position(), -frame.theta);
}

/// A pose given in `frame`, in the frame's parent.
[[nodiscard]] inline Pose2 compose(const Pose2& frame, const Pose2& pose) {
  // What stands, or turns on the spot, needs no sine. (Zeros have signs.)
  if (pose.x == 0.0 && pose.y == 0.0 && frame.x != 0.0 && frame.y != 0.0)
    return {frame.x, frame.y, wrap_angle(frame.theta + pose.theta)};
  const Vec2 p = transform(frame, pose.position());
  return {p.x, p.y, wrap_angle(frame.theta + pose.theta)};
}

/// `pose` as seen from `frame`: compose(frame, relative(frame, pose)) is `pose`.
[[nodiscard]] inline Pose2 relative(const Pose2& frame, const Pose2& pose) {
  const Vec2 p = inverse_transform(frame, pose.position());
  return {p.x, p.y, wrap_angle(pose.theta - frame.theta)};
}

/// The frame in which what is `local` lies at `pose`: compose(result, local) is `pose`.
[[nodiscard]] inline Pose2 frame_from(const Pose2& pose, const Pose2& local) {
  const double theta = wrap_angle(pose.theta - local.theta);
  const Vec2 p = pose.position() - rotated(local.position(), theta);
  return {p.x, p.y, theta};
}

}  // namespace sentree::sim
