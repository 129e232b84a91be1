#include "sentree/sim/plan_memo.h"

#include <cstddef>

namespace sentree::sim {

namespace {

constexpr std::size_t kPlansMax = 1024;

}  // namespace

const Plan& PlanMemo::path(const CostGrid& grid, Cell start, Cell goal, std::uint64_t expansions_max) {
  // Cells outside have no slot of their own.
  if (!grid.contains(start) || !grid.contains(goal)) return outside_;
  if (grid != grid_) {
    plans_.clear();
    grid_ = grid;
  }
  if (plans_.size() >= kPlansMax) plans_.clear();
  const auto [found, is_new] = plans_.try_emplace(Key{grid.slot(start), grid.slot(goal), expansions_max});
  if (is_new) {
    found->second = find_path(grid, start, goal, expansions_max);
    ++searches_;
  }
  return found->second;
}

}  // namespace sentree::sim
