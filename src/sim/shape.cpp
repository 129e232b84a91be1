#include "sentree/sim/shape.h"

#include <algorithm>
#include <limits>

namespace sentree::sim {

namespace {

double ray_disc(const Shape& disc, Vec2 from, Vec2 direction) {
  const Vec2 to_centre = disc.pose.position() - from;
  const double along = dot(to_centre, direction);
  const double outside = dot(to_centre, to_centre) - disc.radius_m * disc.radius_m;
  if (outside <= 0.0) return 0.0;
  const double under_root = along * along - outside;
  if (along < 0.0 || under_root < 0.0) return kInfinity;
  return along - std::sqrt(under_root);
}

// Slabs (Kay, Kajiya 1986) in the frame of the box.
double ray_box(const Shape& box, Vec2 from, Vec2 direction) {
  const Vec2 p = inverse_transform(box.pose, from);
  const Vec2 d = rotated(direction, -box.pose.theta);
  double enter = 0.0;
  double leave = kInfinity;
  const auto slab = [&](double position, double step, double half) {
    if (step == 0.0) return position >= -half && position <= half;
    const double a = (-half - position) / step;
    const double b = (half - position) / step;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
    return enter <= leave;
  };
  const bool hit = slab(p.x, d.x, box.length_m / 2) && slab(p.y, d.y, box.width_m / 2);
  return hit ? enter : kInfinity;
}

}  // namespace

Shape Shape::disc(Vec2 centre, double radius_m) {
  return {.kind = Kind::kDisc, .pose = {centre.x, centre.y, 0.0}, .radius_m = radius_m};
}

Shape Shape::box(const Pose2& centre, double length_m, double width_m) {
  return {.kind = Kind::kBox, .pose = centre, .length_m = length_m, .width_m = width_m};
}

Shape Shape::wall(Vec2 a, Vec2 b, double thickness_m) {
  const Vec2 along = b - a;
  const Vec2 middle = a + 0.5 * along;
  return box({middle.x, middle.y, std::atan2(along.y, along.x)}, norm(along), thickness_m);
}

double distance(const Shape& shape, Vec2 point) {
  if (shape.kind == Shape::Kind::kDisc) {
    return std::max(0.0, distance(shape.pose.position(), point) - shape.radius_m);
  }
  const Vec2 p = inverse_transform(shape.pose, point);
  return norm({std::max(0.0, std::abs(p.x) - shape.length_m / 2), std::max(0.0, std::abs(p.y) - shape.width_m / 2)});
}

double ray_distance(const Shape& shape, Vec2 from, Vec2 direction) {
  return shape.kind == Shape::Kind::kDisc ? ray_disc(shape, from, direction) : ray_box(shape, from, direction);
}

double bounding_radius(const Shape& shape) {
  return shape.kind == Shape::Kind::kDisc ? shape.radius_m : norm({shape.length_m / 2, shape.width_m / 2});
}

std::array<Vec2, 4> corners(const Shape& box) {
  const double x = box.length_m / 2;
  const double y = box.width_m / 2;
  return {transform(box.pose, {-x, -y}), transform(box.pose, {x, -y}), transform(box.pose, {x, y}),
          transform(box.pose, {-x, y})};
}

}  // namespace sentree::sim
