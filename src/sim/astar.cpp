#include "sentree/sim/astar.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace sentree::sim {

namespace {

constexpr std::uint32_t kUnreached = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint8_t kNoParent = 8;
constexpr std::uint8_t kClosed = 0x80;

// More than f can grow in one step (diagonal into the costliest cell, plus the heuristic's change), and a power of two.
constexpr std::size_t kBuckets = 512;
static_assert(kDiagonalStep * (CostGrid::kNear + CostGrid::kFree) < kBuckets);
// A cheapest path does not touch itself, so it enters at most every second cell: costs fit 32 bits.
static_assert(kMapCellsMax / 2 * kStraightStep * CostGrid::kNear < kUnreached);

class OpenList {
 public:
  explicit OpenList(std::uint32_t f) : f_(f) {}
  void push(std::uint32_t f, std::uint32_t slot) {
    buckets_[f % kBuckets].push_back(slot);
    ++size_;
  }
  bool empty() const { return size_ == 0; }
  // Some slot with the least f; of those, the one pushed last, which is the deepest.
  std::uint32_t pop() {
    while (buckets_[f_ % kBuckets].empty()) ++f_;
    auto& bucket = buckets_[f_ % kBuckets];
    const std::uint32_t slot = bucket.back();
    bucket.pop_back();
    --size_;
    return slot;
  }

 private:
  std::uint32_t f_;
  std::size_t size_ = 0;
  std::array<std::vector<std::uint32_t>, kBuckets> buckets_;
};

}  // namespace

Plan find_path(const CostGrid& grid, Cell start, Cell goal, std::uint64_t expansions_max) {
  Plan plan;
  if (!grid.contains(start) || !grid.contains(goal) || grid.at(goal) == CostGrid::kBlocked) return plan;
  const std::vector<std::uint8_t>& weights = grid.weights();
  const int stride = grid.stride();
  // Counter-clockwise from +x; odd ones are diagonal.
  const std::array<int, 8> offset{1, 1 + stride, stride, stride - 1, -1, -1 - stride, -stride, 1 - stride};
  constexpr std::array<int, 8> kDx{1, 1, 0, -1, -1, -1, 0, 1};
  constexpr std::array<int, 8> kDy{0, 1, 1, 1, 0, -1, -1, -1};

  std::vector<std::uint32_t> cost(weights.size(), kUnreached);
  std::vector<std::uint8_t> came_by(weights.size(), kNoParent);
  const auto heuristic = [&](int x, int y) {
    const auto dx = static_cast<std::uint32_t>(std::abs(x - goal.x));
    const auto dy = static_cast<std::uint32_t>(std::abs(y - goal.y));
    const std::uint32_t diagonal = std::min(dx, dy);
    return CostGrid::kFree * (kStraightStep * (dx + dy) - (2 * kStraightStep - kDiagonalStep) * diagonal);
  };

  const std::uint32_t start_slot = grid.slot(start);
  const std::uint32_t goal_slot = grid.slot(goal);
  cost[start_slot] = 0;
  OpenList open(heuristic(start.x, start.y));
  open.push(heuristic(start.x, start.y), start_slot);
  while (!open.empty()) {
    const std::uint32_t slot = open.pop();
    if ((came_by[slot] & kClosed) != 0) continue;
    came_by[slot] |= kClosed;
    if (slot == goal_slot) {
      plan.outcome = Plan::Outcome::kFound;
      break;
    }
    if (plan.expansions >= expansions_max) {
      plan.outcome = Plan::Outcome::kLimit;
      return plan;
    }
    ++plan.expansions;
    const Cell c = grid.cell(slot);
    for (std::size_t k = 0; k < 8; ++k) {
      const std::uint32_t next = slot + static_cast<std::uint32_t>(offset[k]);
      const std::uint8_t weight = weights[next];
      if (weight == CostGrid::kBlocked || (came_by[next] & kClosed) != 0) continue;
      std::uint32_t length = kStraightStep;
      if ((k & 1U) != 0) {
        if (weights[slot + static_cast<std::uint32_t>(offset[k - 1])] == CostGrid::kBlocked) continue;
        if (weights[slot + static_cast<std::uint32_t>(offset[(k + 1) & 7U])] == CostGrid::kBlocked) continue;
        length = kDiagonalStep;
      }
      const std::uint32_t through = cost[slot] + length * weight;
      if (through >= cost[next]) continue;
      cost[next] = through;
      came_by[next] = static_cast<std::uint8_t>(k);
      open.push(through + heuristic(c.x + kDx[k], c.y + kDy[k]), next);
    }
  }
  if (plan.outcome != Plan::Outcome::kFound) return plan;

  plan.cost = cost[goal_slot];
  for (std::uint32_t slot = goal_slot;;) {
    plan.cells.push_back(grid.cell(slot));
    const std::uint8_t by = came_by[slot] & static_cast<std::uint8_t>(~kClosed);
    if (by == kNoParent) break;
    slot -= static_cast<std::uint32_t>(offset[by]);
  }
  std::reverse(plan.cells.begin(), plan.cells.end());
  return plan;
}

}  // namespace sentree::sim
