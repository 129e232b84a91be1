#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "sentree/sim/area.h"
#include "sentree/sim/detail/announced.h"
#include "sentree/sim/detail/obstacle_layer.h"
#include "sentree/sim/detail/path.h"
#include "sentree/sim/detail/route.h"
#include "sentree/sim/detail/service_handlers.h"

namespace sentree::sim {

namespace {

constexpr std::string_view kOk = "OK";

Pose2 believed_pose(const Context& c) { return estimated_pose(c.robot().localization, c.robot().odometry); }

Value accepted(const Context& c, std::string name, std::vector<Pose2> waypoints) {
  const std::int64_t id =
      start_goal(c.spec().navigation, c.robot().navigator, std::move(name), std::move(waypoints), c.state.time);
  return Map{{"code", kOk}, {"goal_id", id}, {"error_code", to_value(NavigationError::kNone)}};
}

Value rejected(std::string_view code, NavigationError error = NavigationError::kGoalRejected) {
  return Map{{"code", code}, {"goal_id", std::int64_t{0}}, {"error_code", to_value(error)}};
}

const NamedLocation* find_location(const Context& c, std::string_view name) {
  for (const NamedLocation& location : c.state.locations) {
    if (location.name == name) return &location;
  }
  return nullptr;
}

const NamedArea* find_area(const Context& c, std::string_view name) {
  for (const NamedArea& area : c.state.areas) {
    if (area.name == name) return &area;
  }
  return nullptr;
}

Value goto_location(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  if (const NamedLocation* location = find_location(c, name)) return accepted(c, name, {location->pose});
  const NamedArea* area = find_area(c, name);
  if (area == nullptr) return rejected("UNKNOWN_NAME");
  // The heading is nobody's wish; the one from here keeps the robot from turning at the end.
  const Vec2 centre = standing_place(c.world.map, c.spec().costs, area->points);
  const Vec2 way = centre - believed_pose(c).position();
  return accepted(c, name, {{centre.x, centre.y, std::atan2(way.y, way.x)}});
}

Value goto_absolute(const Context& c) {
  std::string map_id = c.world.map_id;
  std::string description;
  const Pose2 pose = c.args.location("target", map_id, description);
  if (!c.args.problem().empty()) return {};
  if (!map_id.empty() && map_id != c.world.map_id) return rejected("UNKNOWN_NAME");
  return accepted(c, {}, {pose});
}

Value goto_relative(const Context& c) {
  const Pose2 delta = c.args.pose("delta");
  if (!c.args.problem().empty()) return {};
  return accepted(c, {}, {compose(believed_pose(c), delta)});
}

Value follow_path(const Context& c) {
  std::vector<Pose2> poses = c.args.path("path");
  if (!c.args.problem().empty()) return {};
  if (poses.empty()) return rejected("ERROR");
  // Another path to where the robot is going already brings it no further: it has no more patience for that.
  const Navigator& n = c.robot().navigator;
  const bool goes_there = is_active(n.status) && n.goal.kind == GoalKind::kGo && !n.goal.waypoints.empty() &&
                          n.goal.waypoints.back() == poses.back();
  const TimePoint progress_at = goes_there ? n.progress_at : c.state.time;
  Value reply = accepted(c, {}, std::move(poses));
  c.robot().navigator.progress_at = progress_at;
  return reply;
}

Value motion(const Context& c, GoalKind kind, double amount) {
  const std::int64_t id =
      start_motion(c.spec().navigation, c.robot().navigator, kind, amount, believed_pose(c), c.state.time);
  return Map{{"code", kOk}, {"goal_id", id}, {"error_code", to_value(NavigationError::kNone)}};
}

Value spin(const Context& c) {
  const double angle = c.args.number("angle");
  if (!c.args.problem().empty()) return {};
  constexpr double kMax_rad = 100.0;
  if (std::abs(angle) > kMax_rad) return rejected("OUT_OF_BOUNDS");
  return motion(c, GoalKind::kSpin, angle);
}

Value drive(const Context& c, double distance_m, double speed_m_s) {
  if (!c.args.problem().empty()) return {};
  constexpr double kMax_m = 1000.0;
  if (std::abs(distance_m) > kMax_m || speed_m_s < 0.0) return rejected("OUT_OF_BOUNDS");
  Value reply = motion(c, GoalKind::kDrive, distance_m);
  c.robot().navigator.goal.speed_m_s = speed_m_s;
  return reply;
}

Value drive_straight(const Context& c) { return drive(c, c.args.number("distance"), 0.0); }

Value drive_straight_at(const Context& c) {
  const double distance_m = c.args.number("distance");
  return drive(c, distance_m, c.args.number("speed"));
}

Value dock(const Context& c) {
  const std::string name = c.args.text("station");
  if (!c.args.problem().empty()) return {};
  for (const Station& station : c.world.stations) {
    if (station.name != name) continue;
    const std::int64_t id =
        start_goal(c.spec().navigation, c.robot().navigator, name, {station.pose}, c.state.time, GoalKind::kDock);
    return Map{{"code", kOk}, {"goal_id", id}, {"error_code", to_value(NavigationError::kNone)}};
  }
  return rejected("UNKNOWN_NAME", NavigationError::kDockNotInDb);
}

Value undock(const Context& c) {
  const Pose2 pose = believed_pose(c);
  for (const Station& station : c.world.stations) {
    const double off_m = distance(pose.position(), station.pose.position());
    if (off_m > station.linear_tolerance_m) continue;
    constexpr double kBeyond_m = 0.1;
    return motion(c, GoalKind::kUndock, -(station.linear_tolerance_m + kBeyond_m));
  }
  return rejected("NOT_READY");
}

Value navigation_state(const Context& c) {
  const Navigator& n = c.robot().navigator;
  const TimePoint until = is_active(n.status) ? c.state.time : n.ended;
  const double remaining =
      is_active(n.status) || n.status == NavigationStatus::kGoalReached ? n.distance_remaining_m : 0.0;
  Value answer = std::move(c.former);
  Record record(answer, 10);
  record.set("status", to_value(n.status));
  record.set("error_code", to_value(n.error));
  record.set("error_msg", std::string_view(n.error_message));
  record.set("goal_id", Value(n.goal.id));
  record.set("target_name", std::string_view(n.goal.name));
  put_location(record.entry("target"), c.world, n.goal.waypoints.empty() ? Pose2{} : n.goal.waypoints.back());
  record.set("navigation_time", seconds(until - n.started));
  record.set("estimated_time_remaining", is_active(n.status) ? remaining / c.spec().limits.speed_m_s : 0.0);
  record.set("distance_remaining", remaining);
  record.set("number_of_recoveries", Value(n.recoveries));
  return answer;
}

Value navigation_status(const Context& c) { return to_value(c.robot().navigator.status); }

Value target_name(const Context& c) {
  const Navigator& n = c.robot().navigator;
  return is_active(n.status) ? n.goal.name : std::string();
}

Value target_location(const Context& c) {
  const Navigator& n = c.robot().navigator;
  const bool known = is_active(n.status) && !n.goal.waypoints.empty();
  return Map{{"code", known ? kOk : "NOT_READY"},
             {"location", location(c.world, known ? n.goal.waypoints.back() : Pose2{}, n.goal.name)}};
}

Value relative_target(const Context& c) {
  const Navigator& n = c.robot().navigator;
  const bool known = is_active(n.status) && !n.goal.waypoints.empty();
  return Map{{"code", known ? kOk : "NOT_READY"},
             {"pose", to_value(known ? relative(believed_pose(c), n.goal.waypoints.back()) : Pose2{})}};
}

Value stop(const Context& c) {
  const std::int64_t id = c.args.integer("goal_id");
  if (!c.args.problem().empty()) return {};
  stop_goal(c.robot().navigator, id, c.state.time);
  return return_code(kOk);
}

Value suspend_navigation(const Context& c) {
  const double s = c.args.number("time_s");
  if (!c.args.problem().empty()) return {};
  const TimePoint until = s < 0.0 ? kNever : add_saturating(c.state.time, from_seconds(s));
  return return_code(suspend(c.robot().navigator, c.state.time, until) ? kOk : "NOT_READY");
}

Value resume_navigation(const Context& c) {
  return return_code(resume(c.robot().navigator, c.state.time) ? kOk : "NOT_READY");
}

Value recompute(const Context& c) { return return_code(replan(c.robot().navigator, c.state.time) ? kOk : "NOT_READY"); }

// Along the path the robot looks ahead; at the end it looks where it was told to.
std::vector<Pose2> with_headings(const std::vector<Vec2>& points, double last_theta) {
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool last = i + 1 == points.size();
    const Vec2 way = last ? Vec2{} : points[i + 1] - points[i];
    poses.push_back({points[i].x, points[i].y, last ? last_theta : std::atan2(way.y, way.x)});
  }
  return poses;
}

Value path_value(const Context& c, const std::vector<Pose2>& poses) {
  List list;
  for (const Pose2& pose : poses) list.push_back(to_value(pose));
  return Map{{"header", header(c.state)}, {"poses", std::move(list)}};
}

std::vector<Pose2> current_path(const Navigator& n) {
  return n.path.empty() ? std::vector<Pose2>{} : with_headings(n.path, n.goal.waypoints[n.waypoint].theta);
}

Value all_waypoints(const Context& c) { return path_value(c, current_path(c.robot().navigator)); }

Value current_waypoint(const Context& c) {
  const Navigator& n = c.robot().navigator;
  const std::vector<Pose2> poses = current_path(n);
  const bool known = !poses.empty();
  const std::size_t next = std::min(n.passed + 1, poses.size() - 1);
  return Map{{"code", known ? kOk : "NOT_READY"}, {"location", location(c.world, known ? poses[next] : Pose2{})}};
}

// The costs that the planner sees with what is known beyond the map.
CostGrid costs_now(const Context& c) {
  CostGrid costs = c.spec().costs;
  costs.add_obstacles(announced_cells(c.world, c.state));
  std::vector<Cell> seen;
  for (const std::uint32_t slot : c.robot().navigator.seen) seen.push_back(costs.cell(slot));
  costs.add_obstacles(seen);
  return costs;
}

Value is_path_valid(const Context& c) {
  const std::vector<Pose2> poses = c.args.path("path");
  if (!c.args.problem().empty()) return {};
  const CostGrid costs = costs_now(c);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (segment_cost(costs, c.world.map, poses[i - 1].position(), poses[i].position()) < 0.0) return false;
  }
  return !poses.empty();
}

Value compute_path_from(const Context& c, const Pose2& start) {
  std::string map_id;
  std::string description;
  const Pose2 target = c.args.location("target", map_id, description);
  if (!c.args.problem().empty()) return {};
  const auto reply = [&](std::string_view code, NavigationError error, const std::string& message,
                         const std::vector<Vec2>& points) {
    double length_m = 0.0;
    for (std::size_t i = 1; i < points.size(); ++i) length_m += distance(points[i - 1], points[i]);
    return Map{{"code", code},
               {"error_code", to_value(error)},
               {"error_msg", message},
               {"path", path_value(c, with_headings(points, target.theta))},
               {"length", length_m}};
  };
  if (!map_id.empty() && map_id != c.world.map_id)
    return reply("UNKNOWN_NAME", NavigationError::kGoalRejected, fmt::format("there is no map \"{}\"", map_id), {});
  const RobotSpec& spec = c.spec();
  const std::vector<Cell> announced = announced_cells(c.world, c.state);
  const Route route =
      find_route({c.world.map, c.world.distance, spec.costs, spec.navigation.plan_expansions_max, spec.radius_m},
                 start.position(), target.position(), announced, c.robot().navigator.seen);
  const bool found = route.error == NavigationError::kNone;
  return reply(found ? kOk : "ERROR", route.error, route.message, route.points);
}

Value compute_path(const Context& c) { return compute_path_from(c, believed_pose(c)); }
Value compute_path_between(const Context& c) { return compute_path_from(c, c.args.pose("start")); }

// Costs: 0 far from everything, to 99, and 100 where the robot cannot be.
Value navigation_map(const Context& c) {
  constexpr std::array<std::string_view, 2> kTypes{"GLOBAL", "LOCAL"};
  const bool local = c.args.choice("type", kTypes) == 1;
  if (!c.args.problem().empty()) return {};
  const GridMap& map = c.world.map;
  const CostGrid costs = costs_now(c);
  Cell low{0, 0};
  Cell high{map.width(), map.height()};
  if (local) {
    // As far as the laser marks obstacles.
    const int reach = static_cast<int>(kObstacleRangeMax_m / map.resolution_m());
    const Cell here = map.cell_at(believed_pose(c).position());
    low = {std::clamp(here.x - reach, 0, map.width()), std::clamp(here.y - reach, 0, map.height())};
    high = {std::clamp(here.x + reach + 1, low.x, map.width()), std::clamp(here.y + reach + 1, low.y, map.height())};
  }
  std::vector<std::int8_t> cells;
  for (int y = low.y; y < high.y; ++y) {
    for (int x = low.x; x < high.x; ++x) {
      const int weight = costs.at({x, y});
      const bool unknown = map.at({x, y}) == GridMap::kUnknown;
      const int share = 99 * (weight - CostGrid::kFree) / (CostGrid::kNear - CostGrid::kFree);
      cells.push_back(static_cast<std::int8_t>(unknown ? -1 : weight == CostGrid::kBlocked ? 100 : share));
    }
  }
  const Vec2 corner = map.from_grid({static_cast<double>(low.x), static_cast<double>(low.y)});
  return occupancy_grid(c.state, kOk, c.world.map_id,
                        GridMap(high.x - low.x, high.y - low.y, map.resolution_m(),
                                {corner.x, corner.y, map.origin().theta}, std::move(cells)));
}

Value clear_navigation_map(const Context& c) {
  c.robot().navigator.seen.clear();
  replan(c.robot().navigator, c.state.time);
  return return_code(kOk);
}

Value check_inside_area(const Context& c) {
  const std::string name = c.args.text("area_name");
  if (!c.args.problem().empty()) return {};
  const NamedArea* area = find_area(c, name);
  return area != nullptr && is_inside(area->points, believed_pose(c).position());
}

bool is_near(const Pose2& pose, const Pose2& place, double linear, double angular) {
  return distance(pose.position(), place.position()) <= linear &&
         std::abs(wrap_angle(pose.theta - place.theta)) <= angular;
}

Value check_near(const Context& c) {
  const std::string name = c.args.text("name");
  const double linear = c.args.number("linear_tolerance");
  const double angular = c.args.number("angular_tolerance");
  if (!c.args.problem().empty()) return {};
  const NamedLocation* location = find_location(c, name);
  return location != nullptr && is_near(believed_pose(c), location->pose, linear, angular);
}

Value check_near_given(const Context& c) {
  std::string map_id;
  std::string description;
  const Pose2 place = c.args.location("location", map_id, description);
  const double linear = c.args.number("linear_tolerance");
  const double angular = c.args.number("angular_tolerance");
  if (!c.args.problem().empty()) return {};
  return (map_id.empty() || map_id == c.world.map_id) && is_near(believed_pose(c), place, linear, angular);
}

Value check_inside_given(const Context& c) {
  std::string map_id;
  std::string description;
  const std::vector<Vec2> corners = c.args.area("area", map_id, description);
  if (!c.args.problem().empty()) return {};
  return (map_id.empty() || map_id == c.world.map_id) && is_inside(corners, believed_pose(c).position());
}

Value find_current_area(const Context& c) {
  for (const NamedArea& area : c.state.areas) {
    if (is_inside(area.points, believed_pose(c).position())) return area.name;
  }
  return "";
}

}  // namespace

std::span<const Method> navigation_methods() {
  static constexpr std::array kMethods{
      Method{"gotoTargetByLocationName", goto_location},
      Method{"gotoTargetByAbsoluteLocation", goto_absolute},
      Method{"gotoTargetByRelativeLocation", goto_relative},
      Method{"followPath", follow_path},
      Method{"spin", spin},
      Method{"driveStraight", drive_straight},
      Method{"driveStraightAt", drive_straight_at},
      Method{"dockRobot", dock},
      Method{"undockRobot", undock},
      Method{"getNavigationState", navigation_state},
      Method{"getNavigationStatus", navigation_status},
      Method{"getNameOfCurrentTarget", target_name},
      Method{"getAbsoluteLocationOfCurrentTarget", target_location},
      Method{"getRelativeLocationOfCurrentTarget", relative_target},
      Method{"getCurrentNavigationWaypoint", current_waypoint},
      Method{"stopNavigation", stop},
      Method{"suspendNavigation", suspend_navigation},
      Method{"resumeNavigation", resume_navigation},
      Method{"recomputeCurrentNavigationPath", recompute},
      Method{"getAllNavigationWaypoints", all_waypoints},
      Method{"computePathTo", compute_path},
      Method{"computePathBetween", compute_path_between},
      Method{"isPathValid", is_path_valid},
      Method{"getCurrentNavigationMap", navigation_map},
      Method{"clearCurrentNavigationMap", clear_navigation_map},
      Method{"checkInsideArea", check_inside_area},
      Method{"checkNearToLocation", check_near},
      Method{"checkInsideGivenArea", check_inside_given},
      Method{"checkNearToGivenLocation", check_near_given},
      Method{"findCurrentArea", find_current_area},
  };
  return kMethods;
}

}  // namespace sentree::sim
