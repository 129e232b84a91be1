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
  const int step_x = direction.x > 0.0 ? 1 : -1;
  const int step_y = direction.y > 0.0 ? 1 : -1;
  const int ahead_x = direction.x > 0.0 ? 1 : 0;
  const int ahead_y = direction.y > 0.0 ? 1 : 0;
  const double inverse_x = direction.x != 0.0 ? 1.0 / direction.x : kInfinity;
  const double inverse_y = direction.y != 0.0 ? 1.0 / direction.y : kInfinity;
  const double inverse_max = 1.0 / std::max(std::abs(direction.x), std::abs(direction.y));
  int x = static_cast<int>(from.x);
  int y = static_cast<int>(from.y);
  double t = 0.0;
  // The parameter at which the ray leaves cell (x, y) is computed from the boundary each time, never summed up, so
  // that skipping cells cannot change it.
  const auto exit_x = [&] { return direction.x != 0.0 ? (x + ahead_x - from.x) * inverse_x : kInfinity; };
  const auto exit_y = [&] { return direction.y != 0.0 ? (y + ahead_y - from.y) * inverse_y : kInfinity; };
  double next_x = exit_x();
  double next_y = exit_y();
  for (;;) {
    const int empty = empty_[static_cast<std::size_t>((y + 1) * stride_ + x + 1)];
    if (empty == 0) break;
    if (empty > 3) {
      // Every cell up to empty - 1 away is free. The margin keeps rounding from reaching one further.
      t += (empty - 1 - 1e-6) * inverse_max;
      if (t > range_max) return kInfinity;
      x = static_cast<int>(from.x + t * direction.x);
      y = static_cast<int>(from.y + t * direction.y);
      next_x = exit_x();
      next_y = exit_y();
      continue;
    }
    if (next_x < next_y) {
      t = next_x;
      x += step_x;
      next_x = exit_x();
    } else {
      t = next_y;
      y += step_y;
      next_y = exit_y();
    }
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
  const double first_in_grid = first - map.origin().theta;
  for (std::size_t i = 0; i < beams; ++i) {
    const double angle = first_in_grid + static_cast<double>(i) * spec.angle_increment_rad;
    ranges[i] = field.cast(from, {std::cos(angle), std::sin(angle)}, range_cells) * resolution;
  }
  for (const Shape& shape : shapes) {
    const double reach = spec.range_max_m + bounding_radius(shape);
    const Vec2 offset = shape.pose.position() - laser_pose.position();
    if (dot(offset, offset) > reach * reach) continue;
    for (std::size_t i = 0; i < beams; ++i) {
      const double angle = first + static_cast<double>(i) * spec.angle_increment_rad;
      const double range = ray_distance(shape, laser_pose.position(), {std::cos(angle), std::sin(angle)});
      ranges[i] = std::min(ranges[i], range);
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
