#include "sentree/sim/laser.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "sentree/base/assert.h"

namespace sentree::sim {

namespace {

// Turns the direction of a beam into that of the next.
class BeamTurns {
 public:
  explicit BeamTurns(const LaserSpec& spec)
      : cos_(std::cos(spec.angle_increment_rad)), sin_(std::sin(spec.angle_increment_rad)) {}
  // After kBeamsMax turns it is off by less than 1e-11.
  void turn(Vec2& direction) const {
    direction = {cos_ * direction.x - sin_ * direction.y, sin_ * direction.x + cos_ * direction.y};
  }

 private:
  double cos_;
  double sin_;
};

double reported(const LaserSpec& spec, double range) {
  return range > spec.range_max_m ? kInfinity : range < spec.range_min_m ? -kInfinity : range;
}

}  // namespace

RayField::RayField(const GridMap& map) : width_(map.width()), height_(map.height()), stride_(map.width() + 2) {
  const auto stride = static_cast<std::ptrdiff_t>(stride_);
  const auto slots = static_cast<std::size_t>(stride_) * (static_cast<std::size_t>(height_) + 2);
  for (std::size_t quadrant = 0; quadrant < empty_.size(); ++quadrant) {
    std::vector<std::uint8_t>& empty = empty_[quadrant];
    empty.assign(slots, 0);
    const std::ptrdiff_t step_x = (quadrant & 1U) == 0 ? 1 : -1;
    const std::ptrdiff_t step_y = (quadrant & 2U) == 0 ? stride : -stride;
    // Against the direction of travel, so that the three cells ahead are known.
    for (int j = 0; j < height_; ++j) {
      const int y = step_y > 0 ? height_ - 1 - j : j;
      for (int i = 0; i < width_; ++i) {
        const int x = step_x > 0 ? width_ - 1 - i : i;
        if (map.at({x, y}) >= GridMap::kOccupiedMin) continue;
        std::uint8_t* cell = empty.data() + (y + 1) * stride + x + 1;
        const int ahead = std::min({cell[step_x], cell[step_y], cell[step_x + step_y]});
        *cell = static_cast<std::uint8_t>(std::min(ahead + 1, 255));
      }
    }
  }
}

// A ray in coordinates that count from the corner of its first cell behind it, ahead along both axes: so every ray
// climbs to the right. (u, v) is the cell that it is in.
struct RayField::Ray {
  const std::uint8_t* origin;  // of the first cell, (x, y) of the map
  int x;
  int y;
  std::ptrdiff_t step_u;
  std::ptrdiff_t step_v;
  double from_u;
  double from_v;
  double along_u;
  double along_v;
  double inverse_u;
  double inverse_v;
  double range_max;
  double t = 0.0;
  int u = 0;
  int v = 0;
  int empty;

  // Without branches on the direction, which nobody can predict.
  void advance() {
    // The square of free cells ahead is left as a single large cell would be.
    const int side = std::max(empty, 1);
    const int end_u = u + side;
    const int end_v = v + side;
    const double exit_u = (end_u - from_u) * inverse_u;
    const double exit_v = (end_v - from_v) * inverse_v;
    const bool right = exit_u < exit_v;
    const double exit = right ? exit_u : exit_v;
    const int at_u = std::clamp(static_cast<int>(from_u + exit * along_u), u, end_u - 1);
    const int at_v = std::clamp(static_cast<int>(from_v + exit * along_v), v, end_v - 1);
    t = empty != 0 ? exit : t;
    u = empty == 0 ? u : right ? end_u : at_u;
    v = empty == 0 ? v : right ? at_v : end_v;
    // Ended rays stay where they are.
    const int next = origin[u * step_u + v * step_v];
    empty = t > range_max ? 0 : next;
  }
  bool ended() const { return empty == 0; }
};

bool RayField::contains(Vec2 from) const {
  return from.x >= 0.0 && from.y >= 0.0 && from.x < width_ && from.y < height_;
}

RayField::Ray RayField::start(Vec2 from, Vec2 direction, double range_max) const {
  const int x = static_cast<int>(from.x);
  const int y = static_cast<int>(from.y);
  // Along an axis on which the ray does not move, it is taken to move up, infinitely slowly.
  const bool up_x = direction.x >= 0.0;
  const bool up_y = direction.y >= 0.0;
  const std::size_t slot =
      static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(x + 1);
  Ray ray{.origin = empty_[(up_x ? 0U : 1U) + (up_y ? 0U : 2U)].data() + slot,
          .x = x,
          .y = y,
          .step_u = up_x ? 1 : -1,
          .step_v = up_y ? stride_ : -stride_,
          .from_u = up_x ? from.x - x : x + 1 - from.x,
          .from_v = up_y ? from.y - y : y + 1 - from.y,
          .along_u = std::abs(direction.x),
          .along_v = std::abs(direction.y),
          .inverse_u = direction.x != 0.0 ? 1.0 / std::abs(direction.x) : kInfinity,
          .inverse_v = direction.y != 0.0 ? 1.0 / std::abs(direction.y) : kInfinity,
          .range_max = range_max,
          .empty = 0};
  ray.empty = *ray.origin;
  return ray;
}

double RayField::length(const Ray& ray) const {
  const int x = ray.x + (ray.step_u > 0 ? ray.u : -ray.u);
  const int y = ray.y + (ray.step_v > 0 ? ray.v : -ray.v);
  // Beyond the border there is nothing to see.
  const bool inside = x >= 0 && y >= 0 && x < width_ && y < height_;
  return inside && ray.t <= ray.range_max ? ray.t : kInfinity;
}

double RayField::cast(Vec2 from, Vec2 direction, double range_max) const {
  if (!contains(from)) return kInfinity;
  Ray ray = start(from, direction, range_max);
  while (!ray.ended()) ray.advance();
  return length(ray);
}

void RayField::cast(Vec2 from, std::span<const Vec2> directions, double range_max, std::span<double> ranges) const {
  SENTREE_ASSERT(directions.size() == ranges.size());
  if (!contains(from)) {
    std::fill(ranges.begin(), ranges.end(), kInfinity);
    return;
  }
  std::size_t i = 0;
  // Each step of a ray waits for the one before; the steps of four rays overlap.
  for (; i + 4 <= directions.size(); i += 4) {
    Ray a = start(from, directions[i], range_max);
    Ray b = start(from, directions[i + 1], range_max);
    Ray c = start(from, directions[i + 2], range_max);
    Ray d = start(from, directions[i + 3], range_max);
    while ((a.empty | b.empty | c.empty | d.empty) != 0) {
      a.advance();
      b.advance();
      c.advance();
      d.advance();
    }
    ranges[i] = length(a);
    ranges[i + 1] = length(b);
    ranges[i + 2] = length(c);
    ranges[i + 3] = length(d);
  }
  for (; i < directions.size(); ++i) ranges[i] = cast(from, directions[i], range_max);
}

void cast_scan(const GridMap& map, const RayField& field, std::span<const Shape> shapes, const Pose2& laser_pose,
               const LaserSpec& spec, std::vector<double>& ranges) {
  const auto beams = static_cast<std::size_t>(spec.beams);
  ranges.resize(beams);
  const double resolution = map.resolution_m();
  const double range_cells = spec.range_max_m / resolution;
  const Vec2 from = map.to_grid(laser_pose.position());
  const double first = laser_pose.theta + spec.angle_min_rad;
  const BeamTurns turns(spec);
  const double first_in_grid = first - map.origin().theta;
  Vec2 direction{std::cos(first_in_grid), std::sin(first_in_grid)};
  // A block at a time, for a bounded buffer.
  constexpr std::size_t kBlock = 64;
  std::array<Vec2, kBlock> directions;
  for (std::size_t begin = 0; begin < beams; begin += kBlock) {
    const std::size_t count = std::min(kBlock, beams - begin);
    for (std::size_t i = 0; i < count; ++i, turns.turn(direction)) directions[i] = direction;
    field.cast(from, std::span(directions).first(count), range_cells, std::span(ranges).subspan(begin, count));
  }
  for (double& range : ranges) range *= resolution;
  for (const Shape& shape : shapes) {
    const double reach = spec.range_max_m + bounding_radius(shape);
    const Vec2 offset = shape.pose.position() - laser_pose.position();
    if (dot(offset, offset) > reach * reach) continue;
    Vec2 ray{std::cos(first), std::sin(first)};
    for (std::size_t i = 0; i < beams; ++i, turns.turn(ray)) {
      ranges[i] = std::min(ranges[i], ray_distance(shape, laser_pose.position(), ray));
    }
  }
  for (double& range : ranges) range = reported(spec, range);
}

void cast_beams(const GridMap& map, const RayField& field, const Pose2& laser_pose, const LaserSpec& spec,
                std::span<const std::size_t> beams, std::span<double> ranges) {
  SENTREE_ASSERT(beams.size() == ranges.size());
  const double resolution = map.resolution_m();
  const double first = laser_pose.theta + spec.angle_min_rad - map.origin().theta;
  const BeamTurns turns(spec);
  thread_local std::vector<Vec2> directions;
  directions.clear();
  Vec2 direction{std::cos(first), std::sin(first)};
  std::size_t at = 0;
  for (const std::size_t beam : beams) {
    SENTREE_ASSERT(beam >= at);
    for (; at < beam; ++at) turns.turn(direction);
    directions.push_back(direction);
  }
  field.cast(map.to_grid(laser_pose.position()), directions, spec.range_max_m / resolution, ranges);
  for (double& range : ranges) range = reported(spec, range * resolution);
}

std::span<const Vec2> beam_directions(const LaserSpec& spec, std::size_t beams) {
  thread_local double first = 0.0;
  thread_local double increment = 0.0;
  thread_local std::vector<Vec2> known;
  if (known.size() == beams && first == spec.angle_min_rad && increment == spec.angle_increment_rad) return known;
  first = spec.angle_min_rad;
  increment = spec.angle_increment_rad;
  known.resize(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    const double angle = first + static_cast<double>(i) * increment;
    known[i] = {std::cos(angle), std::sin(angle)};
  }
  return known;
}

void disturb_scan(const LaserSpec& spec, Rng& rng, std::vector<double>& ranges) {
  if (spec.noise_m <= 0.0 && spec.dropout <= 0.0) return;
  for (double& range : ranges) {
    if (spec.noise_m > 0.0 && std::isfinite(range)) {
      range = reported(spec, range + spec.noise_m * rng.normal());
    }
    if (spec.dropout > 0.0 && rng.uniform() < spec.dropout) range = kInfinity;
  }
}

}  // namespace sentree::sim
