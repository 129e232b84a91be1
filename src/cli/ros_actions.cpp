#include "sentree/cli/ros_actions.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "sentree/cli/ros_network.h"
#include "sentree/ros/action_server.h"
#include "sentree/rpc/middleware.h"
#include "sentree/rpc/service.h"

namespace sentree::cli {
namespace {

/// A goal that the robot is at, or that is answered already.
struct RobotGoal {
  std::string id;
  std::int64_t number = 0;  // of the simulated navigation; 0: none
  double since = 0;
  double allowance = 0;  // [s]; 0: it may take any time
  Pose start;
  Pose at;            // where it was seen last
  double turned = 0;  // [rad] since the start
  bool is_canceled = false;
  Value plan;                              // what planning said; null: it is no plan that was asked for
  std::optional<Diagnostic> problem = {};  // what it cannot be done for
};

/// What of `all` the release's type has. Releases differ in the fields of results and feedback.
Value fitting(const idl::Service& action, const char* part, const char* field, const Map& all) {
  Map out;
  const idl::Method* method = action.find(part);
  const auto* type = method != nullptr ? method->arguments.find(std::string_view(field)) : nullptr;
  if (type == nullptr || type->type->structure == nullptr) return Value(std::move(out));
  for (const auto& [name, value] : all) {
    if (type->type->structure->find(name) != nullptr) out[name] = value;
  }
  return Value(std::move(out));
}

// geometry_msgs/PoseStamped[], which newer releases wrap.
const List* poses_in(const Value* value) {
  if (value == nullptr) return nullptr;
  if (value->as_list() != nullptr) return value->as_list();
  for (const char* name : {"poses", "goals"}) {
    if (const Value* inner = value->find(name)) return inner->as_list();
  }
  return nullptr;
}

Map location_of(const Pose& pose) { return Map{{"map_id", ""}, {"pose", to_pose2d(pose)}, {"description", ""}}; }

std::string frame_of(const Value& with_header) { return std::string(with_header.at({"header", "frame_id"})->text()); }

constexpr const char* kTransformError = "TF_ERROR";
constexpr const char* kTimeout = "TIMEOUT";

}  // namespace

class RosActions::Impl {
 public:
  explicit Impl(Options options) : options_(std::move(options)) {}

  Result<void> open() {
    const auto navigation = [this](const char* method, Map arguments) {
      return options_.ask("Navigation", method, std::move(arguments));
    };
    // `frame` is that of all of them; empty: each has its own.
    const auto through = [this, navigation](const Value* value, const std::string& frame) -> Result<Value> {
      const List* poses = poses_in(value);
      if (poses == nullptr) return Value();
      List out;
      for (const Value& each : *poses) {
        const auto pose = in_map(each, frame);
        if (!pose) return tl::unexpected(pose.error());
        out.push_back(to_pose2d(*pose));
      }
      return navigation(
          "followPath",
          Map{{"path", Map{{"header", Map{{"stamp", 0.0}, {"frame_id", "map"}}}, {"poses", std::move(out)}}}});
    };
    const struct {
      const char* name;
      const char* type;
      Begin begin;
    } actions[] = {
        {"navigate_to_pose", "NavigateToPose",
         [this, navigation](const Value& goal) {
           return in_map(*goal.find("pose")).map([&](const Pose& pose) {
             return navigation("gotoTargetByAbsoluteLocation", Map{{"target", location_of(pose)}});
           });
         }},
        {"navigate_through_poses", "NavigateThroughPoses",
         [through](const Value& goal) { return through(goal.find("poses"), ""); }},
        {"compute_path_to_pose", "ComputePathToPose",
         [this, navigation](const Value& goal) -> Result<Value> {
           const auto target = in_map(*goal.find("goal"));
           if (!target) return tl::unexpected(target.error());
           const Value* use_start = goal.find("use_start");
           if (use_start == nullptr || *use_start != Value(true))
             return navigation("computePathTo", Map{{"target", location_of(*target)}});
           return in_map(*goal.find("start")).map([&](const Pose& start) {
             return navigation("computePathBetween",
                               Map{{"start", to_pose2d(start)}, {"target", location_of(*target)}});
           });
         }},
        {"follow_path", "FollowPath",
         [through](const Value& goal) { return through(goal.find("path"), frame_of(*goal.find("path"))); }},
        {"spin", "Spin",
         [navigation](const Value& goal) {
           return navigation("spin", Map{{"angle", *goal.find("target_yaw")}});
         }},
        {"backup", "BackUp",
         [navigation](const Value& goal) {
           return navigation("driveStraightAt", Map{{"distance", -std::abs(goal.at({"target", "x"})->number())},
                                                    {"speed", std::abs(goal.find("speed")->number())}});
         }},
        {"dock_robot", "DockRobot",
         [navigation](const Value& goal) {
           // The world has docks by their names only.
           if (*goal.find("use_dock_id") != Value(true)) return Value();
           return navigation("dockRobot", Map{{"station", *goal.find("dock_id")}});
         }},
    };
    for (const auto& action : actions) {
      if (auto done = serve(action.name, std::string("nav2_msgs/action/") + action.type, action.begin); !done)
        return done;
    }
    for (const char* name :
         {"/global_costmap/clear_entirely_global_costmap", "/local_costmap/clear_entirely_local_costmap"}) {
      if (auto done = serve_clearing(name); !done) return done;
    }
    return {};
  }

  void step(double now, const Pose& believed, bool tells) {
    for (auto& [name, served] : served_) {
      std::vector<RobotGoal> goals;
      {
        const std::lock_guard lock(mutex_);
        for (RobotGoal& goal : goals_[name]) {
          goal.turned += std::remainder(believed.theta - goal.at.theta, 2 * std::numbers::pi);
          goal.at = believed;
        }
        goals = goals_[name];
      }
      if (goals.empty()) continue;
      const Value state = options_.ask("Navigation", "getNavigationState", {});
      if (state.is_null()) continue;
      for (const RobotGoal& goal : goals) follow(name, served, goal, state, now, believed, tells);
    }
  }

 private:
  // What the robot said: null if it does not take the goal. An error ends a goal that was taken.
  using Begin = std::function<Result<Value>(const Value& goal)>;

  struct Served {
    idl::Schema schema;
    idl::ServicePtr interface;
    std::unique_ptr<ros::ActionServer> server;

    // What this release's type calls an error; 9000 is Nav2's for what has no number of its own.
    [[nodiscard]] Value error(std::string_view name) const {
      const std::string result = interface->name.substr(interface->name.rfind('/') + 1) + "_Result.";
      for (const std::string_view each : {name, std::string_view("UNKNOWN")}) {
        if (const idl::Constant* found = schema.constant(result + std::string(each))) return found->value;
      }
      return std::int64_t{9000};
    }
  };

  // Where the robot is by its localization, and by its odometry.
  [[nodiscard]] std::pair<Pose, Pose> place() const {
    const Value position = options_.ask("Localization", "getCurrentPosition", {});
    const Value odometry = options_.ask("Base", "getOdometry", {});
    return {pose_of(position.find("pose")), pose_of(odometry.find("pose"))};
  }

  // A PoseStamped in the map; `frame` in place of its own, unless that is empty. Error: TF_ERROR.
  [[nodiscard]] Result<Pose> in_map(const Value& stamped, std::string frame = {}) const {
    if (frame.empty()) frame = frame_of(stamped);
    const Pose pose = pose_of_ros(*stamped.find("pose"));
    if (frame.empty() || frame == "map") return pose;
    const std::string own = options_.prefix.empty() ? "" : options_.prefix.substr(1) + "/";
    const bool is_base = frame == own + "base_link";
    if (!is_base && frame != own + "odom") {
      return fail(
          kTransformError,
          fmt::format("poses in \"{}\" are not known in map; there are map, {}odom and {}base_link", frame, own, own));
    }
    const auto [believed, odometry] = place();
    return (is_base ? believed : believed * inverse(odometry)) * pose;
  }

  Result<void> serve(const std::string& name, const std::string& type, Begin begin) {
    auto schema = ros_interface(type);
    if (!schema.ok()) return tl::unexpected(schema.diagnostics.front());
    for (const Diagnostic& each : schema.diagnostics) {
      if (options_.problem && !std::exchange(told_release_, true)) options_.problem(each.message);
    }
    const idl::ServicePtr of = schema.value->service(type.substr(type.rfind('/') + 1));
    ros::ActionServerOptions options;
    options.accept = [this, name, begin = std::move(begin)](const std::string& id, const Value& goal) {
      RobotGoal taken{.id = id, .since = options_.now()};
      if (const Value* allowance = goal.find("time_allowance")) taken.allowance = seconds_of_ros(*allowance);
      taken.start = taken.at = place().first;
      const Result<Value> reply = begin(goal);
      if (!reply) {
        taken.problem = reply.error();
      } else {
        if (reply->is_null()) return false;
        const Value* number = reply->find("goal_id");
        if (number != nullptr && reply->find("code")->text() != "OK") return false;
        if (number != nullptr)
          taken.number = *number->as_int();
        else
          taken.plan = *reply;
      }
      const std::lock_guard lock(mutex_);
      goals_[name].push_back(std::move(taken));
      return true;
    };
    options.cancel = [this, name](const std::string& id) { return stop(name, id); };
    options.now = options_.now;
    options.problem = options_.problem;
    auto opened = ros::ActionServer::open(fmt::format("{}/{}", options_.prefix, name), of, std::move(options));
    if (!opened) return tl::unexpected(std::move(opened.error()));
    served_.insert_or_assign(name, Served{std::move(*schema.value), of, std::move(*opened)});
    return {};
  }

  Result<void> serve_clearing(const std::string& name) {
    auto of = ros_service("nav2_msgs/srv/ClearEntireCostmap");
    if (!of) return tl::unexpected(std::move(of.error()));
    const auto clear = [this](const idl::Method&, const Value&) -> rpc::Outcome {
      if (!options_.ask("Navigation", "clearCurrentNavigationMap", {}).is_null()) return Value(Map());
      return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kUnreachable, "the robot does not answer", {}, {}});
    };
    rpc::ServerOptions options;
    options.on_peer_error = options_.problem;
    auto opened = rpc::serve(*rpc::Address::parse(fmt::format("ros:{}{}", options_.prefix, name)),
                             {{"service", std::make_shared<rpc::FunctionService>(*of, clear)}}, std::move(options));
    if (!opened) return tl::unexpected(std::move(opened.error()));
    services_.push_back(std::move(*opened));
    return {};
  }

  bool stop(const std::string& name, const std::string& id) {
    const std::lock_guard lock(mutex_);
    for (RobotGoal& each : goals_[name]) {
      if (each.id != id) continue;
      each.is_canceled = true;
      if (each.number != 0) (void)options_.ask("Navigation", "stopNavigation", Map{{"goal_id", each.number}});
      return true;
    }
    return false;
  }

  void end(const std::string& name, const Served& served, const RobotGoal& goal, ros::GoalEnd how, const Map& result) {
    served.server->end(goal.id, how, fitting(*served.interface, "result", "result", result));
    const std::lock_guard lock(mutex_);
    std::erase_if(goals_[name], [&](const RobotGoal& each) { return each.id == goal.id; });
  }

  void follow(const std::string& name, const Served& served, const RobotGoal& goal, const Value& state, double now,
              const Pose& believed, bool tells) {
    if (goal.problem) {
      end(name, served, goal, ros::GoalEnd::kAborted,
          Map{{"error_code", served.error(goal.problem->code)}, {"error_msg", goal.problem->message}});
      return;
    }
    if (!goal.plan.is_null()) {
      const bool found = goal.plan.find("code")->text() == "OK";
      List poses;
      for (const Value& each : *goal.plan.at({"path", "poses"})->as_list())
        poses.push_back(Map{{"header", ros_header(now, "map")}, {"pose", ros_pose(pose_of(&each))}});
      end(name, served, goal,
          goal.is_canceled ? ros::GoalEnd::kCanceled
          : found          ? ros::GoalEnd::kSucceeded
                           : ros::GoalEnd::kAborted,
          Map{{"path", Map{{"header", ros_header(now, "map")}, {"poses", std::move(poses)}}},
              {"error_code", found ? Value(0) : served.error(goal.plan.find("error_code")->text())},
              {"error_msg", *goal.plan.find("error_msg")}});
      return;
    }
    const std::string_view status = state.find("status")->text();
    const bool is_current = *state.find("goal_id")->as_int() == goal.number;
    const bool is_reached = is_current && status == "GOAL_REACHED";
    const bool has_failed =
        !is_current || status == "ABORTED" || status == "FAILING" || status == "ERROR" || status == "IDLE";
    const Map passed = ros_stamp(std::max(0.0, now - goal.since));
    const bool is_late = !is_reached && !has_failed && goal.allowance > 0 && now - goal.since > goal.allowance;
    if (is_late) (void)options_.ask("Navigation", "stopNavigation", Map{{"goal_id", goal.number}});
    if (is_reached || has_failed || is_late || goal.is_canceled) {
      const auto [error, why] = is_late ? std::pair<std::string, std::string>(kTimeout, "its time_allowance is over")
                                : is_current ? std::pair<std::string, std::string>(state.find("error_code")->text(),
                                                                                   state.find("error_msg")->text())
                                             : std::pair<std::string, std::string>("UNKNOWN", "another goal took over");
      end(name, served, goal,
          is_reached         ? ros::GoalEnd::kSucceeded
          : goal.is_canceled ? ros::GoalEnd::kCanceled
                             : ros::GoalEnd::kAborted,
          Map{{"total_elapsed_time", passed},
              {"success", is_reached},
              {"error_code", is_reached ? Value(0) : served.error(error)},
              {"error_msg", why}});
      return;
    }
    if (!tells) return;
    served.server->feedback(
        goal.id, fitting(*served.interface, "feedback", "feedback",
                         Map{{"current_pose", Map{{"header", ros_header(now, "map")}, {"pose", ros_pose(believed)}}},
                             {"navigation_time", ros_stamp(state.find("navigation_time")->number())},
                             {"estimated_time_remaining",
                              ros_stamp(std::max(0.0, state.find("estimated_time_remaining")->number()))},
                             {"number_of_recoveries", *state.find("number_of_recoveries")},
                             {"distance_remaining", *state.find("distance_remaining")},
                             {"distance_to_goal", *state.find("distance_remaining")},
                             {"distance_traveled", std::hypot(believed.x - goal.start.x, believed.y - goal.start.y)},
                             {"angular_distance_traveled", goal.turned},
                             {"docking_time", passed}}));
  }

  const Options options_;
  bool told_release_ = false;
  std::mutex mutex_;  // of the goals
  std::map<std::string, std::vector<RobotGoal>> goals_;
  std::map<std::string, Served> served_;
  std::vector<std::unique_ptr<rpc::Opened>> services_;
};

RosActions::RosActions(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RosActions::~RosActions() = default;

Result<std::unique_ptr<RosActions>> RosActions::open(Options options) {
  auto impl = std::make_unique<Impl>(std::move(options));
  if (auto opened = impl->open(); !opened) return tl::unexpected(std::move(opened.error()));
  return std::unique_ptr<RosActions>(new RosActions(std::move(impl)));
}

void RosActions::step(double now, const Pose& believed, bool tells) { impl_->step(now, believed, tells); }

}  // namespace sentree::cli
