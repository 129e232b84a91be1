#include "sentree/sim/area.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace sentree::sim {

bool is_inside(std::span<const Vec2> corners, Vec2 point) {
  bool inside = false;
  for (std::size_t i = 0, before = corners.size() - 1; i < corners.size(); before = i++) {
    const Vec2 a = corners[i];
    const Vec2 b = corners[before];
    if ((a.y > point.y) == (b.y > point.y)) continue;
    if (point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)) inside = !inside;
  }
  return inside;
}

Vec2 centroid(std::span<const Vec2> corners) {
  double twice_area = 0.0;
  Vec2 moment;
  Vec2 mean;
  if (corners.empty()) return mean;
  // About the first corner, so that an area far from the origin keeps its precision.
  const Vec2 base = corners.front();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 a = corners[i] - base;
    const Vec2 b = corners[(i + 1) % corners.size()] - base;
    const double cross = a.x * b.y - a.y * b.x;
    twice_area += cross;
    moment = moment + cross * (a + b);
    mean = mean + (1.0 / static_cast<double>(corners.size())) * a;
  }
  if (std::abs(twice_area) < 1e-12) return base + mean;
  return base + (1.0 / (3.0 * twice_area)) * moment;
}

Vec2 standing_place(const GridMap& map, const CostGrid& costs, std::span<const Vec2> corners) {
  const Vec2 centre = centroid(corners);
  if (is_inside(corners, centre) && costs.at(map.cell_at(centre)) != CostGrid::kBlocked) return centre;
  Vec2 low{1e18, 1e18};
  Vec2 high{-1e18, -1e18};
  for (const Vec2 corner : corners) {
    const Vec2 g = map.to_grid(corner);
    low = {std::min(low.x, g.x), std::min(low.y, g.y)};
    high = {std::max(high.x, g.x), std::max(high.y, g.y)};
  }
  const auto clamped = [](double v, int side) { return static_cast<int>(std::clamp(std::floor(v), 0.0, side - 1.0)); };
  Vec2 best = centre;
  double nearest = std::numeric_limits<double>::infinity();
  for (int y = clamped(low.y, map.height()); y <= clamped(high.y, map.height()); ++y) {
    for (int x = clamped(low.x, map.width()); x <= clamped(high.x, map.width()); ++x) {
      if (costs.at({x, y}) == CostGrid::kBlocked) continue;
      const Vec2 point = map.centre({x, y});
      const double d = distance(point, centre);
      if (d >= nearest || !is_inside(corners, point)) continue;
      nearest = d;
      best = point;
    }
  }
  return best;
}

}  // namespace sentree::sim
