#pragma once

#include <vector>

#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// Cells of what the robots know beyond the map without seeing it, to be inflated by the planner: obstacles and closed
/// doors that are on_map. O(cells of their bounding squares).
[[nodiscard]] std::vector<Cell> announced_cells(const World& world, const State& state);

}  // namespace sentree::sim
