#include "sentree/sim/detail/announced.h"

#include <algorithm>
#include <cmath>

namespace sentree::sim {

std::vector<Cell> announced_cells(const World& world, const State& state) {
  std::vector<Cell> cells;
  const auto add = [&](const Shape& shape) {
    const double radius = bounding_radius(shape) + world.map.resolution_m();
    const Vec2 centre = shape.pose.position();
    // The corners of the square around the shape bound its cells, whatever the heading of the grid.
    const double half = radius * std::sqrt(2.0);
    const Vec2 grid = world.map.to_grid(centre);
    const double half_cells = half / world.map.resolution_m();
    const int x_low = std::max(0, static_cast<int>(std::max(-1.0, std::floor(grid.x - half_cells))));
    const int y_low = std::max(0, static_cast<int>(std::max(-1.0, std::floor(grid.y - half_cells))));
    for (int y = y_low; y < world.map.height() && y <= grid.y + half_cells; ++y) {
      for (int x = x_low; x < world.map.width() && x <= grid.x + half_cells; ++x) {
        if (distance(shape, world.map.centre({x, y})) <= world.map.resolution_m() / 2) cells.push_back({x, y});
      }
    }
  };
  for (const Obstacle& obstacle : state.obstacles) {
    if (obstacle.on_map) add(obstacle.shape);
  }
  for (const Door& door : state.doors) {
    if (door.on_map && !door.open) add(Shape::wall(door.a, door.b, door.thickness_m));
  }
  return cells;
}

}  // namespace sentree::sim
