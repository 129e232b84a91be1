#include "sentree/sim/detail/obstacle_layer.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace sentree::sim {

namespace {

// A return this near to a wall of the map is the wall, seen with the errors of pose and range.
constexpr double kWallMargin_m = 0.15;

// True if the beams around the cell's bearing all end well behind it.
bool is_seen_through(const LaserSpec& laser, const Pose2& laser_pose, std::span<const double> ranges, Vec2 centre,
                     double margin_m) {
  const Vec2 offset = centre - laser_pose.position();
  const double range = norm(offset);
  if (range + margin_m > laser.range_max_m) return false;
  double bearing = wrap_angle(std::atan2(offset.y, offset.x) - laser_pose.theta - laser.angle_min_rad);
  if (bearing < 0.0) bearing += 2.0 * std::numbers::pi;
  const int beams = static_cast<int>(ranges.size());
  const int nearest = static_cast<int>(std::lround(bearing / laser.angle_increment_rad));
  const bool whole_turn = laser.angle_increment_rad * beams > 2.0 * std::numbers::pi - 1e-6;
  for (int beam = nearest - 1; beam <= nearest + 1; ++beam) {
    const int i = whole_turn ? ((beam % beams) + beams) % beams : beam;
    if (i < 0 || i >= beams) return false;
    const double seen = ranges[static_cast<std::size_t>(i)];
    if (!(seen > range + margin_m)) return false;
  }
  return true;
}

}  // namespace

std::vector<Cell> update_obstacles(const GridMap& map, const DistanceField& distance, const CostGrid& grid,
                                   const LaserSpec& laser, const Pose2& laser_pose, const Sight& sight,
                                   std::vector<std::uint32_t>& seen) {
  if (seen.empty() && sight.shows_walls_only(laser_pose, kObstacleRangeMax_m, kWallMargin_m)) return {};
  const std::vector<double>& ranges = sight.ranges();
  const double margin_m = map.resolution_m();
  std::erase_if(seen, [&](std::uint32_t slot) {
    return is_seen_through(laser, laser_pose, ranges, map.centre(grid.cell(slot)), margin_m);
  });

  const double wall_cells = kWallMargin_m / map.resolution_m();
  const double near_square = wall_cells * wall_cells;
  std::vector<Cell> added;
  const std::size_t known = seen.size();
  const Vec2 axis{std::cos(laser_pose.theta), std::sin(laser_pose.theta)};
  const std::span<const Vec2> beams = beam_directions(laser, ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double range = ranges[i];
    if (!(range > 0.0 && range <= kObstacleRangeMax_m)) continue;
    const auto [c, s] = beams[i];
    const Cell cell = map.cell_at(
        {laser_pose.x + range * (c * axis.x - s * axis.y), laser_pose.y + range * (s * axis.x + c * axis.y)});
    if (!map.contains(cell) || distance.squared_cells(cell) <= near_square) continue;
    const std::uint32_t slot = grid.slot(cell);
    const auto before = seen.begin() + static_cast<std::ptrdiff_t>(known);
    if (std::binary_search(seen.begin(), before, slot) || std::find(before, seen.end(), slot) != seen.end()) continue;
    seen.push_back(slot);
    added.push_back(cell);
  }
  if (!added.empty()) std::sort(seen.begin(), seen.end());
  return added;
}

}  // namespace sentree::sim
