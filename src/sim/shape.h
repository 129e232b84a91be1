#pragma once

#include <array>

#include "sentree/sim/geometry.h"

namespace sentree::sim {

/// What obstacles, doors and robots look like to a laser and to a collision test: a disc or an oriented box.
struct Shape {
  enum class Kind { kDisc, kBox };

  Kind kind = Kind::kDisc;
  Pose2 pose;             ///< Centre; the heading matters to a box only.
  double radius_m = 0.0;  ///< Disc.
  double length_m = 0.0;  ///< Box, along its x axis.
  double width_m = 0.0;   ///< Box, along its y axis.

  [[nodiscard]] static Shape disc(Vec2 centre, double radius_m);
  [[nodiscard]] static Shape box(const Pose2& centre, double length_m, double width_m);
  /// The box that a wall or a closed door from `a` to `b` fills.
  [[nodiscard]] static Shape wall(Vec2 a, Vec2 b, double thickness_m);

  friend bool operator==(const Shape&, const Shape&) = default;
};

/// Distance from a point to the shape [m]; 0 inside.
[[nodiscard]] double distance(const Shape& shape, Vec2 point);

/// Distance along the ray from `from` in the unit direction `direction` to the shape [m]; 0 from inside, +inf if
/// missed.
[[nodiscard]] double ray_distance(const Shape& shape, Vec2 from, Vec2 direction);

/// Radius of the circle around `pose` that holds the shape [m].
[[nodiscard]] double bounding_radius(const Shape& shape);

/// Corners of a box, counter-clockwise.
[[nodiscard]] std::array<Vec2, 4> corners(const Shape& box);

}  // namespace sentree::sim
