#pragma once

#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// Exact distance [m] from a point to the nearest occupied cell, whose whole square counts; anything from `enough_m` on
/// is returned as `enough_m`. Outside the map only its cells count.
/// Cost: one look-up far from walls, else O((enough / cell size)^2).
[[nodiscard]] double clearance(const GridMap& map, const DistanceField& distance, Vec2 point, double enough_m);

}  // namespace sentree::sim
