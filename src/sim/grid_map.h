#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sentree/sim/geometry.h"

namespace sentree::sim {

/// A map has at most this many cells (4096 x 4096); path costs are sized for it.
inline constexpr std::size_t kMapCellsMax = std::size_t{1} << 24U;
/// Columns or rows; squares of distances fit an int.
inline constexpr int kMapSideMax = 1 << 15;

/// Column and row, counted from the map's lower left cell.
struct Cell {
  int x = 0;
  int y = 0;
  friend bool operator==(const Cell&, const Cell&) = default;
};

/// Occupancy as in nav_msgs/OccupancyGrid: row-major from the lower left cell, -1 unknown, 0 (free) to 100 (occupied).
///
/// `origin` is the pose of the lower left corner of cell (0, 0) in the map frame; its heading turns the grid.
class GridMap {
 public:
  static constexpr std::int8_t kUnknown = -1;
  /// Cells from this value on are walls to laser, robot and planner (map_saver's occupied threshold).
  static constexpr std::int8_t kOccupiedMin = 65;

  GridMap() = default;
  /// `cells` has width x height entries; anything else is a bug of the caller.
  GridMap(int width, int height, double resolution_m, Pose2 origin, std::vector<std::int8_t> cells);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] const Pose2& origin() const { return origin_; }
  [[nodiscard]] const std::vector<std::int8_t>& cells() const { return cells_; }

  [[nodiscard]] bool contains(Cell c) const { return c.x >= 0 && c.y >= 0 && c.x < width_ && c.y < height_; }
  [[nodiscard]] std::size_t index(Cell c) const {
    return static_cast<std::size_t>(c.y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(c.x);
  }
  /// The value of a cell of the map.
  [[nodiscard]] std::int8_t at(Cell c) const { return cells_[index(c)]; }
  /// False outside the map.
  [[nodiscard]] bool is_occupied(Cell c) const { return contains(c) && at(c) >= kOccupiedMin; }
  /// Known and below `kOccupiedMin`; false outside the map.
  [[nodiscard]] bool is_free(Cell c) const { return contains(c) && at(c) >= 0 && at(c) < kOccupiedMin; }

  /// Continuous grid coordinates [cells] of a point of the map frame; cell (x, y) covers [x, x+1) x [y, y+1).
  [[nodiscard]] Vec2 to_grid(Vec2 point) const {
    const double dx = point.x - origin_.x;
    const double dy = point.y - origin_.y;
    return {(cos_ * dx + sin_ * dy) / resolution_m_, (cos_ * dy - sin_ * dx) / resolution_m_};
  }
  [[nodiscard]] Vec2 from_grid(Vec2 grid) const {
    const double gx = grid.x * resolution_m_;
    const double gy = grid.y * resolution_m_;
    return {origin_.x + cos_ * gx - sin_ * gy, origin_.y + sin_ * gx + cos_ * gy};
  }
  /// The cell that holds a point; points far outside give some cell outside.
  [[nodiscard]] Cell cell_at(Vec2 point) const;
  /// The centre of a cell in the map frame.
  [[nodiscard]] Vec2 centre(Cell c) const { return from_grid({c.x + 0.5, c.y + 0.5}); }

  friend bool operator==(const GridMap&, const GridMap&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  double resolution_m_ = 1.0;
  Pose2 origin_;
  double cos_ = 1.0;
  double sin_ = 0.0;
  std::vector<std::int8_t> cells_;
};

/// The part of the map that holds every known cell; poses in the map frame keep their meaning. A map without a known
/// cell is returned whole. O(cells).
[[nodiscard]] GridMap cropped_to_known(const GridMap& map);

}  // namespace sentree::sim
