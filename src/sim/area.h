#pragma once

#include <span>

#include "sentree/sim/cost_grid.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// True if the point lies inside the polygon (even-odd rule). O(corners).
[[nodiscard]] bool is_inside(std::span<const Vec2> corners, Vec2 point);

/// The centre of mass of a polygon; the mean of the corners where it has no area.
[[nodiscard]] Vec2 centroid(std::span<const Vec2> corners);

/// Where to go in an area: its centroid, or the open cell inside nearest to that. The centroid if there is none.
/// O(cells of the polygon's bounding box).
[[nodiscard]] Vec2 standing_place(const GridMap& map, const CostGrid& costs, std::span<const Vec2> corners);

}  // namespace sentree::sim
