#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// How far the planner keeps from obstacles.
struct InflationSpec {
  double blocked_m = 0.30;   ///< Nearer to an obstacle the robot's centre must not go.
  double inflated_m = 0.80;  ///< Beyond this distance, nearness costs nothing.

  friend bool operator==(const InflationSpec&, const InflationSpec&) = default;
};

/// What it costs to enter each cell: 0 blocked, kFree (far from obstacles) to kNear.
///
/// Holds a border of blocked cells, so that a search needs no bounds checks; `slot` counts with the border.
class CostGrid {
 public:
  static constexpr std::uint8_t kBlocked = 0;
  static constexpr std::uint8_t kFree = 10;
  static constexpr std::uint8_t kNear = 60;

  CostGrid() = default;
  /// The static map inflated; unknown cells are blocked. O(cells).
  CostGrid(const GridMap& map, const DistanceField& distance, const InflationSpec& spec);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int stride() const { return width_ + 2; }
  [[nodiscard]] bool contains(Cell c) const { return c.x >= 0 && c.y >= 0 && c.x < width_ && c.y < height_; }
  [[nodiscard]] std::uint32_t slot(Cell c) const { return static_cast<std::uint32_t>((c.y + 1) * stride() + c.x + 1); }
  [[nodiscard]] Cell cell(std::uint32_t slot) const {
    return {static_cast<int>(slot) % stride() - 1, static_cast<int>(slot) / stride() - 1};
  }
  /// kBlocked outside the map.
  [[nodiscard]] std::uint8_t at(Cell c) const { return contains(c) ? weights_[slot(c)] : kBlocked; }
  [[nodiscard]] const std::vector<std::uint8_t>& weights() const { return weights_; }
  void set(Cell c, std::uint8_t weight) { weights_[slot(c)] = weight; }

  /// Inflates obstacles that the map does not hold; cells outside the map are ignored.
  /// Cost: O(cells · inflation area).
  void add_obstacles(std::span<const Cell> cells);

  friend bool operator==(const CostGrid&, const CostGrid&) = default;

 private:
  [[nodiscard]] std::uint8_t weight_at(std::uint32_t squared_cells) const;

  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> weights_;
  std::vector<std::uint8_t> weight_of_square_;  // by squared distance [cells^2]; beyond its end: kFree
};

}  // namespace sentree::sim
