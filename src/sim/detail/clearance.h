#pragma once

#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// Exact distance [m] from a point to the nearest occupied cell, whose whole square counts; anything from `enough_m` on
/// is returned as `enough_m`. Outside the map only its cells count.
/// Cost: one look-up far from walls, else O((enough / cell size)^2).
[[nodiscard]] double clearance(const GridMap& map, const DistanceField& distance, Vec2 point, double enough_m);

/// True: no occupied cell of the map lies within `radius_m` of any point of the cell that the point is in. One look-up;
/// false where that does not say it.
[[nodiscard]] bool is_roomy(const GridMap& map, const DistanceField& distance, Vec2 point, double radius_m);

}  // namespace sentree::sim
