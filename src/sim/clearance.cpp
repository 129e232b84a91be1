#include "sentree/sim/detail/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sentree::sim {

bool is_roomy(const GridMap& map, const DistanceField& distance, Vec2 point, double radius_m) {
  const Cell c = map.cell_at(point);
  if (!map.contains(c)) return false;
  // The centres are at most half a diagonal each from the point and from the edge of the square.
  return std::sqrt(static_cast<double>(distance.squared_cells(c))) - std::numbers::sqrt2 >=
         radius_m / map.resolution_m();
}

double clearance(const GridMap& map, const DistanceField& distance, Vec2 point, double enough_m) {
  if (is_roomy(map, distance, point, enough_m)) return enough_m;
  const Cell c = map.cell_at(point);
  const double enough = enough_m / map.resolution_m();
  const Vec2 at = map.to_grid(point);
  const int reach = static_cast<int>(std::ceil(enough));
  const int x_end = std::min(map.width(), c.x + reach + 1);
  const int y_end = std::min(map.height(), c.y + reach + 1);
  double nearest = std::numeric_limits<double>::infinity();
  for (int y = std::max(0, c.y - reach); y < y_end; ++y) {
    for (int x = std::max(0, c.x - reach); x < x_end; ++x) {
      if (map.at({x, y}) < GridMap::kOccupiedMin) continue;
      const double dx = std::max({0.0, x - at.x, at.x - (x + 1)});
      const double dy = std::max({0.0, y - at.y, at.y - (y + 1)});
      nearest = std::min(nearest, dx * dx + dy * dy);
    }
  }
  return std::min(enough_m, std::sqrt(nearest) * map.resolution_m());
}

}  // namespace sentree::sim
