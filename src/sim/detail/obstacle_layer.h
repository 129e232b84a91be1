#pragma once

#include <cstdint>
#include <vector>

#include "sentree/sim/cost_grid.h"
#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/laser.h"
#include "sentree/sim/sight.h"

namespace sentree::sim {

/// Returns further away than this mark no obstacle: there, a small error of the heading displaces them too far.
inline constexpr double kObstacleRangeMax_m = 3.0;

/// Takes a scan into the set of obstacle cells that the map does not hold (CostGrid slots, ascending): a cell is
/// added where a beam ended away from the map's walls, removed where beams pass over it.
/// Returns the cells that are new. Cost: O(beams + cells); nothing where the sight is known to show walls only.
std::vector<Cell> update_obstacles(const GridMap& map, const DistanceField& distance, const CostGrid& grid,
                                   const LaserSpec& laser, const Pose2& laser_pose, const Sight& sight,
                                   std::vector<std::uint32_t>& seen);

}  // namespace sentree::sim
