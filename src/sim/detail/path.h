#pragma once

#include <span>
#include <vector>

#include "sentree/sim/cost_grid.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// Weighted length [cells x weight] of the straight segment between two points of the map frame; negative if it
/// enters a blocked cell. O(length).
[[nodiscard]] double segment_cost(const CostGrid& grid, const GridMap& map, Vec2 a, Vec2 b);

/// The corners of a path of cells pulled straight wherever the straight line costs no more; from `start` to `target`,
/// points in the first and the last of the cells. O(cells x longest segment).
[[nodiscard]] std::vector<Vec2> straightened(const CostGrid& grid, const GridMap& map, std::span<const Cell> cells,
                                             Vec2 start, Vec2 target);

/// Where a point stands along a path.
struct PathPlace {
  std::size_t segment = 0;   ///< From point `segment` to the next.
  Vec2 nearest;              ///< On it.
  double remaining_m = 0.0;  ///< Along the path from there to its end.
};

/// The nearest place on the path from segment `from` on that is at most `window_m` ahead. An empty path has none.
[[nodiscard]] PathPlace place_on_path(std::span<const Vec2> path, std::size_t from, Vec2 point, double window_m);

/// The point `ahead_m` further along the path, or its end.
[[nodiscard]] Vec2 point_ahead(std::span<const Vec2> path, const PathPlace& place, double ahead_m);

/// Distance from a point to the segment from `a` to `b`.
[[nodiscard]] double distance_to_segment(Vec2 a, Vec2 b, Vec2 point);

}  // namespace sentree::sim
