#pragma once

#include <compare>
#include <cstdint>
#include <map>

#include "sentree/sim/astar.h"
#include "sentree/sim/cost_grid.h"

namespace sentree::sim {

/// Paths that were found on a grid before: runs of one world drive between the same places.
///
/// Of one grid, since few worlds have robots of several sizes: another takes its place. Bounded in number.
class PlanMemo {
 public:
  /// What find_path gives; valid until the next call. Cost: what was found before takes a comparison of the grid with
  /// the one before, else a search.
  [[nodiscard]] const Plan& path(const CostGrid& grid, Cell start, Cell goal, std::uint64_t expansions_max);

  [[nodiscard]] std::uint64_t searches() const { return searches_; }  ///< Those that it made.

 private:
  struct Key {
    std::uint32_t start;  // slots
    std::uint32_t goal;
    std::uint64_t expansions_max;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  CostGrid grid_;
  std::map<Key, Plan> plans_;
  Plan outside_;
  std::uint64_t searches_ = 0;
};

}  // namespace sentree::sim
