#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/nav2/detail/nodes.h"

namespace sentree::nav2::detail {

Value held(const bt::Context& self, const char* port) {
  const bt::Datum* const datum = self.held(port);
  // A C++ object has no value to compare; its writes are counted.
  return datum == nullptr           ? Value()
         : datum->object != nullptr ? Value(static_cast<std::int64_t>(self.sequence(port)))
                                    : datum->value;
}

namespace {

using bt::Context;
using bt::Next;
using bt::Ports;
using bt::Status;

/// Whether the goals have changed since its last tick. Reactive nodes reset it between two ticks, so that its status
/// does not tell the first one.
/// @tparam kFirst  What it answers the first time.
template <Status kFirst>
struct UpdatedGoal {
  Value seen;
  bool first = true;

  static Ports ports() {
    return {bt::input_default("goal", "{goal}", "the goal that is watched"),
            bt::input_default("goals", "{goals}", "the goals that are watched")};
  }
  Status tick(Context& self) {
    Value now = List{held(self, "goal"), held(self, "goals")};
    const Status answer = first ? kFirst : now == seen ? Status::kFailure : Status::kSuccess;
    first = false;
    seen = std::move(now);
    return answer;
  }
  [[nodiscard]] Value save() const { return Map{{"seen", seen}, {"first", first}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    const Value* const was = saved.find("seen");
    const Value* const flag = saved.find("first");
    if (was == nullptr || flag == nullptr || flag->as_bool() == nullptr) return false;
    seen = *was;
    first = *flag->as_bool();
    return true;
  }
  friend bool operator==(const UpdatedGoal&, const UpdatedGoal&) = default;
};

/// SUCCESS each time so many seconds are over since its first tick, or since it last said so.
struct TimeExpired {
  std::optional<std::int64_t> since_ns;

  static Ports ports() { return {bt::input_default<double>("seconds", "1.0", "after which it is SUCCESS, once")}; }
  Status tick(Context& self) {
    const std::int64_t now = self.now().time_since_epoch().count();
    if (!since_ns) since_ns = now;
    if (1e-9 * static_cast<double>(now - *since_ns) < self.input_or<double>("seconds", 1.0)) return Status::kFailure;
    since_ns = now;
    return Status::kSuccess;
  }
  [[nodiscard]] Value save() const { return since_ns ? Value(*since_ns) : Value(); }
  [[nodiscard]] bool restore(const Value& saved) {
    if (!saved.is_null() && saved.as_int() == nullptr) return false;
    since_ns.reset();
    if (!saved.is_null()) since_ns = *saved.as_int();
    return true;
  }
  friend bool operator==(const TimeExpired&, const TimeExpired&) = default;
};

struct Point {
  double x = 0;
  double y = 0;
};

// Of a geometry_msgs/PoseStamped.
std::optional<Point> position(const Value& pose) {
  const Value* const place = pose.at({"pose", "position"});
  const Value* const x = place != nullptr ? place->find("x") : nullptr;
  const Value* const y = place != nullptr ? place->find("y") : nullptr;
  if (x == nullptr || y == nullptr || !x->is_number() || !y->is_number()) return std::nullopt;
  return Point{x->number(), y->number()};
}

// Of a nav_msgs/Path; nothing: it is none, or has no poses.
std::optional<double> length_of(const Value& path) {
  const Value* const poses = path.find("poses");
  const List* const list = poses != nullptr ? poses->as_list() : nullptr;
  if (list == nullptr || list->empty()) return std::nullopt;
  double length_m = 0;
  std::optional<Point> before;
  for (const Value& pose : *list) {
    const auto here = position(pose);
    if (!here) return std::nullopt;
    if (before) length_m += std::hypot(here->x - before->x, here->y - before->y);
    before = here;
  }
  return length_m;
}

const Value& last_pose(const Value& path) { return path.find("poses")->as_list()->back(); }

/// Its child when a new path to the same place is much longer than the old one, which was nearly at its end.
struct PathLongerOnApproach {
  Value old;

  static Ports ports() {
    return {bt::input("path", "the path that is followed"),
            bt::input_default<double>("prox_len", "3.0", "m that were left at most"),
            bt::input_default<double>("length_factor", "2.0", "how many times as long the new path is")};
  }
  Next on_tick(Context& self) {
    const Value path = held(self, "path");
    const auto was_m = length_of(old);
    const auto is_m = length_of(path);
    const bool longer =
        was_m && is_m && !(path == old) && last_pose(path).at({"pose"}) != nullptr &&
        last_pose(old).at({"pose"}) != nullptr && *last_pose(path).at({"pose"}) == *last_pose(old).at({"pose"}) &&
        *was_m < self.input_or<double>("prox_len", 3.0) && *is_m > *was_m * self.input_or<double>("length_factor", 2.0);
    if (longer) return Next::tick(0);
    old = path;
    return Next::done(Status::kSuccess);
  }
  Next on_child(Context& self, std::size_t /*child*/, Status status) {
    if (status == Status::kSuccess || status == Status::kFailure) {
      old = held(self, "path");
      self.reset_children();
    }
    return Next::done(status);
  }
  [[nodiscard]] Value save() const { return old; }
  [[nodiscard]] bool restore(const Value& saved) {
    old = saved;
    return true;
  }
  friend bool operator==(const PathLongerOnApproach&, const PathLongerOnApproach&) = default;
};

/// SUCCESS each time so many seconds are over since it was asked about a new path, or since it last said so.
struct PathExpiringTimer {
  Value path;
  std::optional<std::int64_t> since_ns;

  static Ports ports() {
    return {bt::input("path", "the path that grows old"),
            bt::input_default<double>("seconds", "1.0", "after which it is SUCCESS, once")};
  }
  Status tick(Context& self) {
    const std::int64_t now = self.now().time_since_epoch().count();
    Value is = held(self, "path");
    const bool is_new = !since_ns || !(is == path);
    path = std::move(is);
    if (!is_new && 1e-9 * static_cast<double>(now - *since_ns) < self.input_or<double>("seconds", 1.0))
      return Status::kFailure;
    since_ns = now;
    return is_new ? Status::kFailure : Status::kSuccess;
  }
  [[nodiscard]] Value save() const { return Map{{"path", path}, {"since", since_ns ? Value(*since_ns) : Value()}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    const Value* const was = saved.find("path");
    const Value* const since = saved.find("since");
    if (was == nullptr || since == nullptr || (!since->is_null() && since->as_int() == nullptr)) return false;
    path = *was;
    since_ns.reset();
    if (!since->is_null()) since_ns = *since->as_int();
    return true;
  }
  friend bool operator==(const PathExpiringTimer&, const PathExpiringTimer&) = default;
};

/// Hands its goals on: no topic is heard that would change them.
struct GoalUpdater {
  static Ports ports() {
    return {bt::input("input_goal"),
            bt::input("input_goals"),
            bt::output("output_goal"),
            bt::output("output_goals"),
            bt::input<std::string>("goal_updater_topic", "not heard: nobody updates a goal"),
            bt::input<std::string>("goals_updater_topic", "not heard")};
  }
  Next on_tick(Context& self) {
    for (const auto& [from, to] : {std::pair("input_goal", "output_goal"), {"input_goals", "output_goals"}}) {
      if (const Value goal = held(self, from); !goal.is_null()) (void)self.output(to, goal);
    }
    return Next::tick(0);
  }
  Next on_child(Context& /*self*/, std::size_t /*child*/, Status status) { return Next::done(status); }
  [[nodiscard]] Value save() const { return {}; }
  [[nodiscard]] bool restore(const Value& /*saved*/) { return true; }
  friend bool operator==(const GoalUpdater&, const GoalUpdater&) = default;
};

// The poses of a path, if they all are some.
const List* poses_of(const Value& path) { return length_of(path) ? path.find("poses")->as_list() : nullptr; }

/// Ends a path so far from its end, as the crow flies; two poses stay, and the last one looks to where the end was.
Status truncate_path(Context& self) {
  const Value whole = held(self, "input_path");
  const List* const poses = poses_of(whole);
  if (poses == nullptr) return Status::kFailure;
  const Point end = *position(poses->back());
  const double distance_m = self.input_or<double>("distance", 1.0);
  List kept = *poses;
  const auto left_m = [&] {
    const Point last = *position(kept.back());
    return std::hypot(end.x - last.x, end.y - last.y);
  };
  while (kept.size() > 2 && left_m() < distance_m) kept.pop_back();
  const Point last = *position(kept.back());
  if (kept.size() < poses->size() && left_m() > 0) {
    const double half = std::atan2(end.y - last.y, end.x - last.x) / 2;
    Map pose = *kept.back().find("pose")->as_map();
    pose["orientation"] = Map{{"x", 0.0}, {"y", 0.0}, {"z", std::sin(half)}, {"w", std::cos(half)}};
    Map stamped = *kept.back().as_map();
    stamped["pose"] = std::move(pose);
    kept.back() = std::move(stamped);
  }
  Map path = *whole.as_map();
  path["poses"] = std::move(kept);
  (void)self.output("output_path", Value(std::move(path)));
  return Status::kSuccess;
}

/// The poses of one path, then those of the other.
Status concatenate_paths(Context& self) {
  Value path;
  List poses;
  for (const char* const each : {"input_path1", "input_path2"}) {
    Value part = held(self, each);
    const List* const own = poses_of(part);
    if (own == nullptr) continue;
    poses.insert(poses.end(), own->begin(), own->end());
    if (path.is_null()) path = std::move(part);
  }
  if (path.is_null()) return Status::kFailure;
  Map whole = *path.as_map();
  whole["poses"] = std::move(poses);
  (void)self.output("output_path", Value(std::move(whole)));
  return Status::kSuccess;
}

/// One more goal behind the others, which are a list, or a message that has one.
Status append_goal(Context& self) {
  const Value goal = held(self, "goal_pose");
  if (!position(goal)) return Status::kFailure;
  const auto appended = [&](const Value* before) {
    const List* const all = before != nullptr ? before->as_list() : nullptr;
    List out = all != nullptr ? *all : List();
    out.push_back(goal);
    return Value(std::move(out));
  };
  const Value before = held(self, "input_goals");
  if (before.as_map() == nullptr) {
    (void)self.output("output_goals", appended(&before));
    return Status::kSuccess;
  }
  const char* const name = before.find("poses") != nullptr ? "poses" : "goals";
  Map message = *before.as_map();
  message[name] = appended(before.find(name));
  (void)self.output("output_goals", Value(std::move(message)));
  return Status::kSuccess;
}

/// One pose of a path; a negative index counts from its end.
Status pose_from_path(Context& self) {
  const Value path = held(self, "path");
  const List* const poses = poses_of(path);
  if (poses == nullptr) return Status::kFailure;
  const auto size = static_cast<std::int64_t>(poses->size());
  const std::int64_t index = self.input_or<std::int32_t>("index", 0);
  const std::int64_t place = index < 0 ? size + index : index;
  if (place < 0 || place >= size) return Status::kFailure;
  (void)self.output("pose", (*poses)[static_cast<std::size_t>(place)]);
  return Status::kSuccess;
}

void add_selector(bt::Registry& registry, const char* id, const std::string& what) {
  const std::string given = "default_" + what;
  const std::string chosen = "selected_" + what;
  registry.action(id,
                  {bt::input<std::string>("topic_name", "not heard: nobody selects another one"),
                   bt::input<std::string>(given), bt::output<std::string>(chosen)},
                  [given, chosen](Context& self) {
                    const auto name = self.input<std::string>(given.c_str());
                    if (!name) return Status::kFailure;
                    (void)self.output<std::string>(chosen.c_str(), *name);
                    return Status::kSuccess;
                  });
}

/// @param codes  Those that a recovery may mend, by default.
void add_error_condition(bt::Registry& registry, const char* id, const char* codes) {
  using Codes = std::vector<std::int32_t>;
  auto checked = codes != nullptr ? bt::input_default<Codes>("error_codes_to_check", codes)
                                  : bt::input<Codes>("error_codes_to_check");
  registry.condition(id, {bt::input<std::int32_t>("error_code"), std::move(checked)}, [](Context& self) {
    const auto code = self.input_or<std::int32_t>("error_code", 0);
    for (const std::int32_t each : self.input_or<Codes>("error_codes_to_check", {})) {
      if (each == code) return Status::kSuccess;
    }
    return Status::kFailure;
  });
}

}  // namespace

void add_leaves(bt::Registry& registry) {
  using enum bt::Category;
  registry.add<UpdatedGoal<Status::kFailure>>("GoalUpdated", kCondition);
  registry.add<UpdatedGoal<Status::kSuccess>>("GlobalUpdatedGoal", kCondition);
  registry.add<TimeExpired>("TimeExpired", kCondition);
  registry.add<PathExpiringTimer>("PathExpiringTimer", kCondition);
  registry.add<PathLongerOnApproach>("PathLongerOnApproach", kDecorator);
  registry.add<GoalUpdater>("GoalUpdater", kDecorator);
  registry.action("TruncatePath",
                  {bt::input("input_path"), bt::output("output_path"),
                   bt::input_default<double>("distance", "1.0", "m from the end, as the crow flies")},
                  truncate_path);
  registry.action("ConcatenatePaths", {bt::input("input_path1"), bt::input("input_path2"), bt::output("output_path")},
                  concatenate_paths);
  registry.action("AppendGoalPoseToGoals",
                  {bt::input("goal_pose"), bt::input("input_goals"), bt::output("output_goals")}, append_goal);
  registry.action("GetPoseFromPath",
                  {bt::input("path"), bt::output("pose"),
                   bt::input_default<std::int32_t>("index", "0", "from 0 on; < 0: from the end")},
                  pose_from_path);
  registry.condition("InitialPoseReceived",
                     {bt::input_default<bool>("initial_pose_received", "{initial_pose_received}")}, [](Context& self) {
                       return self.input_or<bool>("initial_pose_received", false) ? Status::kSuccess : Status::kFailure;
                     });
  // The codes of nav2_msgs: unknown, patience, progress, control; unknown, timeout, no path, of one pose and of
  // several; unknown, timeout, collision, failed; unknown, timeout, no route.
  add_error_condition(registry, "WouldAControllerRecoveryHelp", "100;104;105;106");
  add_error_condition(registry, "WouldAPlannerRecoveryHelp", "200;207;208;300;307;308");
  add_error_condition(registry, "WouldASmootherRecoveryHelp", "500;502;503;504");
  add_error_condition(registry, "WouldARouteRecoveryHelp", "400;404;405");
  add_error_condition(registry, "AreErrorCodesPresent", nullptr);
  registry.condition("ArePosesNear",
                     {bt::input("ref_pose"), bt::input("target_pose"), bt::input<std::string>("global_frame"),
                      bt::input_default<double>("tolerance", "0.5", "m")},
                     [](Context& self) {
                       const auto a = position(held(self, "ref_pose"));
                       const auto b = position(held(self, "target_pose"));
                       return a && b && std::hypot(a->x - b->x, a->y - b->y) <= self.input_or<double>("tolerance", 0.5)
                                  ? Status::kSuccess
                                  : Status::kFailure;
                     });
  add_selector(registry, "PlannerSelector", "planner");
  add_selector(registry, "ControllerSelector", "controller");
  add_selector(registry, "SmootherSelector", "smoother");
  add_selector(registry, "GoalCheckerSelector", "goal_checker");
  add_selector(registry, "ProgressCheckerSelector", "progress_checker");
  add_selector(registry, "PathHandlerSelector", "path_handler");
}

std::vector<bt::NodeModel> skill_models() {
  using enum bt::Category;
  std::vector<bt::NodeModel> models;
  const auto add = [&](const char* id, bt::Category kind, Ports ports, const char* description, bool is_server = true) {
    if (is_server) {
      ports.push_back(bt::input("server_name", "not used: the project says where the robot is"));
      ports.push_back(bt::input("server_timeout", "not used: see deadlines in sentree.yaml"));
      ports.push_back(bt::output<std::int32_t>("error_code_id"));
      ports.push_back(bt::output<std::string>("error_msg"));
    }
    models.push_back({id, kind, std::move(ports), description});
  };
  const auto text = [](const char* name) { return bt::input<std::string>(name); };
  const auto number = [](const char* name, const char* otherwise, const char* what) {
    return bt::input_default<double>(name, otherwise, what);
  };
  const auto flag = [](const char* name, const char* otherwise) { return bt::input_default<bool>(name, otherwise); };
  add("ComputePathToPose", kAction,
      {bt::input("goal"), bt::input("start"), bt::input("use_start"), bt::input("viapoints"), text("planner_id"),
       bt::output("path")},
      "plans from where the robot is");
  add("ComputePathThroughPoses", kAction,
      {bt::input("goals"), bt::input("start"), text("planner_id"), bt::output("path"),
       bt::output<std::int32_t>("last_reached_index")},
      "plans through several poses");
  add("FollowPath", kAction,
      {bt::input("path"), text("controller_id"), text("goal_checker_id"), text("progress_checker_id"),
       text("path_handler_id"), bt::output("tracking_feedback")},
      "drives along a path, and along another one when it changes");
  add("NavigateToPose", kAction, {bt::input("goal"), text("behavior_tree")}, "plans and drives");
  add("NavigateThroughPoses", kAction, {bt::input("goals"), text("behavior_tree")}, "drives to one after the other");
  add("Spin", kAction,
      {number("spin_dist", "1.57", "rad, counter-clockwise"), number("time_allowance", "10.0", "s"),
       flag("is_recovery", "true"), flag("disable_collision_checks", "false")},
      "turns on the spot");
  add("BackUp", kAction,
      {number("backup_dist", "0.15", "m"), number("backup_speed", "0.025", "m/s; the robot's own is used"),
       number("time_allowance", "10.0", "s"), flag("disable_collision_checks", "false")},
      "drives straight back");
  add("DriveOnHeading", kAction,
      {number("dist_to_travel", "0.15", "m"), number("speed", "0.025", "m/s; the robot's own is used"),
       number("time_allowance", "10.0", "s"), flag("disable_collision_checks", "false")},
      "drives straight ahead");
  add("Wait", kAction, {number("wait_duration", "1.0", "s")}, "waits");
  for (const char* id : {"CancelControl", "CancelSpin", "CancelBackUp", "CancelDriveOnHeading"})
    add(id, kAction, {bt::input("server_name"), bt::input("server_timeout")}, "stops what the robot is at", false);
  add("ClearEntireCostmap", kAction, {text("service_name"), bt::input("server_timeout"), bt::input("plugins")},
      "forgets what the laser saw beyond the map", false);
  add("ValidatePath", kAction,
      {bt::input("path"), bt::input("max_cost"), bt::input("consider_unknown_as_obstacle"), bt::input("layer_name"),
       bt::input("footprint"), bt::input("stop_at_first_collision"), bt::input("max_lookahead_distance"),
       bt::input("service_name"), bt::input("server_timeout"), bt::output("collision_poses")},
      "whether nothing that is known stands on a path", false);
  add("SmoothPath", kAction,
      {bt::input("unsmoothed_path"), bt::output("smoothed_path"), text("smoother_id"),
       number("max_smoothing_duration", "3.0", "not used: it takes no time"), flag("check_for_collisions", "false"),
       bt::output<double>("smoothing_duration"), bt::output<bool>("was_completed")},
      "rounds the corners of a path");
  add("DockRobot", kAction,
      {flag("use_dock_id", "true"), text("dock_id"), bt::input("dock_pose"), text("dock_type"),
       number("max_staging_time", "1000.0", "not used: the robot's patience is"),
       flag("navigate_to_staging_pose", "true"), bt::output<bool>("success"), bt::output<std::int32_t>("num_retries")},
      "drives into a station, until the battery charges");
  add("UndockRobot", kAction,
      {text("dock_type"), number("max_undocking_time", "30.0", "s"), bt::output<bool>("success")},
      "drives straight back out of the station");
  add("RemovePassedGoals", kAction,
      {bt::input("input_goals"), bt::output("output_goals"), number("radius", "0.5", "m"), text("global_frame"),
       text("robot_base_frame"), bt::input("transform_tolerance"), bt::input("input_waypoint_statuses"),
       bt::output("output_waypoint_statuses")},
      "the goals that are left when those are gone that the robot is at", false);
  add("ReinitializeGlobalLocalization", kAction, {text("service_name"), bt::input("server_timeout")},
      "lets the localization begin anew, knowing nothing", false);
  add("IsPathValid", kCondition,
      {bt::input("path"), bt::input("server_timeout"), bt::input("max_cost"),
       bt::input("consider_unknown_as_obstacle")},
      "whether nothing that is known stands on a path", false);
  add("TruncatePathLocal", kAction,
      {bt::input("input_path"), bt::output("output_path"), number("distance_forward", "8.0", "m; < 0: all of it"),
       number("distance_backward", "4.0", "m"), text("robot_base_frame"), bt::input("transform_tolerance"),
       bt::input("pose"), bt::input("angular_distance_weight"), bt::input("max_robot_pose_search_dist")},
      "the part of a path around the robot", false);
  add("GetCurrentPose", kAction, {text("global_frame"), text("robot_base_frame"), bt::output("current_pose")},
      "where the robot is", false);
  add("IsGoalNearby", kCondition,
      {bt::input("path"), number("proximity_threshold", "1.0", "m"), bt::input("max_robot_pose_search_dist"),
       text("global_frame"), text("robot_base_frame")},
      "whether little of a path is left", false);
  add("GoalReached", kCondition, {bt::input("goal"), text("robot_base_frame")}, "whether the robot is there", false);
  add("IsBatteryLow", kCondition,
      {bt::input<double>("min_battery", "ratio, or V"), text("battery_topic"), flag("is_voltage", "false")},
      "whether less is left", false);
  add("IsBatteryCharging", kCondition, {text("battery_topic")}, "whether it charges", false);
  return models;
}

}  // namespace sentree::nav2::detail
