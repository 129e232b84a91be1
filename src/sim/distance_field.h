#pragma once

#include <cstdint>
#include <vector>

#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// Exact Euclidean distance from every cell's centre to the centre of the nearest occupied cell, up to a bound.
class DistanceField {
 public:
  /// Distances are exact below this many cells and equal to it beyond; their squares fit 16 bits.
  static constexpr int kCellsMax = 255;

  DistanceField() = default;
  /// Cost: O(cells), two passes over rows and columns.
  /// Source: Meijster, Roerdink, Hesselink, "A General Algorithm for Computing Distance Transforms in Linear Time",
  /// 2000.
  explicit DistanceField(const GridMap& map);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Square of the distance [cells^2] of a cell of the map.
  [[nodiscard]] std::uint16_t squared_cells(Cell c) const {
    return squared_[static_cast<std::size_t>(c.y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(c.x)];
  }
  [[nodiscard]] const std::vector<std::uint16_t>& squared_cells() const { return squared_; }

  friend bool operator==(const DistanceField&, const DistanceField&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint16_t> squared_;
};

}  // namespace sentree::sim
