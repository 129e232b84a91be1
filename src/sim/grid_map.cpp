#include "sentree/sim/grid_map.h"

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"

namespace sentree::sim {

GridMap::GridMap(int width, int height, double resolution_m, Pose2 origin, std::vector<std::int8_t> cells)
    : width_(width),
      height_(height),
      resolution_m_(resolution_m),
      origin_(origin),
      cos_(std::cos(origin.theta)),
      sin_(std::sin(origin.theta)),
      cells_(std::move(cells)) {
  SENTREE_ASSERT(width >= 0 && height >= 0 && width <= kMapSideMax && height <= kMapSideMax && resolution_m > 0.0);
  SENTREE_ASSERT(cells_.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

Cell GridMap::cell_at(Vec2 point) const {
  const Vec2 grid = to_grid(point);
  // Any cell outside will do for what is far outside, but the conversion to int must be defined.
  const auto coordinate = [](double g) { return static_cast<int>(std::floor(std::clamp(g, -1e6, 1e9))); };
  return {coordinate(grid.x), coordinate(grid.y)};
}

GridMap cropped_to_known(const GridMap& map) {
  Cell low{map.width(), map.height()};
  Cell high{-1, -1};
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (map.at({x, y}) == GridMap::kUnknown) continue;
      low = {std::min(low.x, x), std::min(low.y, y)};
      high = {std::max(high.x, x), std::max(high.y, y)};
    }
  }
  if (high.x < 0 || (low == Cell{0, 0} && high == Cell{map.width() - 1, map.height() - 1})) return map;
  const int width = high.x - low.x + 1;
  const int height = high.y - low.y + 1;
  std::vector<std::int8_t> cells;
  cells.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = low.y; y <= high.y; ++y) {
    const auto row = map.cells().begin() + static_cast<std::ptrdiff_t>(map.index({low.x, y}));
    cells.insert(cells.end(), row, row + width);
  }
  const Vec2 corner = map.from_grid({static_cast<double>(low.x), static_cast<double>(low.y)});
  return {width, height, map.resolution_m(), {corner.x, corner.y, map.origin().theta}, std::move(cells)};
}

}  // namespace sentree::sim
