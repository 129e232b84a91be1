#include "sentree/sim/laser.h"

#include <algorithm>
#include <limits>

namespace sentree::sim {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
}  // namespace

RayField::RayField(const GridMap& map) : width_(map.width()), height_(map.height()), stride_(map.width() + 2) {
  const auto stride = static_cast<std::size_t>(stride_);
  const auto rows = static_cast<std::size_t>(height_) + 2;
  empty_.assign(stride * rows, 0);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = static_cast<std::size_t>(y + 1) * stride + static_cast<std::size_t>(x + 1);
      empty_[i] = map.at({x, y}) >= GridMap::kOccupiedMin ? 0 : 255;
    }
  }
  // Chessboard distance by two sweeps (Rosenfeld, Pfaltz 1966).
  const auto lower = [](std::uint8_t& cell, std::uint8_t near) {
    if (near < 255 && near + 1 < cell) cell = static_cast<std::uint8_t>(near + 1);
  };
  for (std::size_t y = 1; y + 1 < rows; ++y) {
    for (std::size_t i = y * stride + 1; i < (y + 1) * stride - 1; ++i) {
      lower(empty_[i], std::min({empty_[i - 1], empty_[i - stride - 1], empty_[i - stride], empty_[i - stride + 1]}));
    }
  }
  for (std::size_t y = rows - 2; y >= 1; --y) {
    for (std::size_t i = (y + 1) * stride - 2; i > y * stride; --i) {
      lower(empty_[i], std::min({empty_[i + 1], empty_[i + stride - 1], empty_[i + stride], empty_[i + stride + 1]}));
    }
  }
}

double RayField::cast(Vec2 from, Vec2 direction, double range_max) const {
  if (!(from.x >= 0.0 && from.y >= 0.0 && from.x < width_ && from.y < height_)) return kInfinity;
  // Along an axis on which the ray does not move, it is taken to move up, infinitely slowly.
  const bool up_x = direction.x >= 0.0;
  const bool up_y = direction.y >= 0.0;
  const double inverse_x = direction.x != 0.0 ? 1.0 / direction.x : kInfinity;
  const double inverse_y = direction.y != 0.0 ? 1.0 / direction.y : kInfinity;
  int x = static_cast<int>(from.x);
  int y = static_cast<int>(from.y);
  double t = 0.0;
  for (;;) {
    const int empty = empty_[static_cast<std::size_t>((y + 1) * stride_ + x + 1)];
    if (empty == 0) break;
    // The square of free cells around (x, y) is left as a single large cell would be. Where the ray crosses a boundary
    // is computed from the boundary, never summed up, so the size of the steps does not change a bit of it.
    const double exit_x = ((up_x ? x + empty : x + 1 - empty) - from.x) * inverse_x;
    const double exit_y = ((up_y ? y + empty : y + 1 - empty) - from.y) * inverse_y;
    if (exit_x < exit_y) {
      t = exit_x;
      x += up_x ? empty : -empty;
      y = std::clamp(static_cast<int>(from.y + t * direction.y), y + 1 - empty, y + empty - 1);
    } else {
      t = exit_y;
      y += up_y ? empty : -empty;
      x = std::clamp(static_cast<int>(from.x + t * direction.x), x + 1 - empty, x + empty - 1);
    }
    if (t > range_max) return kInfinity;
  }
  const bool border = x < 0 || y < 0 || x >= width_ || y >= height_;
  return border || t > range_max ? kInfinity : t;
}

void cast_scan(const GridMap& map, const RayField& field, std::span<const Shape> shapes, const Pose2& laser_pose,
               const LaserSpec& spec, std::vector<double>& ranges) {
  const auto beams = static_cast<std::size_t>(spec.beams);
  ranges.resize(beams);
  const double resolution = map.resolution_m();
  const double range_cells = spec.range_max_m / resolution;
  const Vec2 from = map.to_grid(laser_pose.position());
  const double first = laser_pose.theta + spec.angle_min_rad;
  const double turn_cos = std::cos(spec.angle_increment_rad);
  const double turn_sin = std::sin(spec.angle_increment_rad);
  // Turns a direction from beam to beam; after kBeamsMax turns it is off by less than 1e-11.
  const auto turn = [&](Vec2& direction) {
    direction = {turn_cos * direction.x - turn_sin * direction.y, turn_sin * direction.x + turn_cos * direction.y};
  };
  const double first_in_grid = first - map.origin().theta;
  Vec2 direction{std::cos(first_in_grid), std::sin(first_in_grid)};
  for (std::size_t i = 0; i < beams; ++i, turn(direction)) {
    ranges[i] = field.cast(from, direction, range_cells) * resolution;
  }
  for (const Shape& shape : shapes) {
    const double reach = spec.range_max_m + bounding_radius(shape);
    const Vec2 offset = shape.pose.position() - laser_pose.position();
    if (dot(offset, offset) > reach * reach) continue;
    Vec2 ray{std::cos(first), std::sin(first)};
    for (std::size_t i = 0; i < beams; ++i, turn(ray)) {
      ranges[i] = std::min(ranges[i], ray_distance(shape, laser_pose.position(), ray));
    }
  }
  for (double& range : ranges) {
    if (range > spec.range_max_m)
      range = kInfinity;
    else if (range < spec.range_min_m)
      range = -kInfinity;
  }
}

void disturb_scan(const LaserSpec& spec, Rng& rng, std::vector<double>& ranges) {
  if (spec.noise_m <= 0.0 && spec.dropout <= 0.0) return;
  for (double& range : ranges) {
    if (spec.noise_m > 0.0 && std::isfinite(range)) {
      range += spec.noise_m * rng.normal();
      if (range > spec.range_max_m)
        range = kInfinity;
      else if (range < spec.range_min_m)
        range = -kInfinity;
    }
    if (spec.dropout > 0.0 && rng.uniform() < spec.dropout) range = kInfinity;
  }
}

}  // namespace sentree::sim
