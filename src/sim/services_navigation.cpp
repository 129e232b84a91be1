#include <array>
#include <cmath>
#include <utility>

#include "sentree/sim/area.h"
#include "sentree/sim/service_handlers.h"

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
  return accepted(c, {}, std::move(poses));
}

Value navigation_state(const Context& c) {
  const Navigator& n = c.robot().navigator;
  const TimePoint until = is_active(n.status) ? c.state.time : n.ended;
  const double remaining =
      is_active(n.status) || n.status == NavigationStatus::kGoalReached ? n.distance_remaining_m : 0.0;
  return Map{{"status", to_value(n.status)},
             {"error_code", to_value(n.error)},
             {"error_msg", n.error_message},
             {"goal_id", n.goal.id},
             {"target_name", n.goal.name},
             {"target", location(c.world, n.goal.waypoints.empty() ? Pose2{} : n.goal.waypoints.back())},
             {"navigation_time", seconds(until - n.started)},
             {"estimated_time_remaining", is_active(n.status) ? remaining / c.spec().limits.speed_m_s : 0.0},
             {"distance_remaining", remaining},
             {"number_of_recoveries", n.recoveries}};
}

Value navigation_status(const Context& c) { return to_value(c.robot().navigator.status); }

Value target_name(const Context& c) {
  const Navigator& n = c.robot().navigator;
  return is_active(n.status) ? n.goal.name : std::string();
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

Value all_waypoints(const Context& c) {
  const Navigator& n = c.robot().navigator;
  List poses;
  for (std::size_t i = 0; i < n.path.size(); ++i) {
    // Along the path the robot looks ahead; at the end it looks where it was told to.
    const bool last = i + 1 == n.path.size();
    const Vec2 way = last ? Vec2{} : n.path[i + 1] - n.path[i];
    const double theta = last ? n.goal.waypoints[n.waypoint].theta : std::atan2(way.y, way.x);
    poses.push_back(to_value(Pose2{n.path[i].x, n.path[i].y, theta}));
  }
  return Map{{"header", header(c.state)}, {"poses", std::move(poses)}};
}

Value check_inside_area(const Context& c) {
  const std::string name = c.args.text("area_name");
  if (!c.args.problem().empty()) return {};
  const NamedArea* area = find_area(c, name);
  return area != nullptr && is_inside(area->points, believed_pose(c).position());
}

Value check_near(const Context& c) {
  const std::string name = c.args.text("name");
  const double linear = c.args.number("linear_tolerance");
  const double angular = c.args.number("angular_tolerance");
  if (!c.args.problem().empty()) return {};
  const NamedLocation* location = find_location(c, name);
  if (location == nullptr) return false;
  const Pose2 pose = believed_pose(c);
  return distance(pose.position(), location->pose.position()) <= linear &&
         std::abs(wrap_angle(pose.theta - location->pose.theta)) <= angular;
}

}  // namespace

std::span<const Method> navigation_methods() {
  static constexpr std::array kMethods{
      Method{"gotoTargetByLocationName", goto_location},     Method{"gotoTargetByAbsoluteLocation", goto_absolute},
      Method{"gotoTargetByRelativeLocation", goto_relative}, Method{"followPath", follow_path},
      Method{"getNavigationState", navigation_state},        Method{"getNavigationStatus", navigation_status},
      Method{"getNameOfCurrentTarget", target_name},         Method{"stopNavigation", stop},
      Method{"suspendNavigation", suspend_navigation},       Method{"resumeNavigation", resume_navigation},
      Method{"recomputeCurrentNavigationPath", recompute},   Method{"getAllNavigationWaypoints", all_waypoints},
      Method{"checkInsideArea", check_inside_area},          Method{"checkNearToLocation", check_near},
  };
  return kMethods;
}

}  // namespace sentree::sim
