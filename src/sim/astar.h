#pragma once

#include <cstdint>
#include <vector>

#include "sentree/sim/cost_grid.h"

namespace sentree::sim {

/// Lengths of a step to the side and along the diagonal, in fifths of a cell.
inline constexpr std::uint32_t kStraightStep = 5;
inline constexpr std::uint32_t kDiagonalStep = 7;

struct Plan {
  enum class Outcome { kFound, kNoPath, kLimit };

  Outcome outcome = Outcome::kNoPath;
  std::vector<Cell> cells;  ///< From start to goal, both included; empty unless found.
  std::uint32_t cost = 0;   ///< Sum over the steps of length times the weight of the cell entered.
  std::uint64_t expansions = 0;
};

/// The cheapest path over the eight neighbours; a diagonal step needs both cells beside it open, so corners are not
/// cut.
///
/// The start may be blocked (its weight is never paid); a blocked goal has no path. The heuristic, octile distance
/// times the least weight, is consistent: no cell is expanded twice and the path is optimal. Among equals the choice
/// is fixed. Gives up with kLimit after `expansions_max` cells.
/// Cost: O(expansions), plus clearing 5 bytes a cell.
/// Source: Hart, Nilsson, Raphael 1968; open list as buckets: Dial 1969.
[[nodiscard]] Plan find_path(const CostGrid& grid, Cell start, Cell goal, std::uint64_t expansions_max);

}  // namespace sentree::sim
