#include "sentree/sim/world.h"

#include <algorithm>

namespace sentree::sim {

std::optional<std::size_t> World::robot(std::string_view name) const {
  if (name.empty() && !robots.empty()) return 0;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (robots[i].name == name) return i;
  }
  return std::nullopt;
}

void derive(const World& world, RobotSpec& robot) {
  robot.costs = CostGrid(world.map, world.distance, robot.navigation.inflation(robot.radius_m));
  robot.likelihood = LikelihoodField(world.map, world.distance, robot.localization.reading);
}

std::optional<Tolerances> station_tolerances(const World& world) {
  std::optional<Tolerances> least;
  for (const Station& station : world.stations) {
    if (!least) least = {station.linear_tolerance_m, station.angular_tolerance_rad};
    least->linear_m = std::min(least->linear_m, station.linear_tolerance_m);
    least->angular_rad = std::min(least->angular_rad, station.angular_tolerance_rad);
  }
  return least;
}

Tolerances navigation_tolerances(const World& world) {
  Tolerances greatest;
  for (const RobotSpec& robot : world.robots) {
    greatest.linear_m = std::max(greatest.linear_m, robot.navigation.goal_linear_tolerance_m);
    greatest.angular_rad = std::max(greatest.angular_rad, robot.navigation.goal_angular_tolerance_rad);
  }
  return greatest;
}

}  // namespace sentree::sim
