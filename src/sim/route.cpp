#include "sentree/sim/detail/route.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/present.h"
#include "sentree/base/value.h"
#include "sentree/sim/astar.h"
#include "sentree/sim/detail/path.h"
#include "sentree/sim/plan_memo.h"

namespace sentree::sim {

namespace {

constexpr double kEscape_m = 1.5;  // how far an inflated start may be from open space

std::string place(Vec2 p) { return fmt::format("({}, {})", shortest_decimal(p.x), shortest_decimal(p.y)); }

// Cells from `start` to the nearest open one, none of them nearer to an obstacle than the start is.
std::vector<Cell> escape(const RouteModel& model, const CostGrid& grid, Cell start, std::span<const Cell> obstacles) {
  const int reach = static_cast<int>(std::ceil(kEscape_m / model.map.resolution_m()));
  std::vector<Cell> near;
  for (const Cell c : obstacles) {
    if (std::max(std::abs(c.x - start.x), std::abs(c.y - start.y)) <= 2 * reach) near.push_back(c);
  }
  const auto room = [&](Cell c) {
    int square = model.distance.squared_cells(c);
    for (const Cell o : near) square = std::min(square, (c.x - o.x) * (c.x - o.x) + (c.y - o.y) * (c.y - o.y));
    return square;
  };
  const int room_at_start = room(start);
  const int side = 2 * reach + 1;
  const auto local = [&](Cell c) {
    const int index = (c.y - start.y + reach) * side + c.x - start.x + reach;
    return static_cast<std::size_t>(index);
  };
  std::vector<int> parent(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), -1);
  std::vector<Cell> queue{start};
  parent[local(start)] = 0;
  constexpr std::array<Cell, 4> kSides{Cell{1, 0}, Cell{0, 1}, Cell{-1, 0}, Cell{0, -1}};
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const Cell c = queue[head];
    if (grid.at(c) != CostGrid::kBlocked) {
      std::vector<Cell> cells;
      for (std::size_t i = head; i != 0; i = static_cast<std::size_t>(parent[local(queue[i])]))
        cells.push_back(queue[i]);
      cells.push_back(start);
      std::reverse(cells.begin(), cells.end());
      return cells;
    }
    for (const Cell step : kSides) {
      const Cell next{c.x + step.x, c.y + step.y};
      if (std::abs(next.x - start.x) > reach || std::abs(next.y - start.y) > reach || !model.map.is_free(next))
        continue;
      if (parent[local(next)] >= 0 || room(next) < room_at_start) continue;
      parent[local(next)] = static_cast<int>(head);
      queue.push_back(next);
    }
  }
  return {};
}

Route search(const RouteModel& model, const CostGrid& grid, Vec2 start, Vec2 target, std::span<const Cell> obstacles) {
  Route route;
  Cell from = model.map.cell_at(start);
  const Cell to = model.map.cell_at(target);
  std::vector<Vec2> way_out;
  if (grid.at(from) == CostGrid::kBlocked) {
    const std::vector<Cell> cells = escape(model, grid, from, obstacles);
    if (cells.empty()) {
      route.error = NavigationError::kStartOccupied;
      route.message = fmt::format("the robot at {} is shut in by obstacles", place(start));
      return route;
    }
    way_out.push_back(start);
    for (std::size_t i = 1; i + 1 < cells.size(); ++i) way_out.push_back(model.map.centre(cells[i]));
    from = cells.back();
    start = model.map.centre(from);
  }
  // What lies in the way differs from run to run; the map does not.
  PlanMemo* const memo = &grid == &model.costs ? Present<PlanMemo>::present() : nullptr;
  const Plan plan = memo != nullptr ? memo->path(grid, from, to, model.expansions_max)
                                    : find_path(grid, from, to, model.expansions_max);
  switch (plan.outcome) {
    case Plan::Outcome::kFound: break;
    case Plan::Outcome::kNoPath:
      route.error = NavigationError::kNoValidPath;
      route.message = fmt::format("no path leads from {} to {}", place(start), place(target));
      return route;
    case Plan::Outcome::kLimit:
      route.error = NavigationError::kPlanTimeout;
      route.message = fmt::format("no path was found within {} cells", model.expansions_max);
      return route;
  }
  route.points = std::move(way_out);
  const std::vector<Vec2> straight = straightened(grid, model.map, plan.cells, start, target);
  route.points.insert(route.points.end(), straight.begin(), straight.end());
  return route;
}

}  // namespace

Route find_route(const RouteModel& model, Vec2 start, Vec2 target, std::span<const Cell> announced,
                 std::span<const std::uint32_t> seen) {
  Route refused;
  const Cell to = model.map.cell_at(target);
  if (!model.map.contains(model.map.cell_at(start))) {
    refused.error = NavigationError::kStartOutsideMap;
    refused.message = fmt::format("the robot at {} is not on the map", place(start));
    return refused;
  }
  if (!model.map.contains(to)) {
    refused.error = NavigationError::kGoalOutsideMap;
    refused.message = fmt::format("the goal {} is not on the map", place(target));
    return refused;
  }
  if (model.costs.at(to) == CostGrid::kBlocked) {
    refused.error = NavigationError::kGoalOccupied;
    refused.message = fmt::format("the goal {} is too close to a wall or not on known floor", place(target));
    return refused;
  }
  if (announced.empty() && seen.empty()) return search(model, model.costs, start, target, {});

  CostGrid grid = model.costs;
  std::vector<Cell> obstacles(announced.begin(), announced.end());
  grid.add_obstacles(obstacles);
  std::optional<CostGrid> without_seen;
  std::vector<Cell> only_announced = obstacles;
  if (!seen.empty()) {
    without_seen = grid;
    std::vector<Cell> cells;
    for (const std::uint32_t slot : seen) cells.push_back(grid.cell(slot));
    grid.add_obstacles(cells);
    obstacles.insert(obstacles.end(), cells.begin(), cells.end());
  }
  Route route = search(model, grid, start, target, obstacles);
  if (route.error == NavigationError::kNone || !without_seen) return route;
  Route otherwise = search(model, *without_seen, start, target, only_announced);
  // If the map alone forbids it, there is nothing to wait for.
  if (otherwise.error != NavigationError::kNone) return otherwise;
  route.blocked_by_seen = true;
  return route;
}

}  // namespace sentree::sim
