#include "sentree/sim/cost_grid.h"

#include <algorithm>
#include <cstddef>

namespace sentree::sim {

CostGrid::CostGrid(const GridMap& map, const DistanceField& distance, const InflationSpec& spec)
    : width_(map.width()), height_(map.height()) {
  // Half a cell for the robot's place within its own cell.
  const double blocked = spec.blocked_m / map.resolution_m() + 0.5;
  const double inflated = std::min(spec.inflated_m / map.resolution_m(), static_cast<double>(DistanceField::kCellsMax));
  const auto reach = static_cast<std::size_t>(std::max(blocked, inflated)) + 1;
  weight_of_square_.resize(reach * reach);
  for (std::size_t square = 0; square < weight_of_square_.size(); ++square) {
    const double d = std::sqrt(static_cast<double>(square));
    double weight = kFree;
    if (d < blocked)
      weight = kBlocked;
    else if (d < inflated)
      weight = kFree + (kNear - kFree) * (inflated - d) / (inflated - blocked);
    weight_of_square_[square] = static_cast<std::uint8_t>(weight);
  }
  weights_.assign(static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height_ + 2), kBlocked);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Cell c{x, y};
      if (map.is_free(c)) weights_[slot(c)] = weight_at(distance.squared_cells(c));
    }
  }
}

std::uint8_t CostGrid::weight_at(std::uint32_t squared_cells) const {
  return squared_cells < weight_of_square_.size() ? weight_of_square_[squared_cells] : kFree;
}

void CostGrid::add_obstacles(std::span<const Cell> cells) {
  const int reach = static_cast<int>(std::sqrt(static_cast<double>(weight_of_square_.size())));
  for (const Cell obstacle : cells) {
    if (!contains(obstacle)) continue;
    const int y_end = std::min(height_, obstacle.y + reach + 1);
    const int x_end = std::min(width_, obstacle.x + reach + 1);
    for (int y = std::max(0, obstacle.y - reach); y < y_end; ++y) {
      for (int x = std::max(0, obstacle.x - reach); x < x_end; ++x) {
        std::uint8_t& weight = weights_[slot({x, y})];
        if (weight == kBlocked) continue;
        const int dx = x - obstacle.x;
        const int dy = y - obstacle.y;
        const std::uint8_t near = weight_at(static_cast<std::uint32_t>(dx * dx + dy * dy));
        weight = near == kBlocked ? kBlocked : std::max(weight, near);
      }
    }
  }
}

}  // namespace sentree::sim
