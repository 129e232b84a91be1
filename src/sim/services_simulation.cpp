// Test control: the only service that knows and moves the truth.

#include <algorithm>
#include <array>
#include <utility>

#include "sentree/sim/detail/service_handlers.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {

namespace {

Value set_charge(const Context& c) {
  const double percent = c.args.number("percent");
  if (!c.args.problem().empty()) return {};
  if (percent < 0.0 || percent > 100.0) return return_code("OUT_OF_BOUNDS");
  Battery& battery = c.robot().battery;
  battery.charge = percent / 100.0;
  battery.full = battery.full && battery.charge >= 1.0;
  return return_code("OK");
}

Value plug_in(const Context& c) {
  if (c.robot().station < 0) return return_code("NOT_READY");
  c.robot().battery.plugged = true;
  return return_code("OK");
}

Value unplug(const Context& c) {
  c.robot().battery.plugged = false;
  return return_code("OK");
}

Value set_pose(const Context& c) {
  const Pose2 pose = c.args.pose("pose");
  if (!c.args.problem().empty()) return {};
  RobotState& robot = c.robot();
  robot.truth.pose = pose;
  robot.truth.twist = {};
  robot.odometry_twist = {};
  // To a filter it is a kidnapping.
  if (c.spec().localization.method != LocalizationSpec::Method::kAmcl) {
    set_initial_pose(c.spec().localization, robot.localization, {.pose = pose}, robot.odometry);
    replan(robot.navigator, c.state.time);
  }
  return return_code("OK");
}

Value ground_truth(const Context& c) { return to_value(c.robot().truth.pose); }

Value collisions(const Context& c) { return c.robot().truth.collisions; }

auto find(State& state, std::string_view id) {
  return std::find_if(state.obstacles.begin(), state.obstacles.end(), [&](const Obstacle& o) { return o.id == id; });
}

void let_all_replan(State& state) {
  for (RobotState& robot : state.robots) replan(robot.navigator, state.time);
}

Value add(const Context& c, Obstacle obstacle) {
  const auto known = find(c.state, obstacle.id);
  const bool tell = obstacle.on_map || (known != c.state.obstacles.end() && known->on_map);
  if (known != c.state.obstacles.end())
    *known = std::move(obstacle);
  else if (c.state.obstacles.size() >= kObstaclesMax)
    return return_code("OUT_OF_BOUNDS");
  else
    c.state.obstacles.push_back(std::move(obstacle));
  if (tell) let_all_replan(c.state);
  return return_code("OK");
}

Value add_obstacle(const Context& c) {
  const std::string id = c.args.text("id");
  const Vec2 centre = c.args.point("centre");
  const double radius = c.args.number("radius");
  if (!c.args.problem().empty()) return {};
  if (radius <= 0.0) return return_code("OUT_OF_BOUNDS");
  return add(c, {id, Shape::disc(centre, radius)});
}

Value add_wall(const Context& c) {
  const std::string id = c.args.text("id");
  const Vec2 a = c.args.point("a");
  const Vec2 b = c.args.point("b");
  const double thickness = c.args.number("thickness");
  const bool on_map = c.args.boolean("on_map");
  if (!c.args.problem().empty()) return {};
  if (thickness <= 0.0) return return_code("OUT_OF_BOUNDS");
  return add(c, {id, Shape::wall(a, b, thickness), on_map});
}

Value move_obstacle(const Context& c) {
  const std::string id = c.args.text("id");
  const Vec2 centre = c.args.point("centre");
  if (!c.args.problem().empty()) return {};
  const auto known = find(c.state, id);
  if (known == c.state.obstacles.end()) return return_code("UNKNOWN_NAME");
  known->shape.pose.x = centre.x;
  known->shape.pose.y = centre.y;
  if (known->on_map) let_all_replan(c.state);
  return return_code("OK");
}

Value remove_obstacle(const Context& c) {
  const std::string id = c.args.text("id");
  if (!c.args.problem().empty()) return {};
  const auto known = find(c.state, id);
  if (known == c.state.obstacles.end()) return return_code("UNKNOWN_NAME");
  const bool tell = known->on_map;
  c.state.obstacles.erase(known);
  if (tell) let_all_replan(c.state);
  return return_code("OK");
}

Value set_door(const Context& c) {
  const std::string id = c.args.text("id");
  const bool open = c.args.boolean("open");
  if (!c.args.problem().empty()) return {};
  for (Door& door : c.state.doors) {
    if (door.id != id) continue;
    const bool changes = door.open != open;
    door.open = open;
    if (changes && door.on_map) let_all_replan(c.state);
    return return_code("OK");
  }
  return return_code("UNKNOWN_NAME");
}

Value set_time_factor(const Context& c) {
  const double factor = c.args.number("factor");
  if (!c.args.problem().empty()) return {};
  constexpr double kFactorMax = 1e6;
  if (factor < 0.0 || factor > kFactorMax) return return_code("OUT_OF_BOUNDS");
  follow(c.state, c.now);
  c.state.clock.factor = factor;
  return return_code("OK");
}

Value set_paused(const Context& c) {
  const bool paused = c.args.boolean("paused");
  if (!c.args.problem().empty()) return {};
  follow(c.state, c.now);
  c.state.clock.paused = paused;
  return return_code("OK");
}

Value step(const Context& c) {
  const double s = c.args.number("seconds");
  if (!c.args.problem().empty()) return {};
  // A call answers in reasonable time: no more than an hour of simulation.
  advance_by(c.world, c.state, from_seconds(std::clamp(s, 0.0, 3600.0)));
  follow(c.state, c.now);
  return seconds(c.state.time);
}

Value reset(const Context& c) {
  const std::int64_t seed = c.args.integer("seed");
  if (!c.args.problem().empty()) return {};
  State fresh = initial_state(c.world, static_cast<std::uint64_t>(seed));
  fresh.clock.factor = c.state.clock.factor;
  fresh.clock.paused = c.state.clock.paused;
  c.state = std::move(fresh);
  follow(c.state, c.now);
  return return_code("OK");
}

}  // namespace

std::span<const Method> simulation_methods() {
  static constexpr std::array kMethods{
      Method{"setBatteryCharge", set_charge},
      Method{"plugIn", plug_in},
      Method{"unplug", unplug},
      Method{"setRobotPose", set_pose},
      Method{"getGroundTruth", ground_truth},
      Method{"getCollisions", collisions},
      Method{"addObstacle", add_obstacle},
      Method{"addWall", add_wall},
      Method{"moveObstacle", move_obstacle},
      Method{"removeObstacle", remove_obstacle},
      Method{"setDoor", set_door},
      Method{"setTimeFactor", set_time_factor},
      Method{"setPaused", set_paused},
      Method{"step", step},
      Method{"reset", reset},
  };
  return kMethods;
}

}  // namespace sentree::sim
