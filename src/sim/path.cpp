#include "sentree/sim/detail/path.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sentree/sim/astar.h"

namespace sentree::sim {

namespace {

Vec2 nearest_on_segment(Vec2 a, Vec2 b, Vec2 point) {
  const Vec2 along = b - a;
  const double square = dot(along, along);
  if (square == 0.0) return a;
  return a + std::clamp(dot(point - a, along) / square, 0.0, 1.0) * along;
}

}  // namespace

double segment_cost(const CostGrid& grid, const GridMap& map, Vec2 a, Vec2 b) {
  const Vec2 from = map.to_grid(a);
  const Vec2 to = map.to_grid(b);
  const Vec2 along = to - from;
  Cell c = map.cell_at(a);
  const Cell end = map.cell_at(b);
  const double length = norm(along);
  const int step_x = along.x > 0.0 ? 1 : -1;
  const int step_y = along.y > 0.0 ? 1 : -1;
  const auto exit = [](int cell, int step, double start, double d) {
    return d != 0.0 ? (cell + (step > 0 ? 1 : 0) - start) / d : kInfinity;
  };
  double cost = 0.0;
  double t = 0.0;
  // The number of cells is known, so rounding at the far end cannot make the walk miss it.
  for (int left = std::abs(end.x - c.x) + std::abs(end.y - c.y);; --left) {
    const std::uint8_t weight = grid.at(c);
    if (weight == CostGrid::kBlocked) return -1.0;
    const double next_x = c.x != end.x ? exit(c.x, step_x, from.x, along.x) : kInfinity;
    const double next_y = c.y != end.y ? exit(c.y, step_y, from.y, along.y) : kInfinity;
    const double next = left > 0 ? std::min(next_x, next_y) : 1.0;
    cost += std::max(0.0, next - t) * length * weight;
    if (left <= 0) return cost;
    t = std::max(t, next);
    if (next_x < next_y)
      c.x += step_x;
    else
      c.y += step_y;
  }
}

std::vector<Vec2> straightened(const CostGrid& grid, const GridMap& map, std::span<const Cell> cells, Vec2 start,
                               Vec2 target) {
  std::vector<Vec2> points{start};
  if (cells.size() < 2) {
    points.push_back(target);
    return points;
  }
  const auto point = [&](std::size_t i) {
    if (i == 0) return start;
    return i + 1 == cells.size() ? target : map.centre(cells[i]);
  };
  std::vector<double> cost(cells.size(), 0.0);  // along the cells, up to each
  for (std::size_t i = 1; i < cells.size(); ++i) {
    const bool diagonal = cells[i].x != cells[i - 1].x && cells[i].y != cells[i - 1].y;
    cost[i] = cost[i - 1] + (diagonal ? std::sqrt(2.0) : 1.0) * grid.at(cells[i]);
  }
  constexpr double kSlack = 1.0 + 1e-3;
  // Some cells further the line may be cheap again; beyond that, looking on does not pay.
  constexpr std::size_t kLook = 12;
  for (std::size_t anchor = 0; anchor + 1 < cells.size();) {
    std::size_t best = anchor + 1;
    for (std::size_t i = anchor + 2; i < cells.size() && i <= best + kLook; ++i) {
      const double straight = segment_cost(grid, map, point(anchor), point(i));
      if (straight >= 0.0 && straight <= (cost[i] - cost[anchor]) * kSlack + CostGrid::kNear) best = i;
    }
    points.push_back(point(best));
    anchor = best;
  }
  return points;
}

double distance_to_segment(Vec2 a, Vec2 b, Vec2 point) { return distance(nearest_on_segment(a, b, point), point); }

PathPlace place_on_path(std::span<const Vec2> path, std::size_t from, Vec2 point, double window_m) {
  PathPlace place;
  if (path.empty()) return place;
  place.nearest = path.back();
  if (path.size() == 1) return place;
  double best = kInfinity;
  double ahead = 0.0;
  for (std::size_t i = std::min(from, path.size() - 2); i + 1 < path.size() && ahead <= window_m; ++i) {
    const Vec2 near = nearest_on_segment(path[i], path[i + 1], point);
    const double d = distance(near, point);
    if (d < best) {
      best = d;
      place.segment = i;
      place.nearest = near;
    }
    ahead += distance(i == from ? near : path[i], path[i + 1]);
  }
  place.remaining_m = distance(place.nearest, path[place.segment + 1]);
  for (std::size_t i = place.segment + 1; i + 1 < path.size(); ++i) place.remaining_m += distance(path[i], path[i + 1]);
  return place;
}

Vec2 point_ahead(std::span<const Vec2> path, const PathPlace& place, double ahead_m) {
  Vec2 at = place.nearest;
  for (std::size_t i = place.segment + 1; i < path.size(); ++i) {
    const double length = distance(at, path[i]);
    if (length >= ahead_m) return length > 0.0 ? at + (ahead_m / length) * (path[i] - at) : at;
    ahead_m -= length;
    at = path[i];
  }
  return at;
}

}  // namespace sentree::sim
