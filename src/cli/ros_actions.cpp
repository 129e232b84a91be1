#include "sentree/cli/ros_actions.h"

#include <fmt/format.h>

#include <map>
#include <mutex>
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
  bool is_canceled = false;
  Value plan;  // what planning said; null: it is no plan that was asked for
};

constexpr std::int64_t kUnknownError = 9000;

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

Map path_of(const List& poses) {
  List out;
  for (const Value& each : poses) out.push_back(to_pose2d(pose_of_ros(*each.find("pose"))));
  return Map{{"header", Map{{"stamp", 0.0}, {"frame_id", "map"}}}, {"poses", std::move(out)}};
}

Map location_of(const Value& stamped) {
  return Map{{"map_id", ""}, {"pose", to_pose2d(pose_of_ros(*stamped.find("pose")))}, {"description", ""}};
}

}  // namespace

class RosActions::Impl {
 public:
  explicit Impl(Options options) : options_(std::move(options)) {}

  Result<void> open() {
    const auto navigation = [this](const char* method, Map arguments) {
      return options_.ask("Navigation", method, std::move(arguments));
    };
    const auto through = [navigation](const Value* value) {
      const List* poses = poses_in(value);
      return poses != nullptr ? navigation("followPath", Map{{"path", path_of(*poses)}}) : Value();
    };
    const struct {
      const char* name;
      const char* type;
      std::function<Value(const Value& goal)> begin;
    } actions[] = {
        {"navigate_to_pose", "NavigateToPose",
         [navigation](const Value& goal) {
           return navigation("gotoTargetByAbsoluteLocation", Map{{"target", location_of(*goal.find("pose"))}});
         }},
        {"navigate_through_poses", "NavigateThroughPoses",
         [through](const Value& goal) { return through(goal.find("poses")); }},
        {"compute_path_to_pose", "ComputePathToPose",
         [navigation](const Value& goal) {
           const Map target = location_of(*goal.find("goal"));
           const Value* use_start = goal.find("use_start");
           if (use_start == nullptr || *use_start != Value(true))
             return navigation("computePathTo", Map{{"target", target}});
           const Pose start = pose_of_ros(*goal.at({"start", "pose"}));
           return navigation("computePathBetween", Map{{"start", to_pose2d(start)}, {"target", target}});
         }},
        {"follow_path", "FollowPath", [through](const Value& goal) { return through(goal.find("path")); }},
        {"spin", "Spin",
         [navigation](const Value& goal) {
           return navigation("spin", Map{{"angle", *goal.find("target_yaw")}});
         }},
        {"backup", "BackUp",
         [navigation](const Value& goal) {
           return navigation("driveStraight", Map{{"distance", -std::abs(goal.at({"target", "x"})->number())}});
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
        goals = goals_[name];
      }
      if (goals.empty()) continue;
      const Value state = options_.ask("Navigation", "getNavigationState", {});
      if (state.is_null()) continue;
      for (const RobotGoal& goal : goals) follow(name, served, goal, state, now, believed, tells);
    }
  }

 private:
  struct Served {
    idl::ServicePtr interface;
    std::unique_ptr<ros::ActionServer> server;
  };

  Result<void> serve(const std::string& name, const std::string& type, std::function<Value(const Value&)> begin) {
    auto of = ros_service(type);
    if (!of) return tl::unexpected(std::move(of.error()));
    ros::ActionServerOptions options;
    options.accept = [this, name, begin = std::move(begin)](const std::string& id, const Value& goal) {
      const Value reply = begin(goal);
      if (reply.is_null()) return false;
      const Value* number = reply.find("goal_id");
      const bool is_plan = number == nullptr;
      if (!is_plan && reply.find("code")->text() != "OK") return false;
      const std::lock_guard lock(mutex_);
      goals_[name].push_back({id, is_plan ? 0 : *number->as_int(), options_.now(), false, is_plan ? reply : Value()});
      return true;
    };
    options.cancel = [this, name](const std::string& id) { return stop(name, id); };
    options.now = options_.now;
    options.problem = options_.problem;
    auto opened = ros::ActionServer::open(fmt::format("{}/{}", options_.prefix, name), *of, std::move(options));
    if (!opened) return tl::unexpected(std::move(opened.error()));
    served_[name] = {*of, std::move(*opened)};
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
              {"error_code", found ? std::int64_t{0} : kUnknownError},
              {"error_msg", *goal.plan.find("error_msg")}});
      return;
    }
    const std::string_view status = state.find("status")->text();
    const bool is_current = *state.find("goal_id")->as_int() == goal.number;
    const bool is_reached = is_current && status == "GOAL_REACHED";
    const bool has_failed =
        !is_current || status == "ABORTED" || status == "FAILING" || status == "ERROR" || status == "IDLE";
    const Map passed = ros_stamp(std::max(0.0, now - goal.since));
    if (is_reached || has_failed || goal.is_canceled) {
      end(name, served, goal,
          is_reached         ? ros::GoalEnd::kSucceeded
          : goal.is_canceled ? ros::GoalEnd::kCanceled
                             : ros::GoalEnd::kAborted,
          Map{{"total_elapsed_time", passed},
              {"success", is_reached},
              {"error_code", is_reached ? std::int64_t{0} : kUnknownError},
              {"error_msg", is_current ? *state.find("error_msg") : Value("another goal took over")}});
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
                             {"docking_time", passed}}));
  }

  const Options options_;
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
