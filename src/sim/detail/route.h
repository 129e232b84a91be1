#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sentree/sim/cost_grid.h"
#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/navigator.h"

namespace sentree::sim {

/// What a route is planned on; borrowed for the call.
struct RouteModel {
  const GridMap& map;
  const DistanceField& distance;
  const CostGrid& costs;
  std::uint64_t expansions_max;
  double radius_m;
};

struct Route {
  NavigationError error = NavigationError::kNone;
  std::string message;
  bool blocked_by_seen = false;  ///< Without what the laser saw there would be a route.
  std::vector<Vec2> points;      ///< Corners from start to target.
};

/// Plans from `start` to `target` around the map's walls, what was announced and what was seen (CostGrid slots).
///
/// A start inside the inflation of a wall is left by the shortest way that gets no nearer to anything.
/// Cost: one or two searches; a copy of the costs where there is something beyond the map.
[[nodiscard]] Route find_route(const RouteModel& model, Vec2 start, Vec2 target, std::span<const Cell> announced,
                               std::span<const std::uint32_t> seen);

}  // namespace sentree::sim
