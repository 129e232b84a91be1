#include "sentree/cli/ros_robot.h"

#include <fmt/format.h>

#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "sentree/cli/ros_actions.h"
#include "sentree/cli/ros_network.h"
#include "sentree/cli/ros_values.h"
#include "sentree/sim/simulation.h"
#include "sentree/sim/world.h"

namespace sentree::cli {
namespace {

constexpr std::chrono::milliseconds kPeriod{100};
// A robot of ROS stops when nobody commands it any more.
constexpr double kCommandTimeout_s = 0.5;
constexpr std::int64_t kTicksPerSecond = 10;

// 6 by 6 of a covariance of (x, y, theta), which may be empty.
List covariance(const Value* three) {
  List out(36, Value(0.0));
  const List* given = three != nullptr ? three->as_list() : nullptr;
  if (given == nullptr || given->size() != 9) return out;
  constexpr std::size_t kPlace[] = {0, 1, 5};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      out[kPlace[row] * 6 + kPlace[column]] = (*given)[row * 3 + column];
  }
  return out;
}

// A geometry_msgs/TransformStamped.
Map transform(double now, const std::string& parent, const std::string& child, const Pose& pose) {
  return Map{
      {"header", ros_header(now, parent)},
      {"child_frame_id", child},
      {"transform", Map{{"translation", ros_vector(pose.x, pose.y, 0)}, {"rotation", ros_rotation(pose.theta)}}}};
}

}  // namespace

class RosRobot::Impl {
 public:
  Impl(processes::SimServer& server, std::function<void(const std::string&)> problem)
      : server_(server), problem_(std::move(problem)) {}
  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    for (auto& each : heard_) each->stop();
    actions_.clear();
    topics_.clear();
  }

  Result<void> open(const sim::World& world) {
    const bool several = world.robots.size() > 1;
    for (const auto& each : world.robots) {
      const sim::Pose2& mount = each.laser.mount;
      robots_.push_back({each.name, several ? "/" + each.name : "", {mount.x, mount.y, mount.theta}});
    }
    if (auto done = publish("/clock", "rosgraph_msgs/msg/Clock", "best_effort"); !done) return done;
    if (auto done = publish("/tf", "tf2_msgs/msg/TFMessage", "default"); !done) return done;
    if (auto done = publish("/tf_static", "tf2_msgs/msg/TFMessage", "transient_local"); !done) return done;
    for (const Robot& robot : robots_) {
      const struct {
        const char* name;
        const char* type;
        const char* qos;
      } topics[] = {{"/battery_state", "sensor_msgs/msg/BatteryState", "default"},
                    {"/odom", "nav_msgs/msg/Odometry", "default"},
                    {"/scan", "sensor_msgs/msg/LaserScan", "default"},
                    {"/map", "nav_msgs/msg/OccupancyGrid", "transient_local"},
                    {"/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", "transient_local"}};
      for (const auto& topic : topics) {
        if (auto done = publish(robot.prefix + topic.name, topic.type, topic.qos); !done) return done;
      }
      if (auto done = hear_commands(robot); !done) return done;
      if (auto done = serve_actions(robot); !done) return done;
    }
    thread_ = std::thread([this] { run(); });
    return {};
  }

 private:
  struct Robot {
    std::string name;
    std::string prefix;
    Pose laser;  ///< In base_link.

    [[nodiscard]] std::string frames() const { return prefix.empty() ? "" : name + "/"; }
  };

  Result<void> publish(const std::string& name, const std::string& type, const std::string& qos) {
    auto of = ros_service(type);
    if (!of) return tl::unexpected(std::move(of.error()));
    auto made = rpc::connect(*rpc::Address::parse(fmt::format("ros:{}?publish&qos={}", name, qos)), *of,
                             {.target = name, .limits = {}, .tls = {}});
    if (!made) return tl::unexpected(std::move(made.error()));
    topics_[name] = std::move(*made);
    return {};
  }

  Result<void> hear_commands(const Robot& robot) {
    auto of = ros_service("geometry_msgs/msg/Twist");
    if (!of) return tl::unexpected(std::move(of.error()));
    const rpc::Address address = *rpc::Address::parse(fmt::format("ros:{}/cmd_vel", robot.prefix));
    auto opened = rpc::middleware_of(address).subscribe(
        address, *of,
        [this, name = robot.name](const idl::Method&, Value twist) {
          const auto part = [&](const char* which, const char* axis) { return twist.at({which, axis})->number(); };
          const Map command{{"vx", part("linear", "x")}, {"vy", part("linear", "y")}, {"omega", part("angular", "z")}};
          static_cast<void>(
              ask(name, "Base", "applyVelocityCommand", Map{{"cmd", command}, {"timeout", kCommandTimeout_s}}));
        },
        {.target = "cmd_vel", .problem = problem_, .optional = true});
    if (!opened) return tl::unexpected(std::move(opened.error()));
    heard_.push_back(std::move(*opened));
    return {};
  }

  Result<void> serve_actions(const Robot& robot) {
    auto opened = RosActions::open(
        {.prefix = robot.prefix,
         .ask = [this, name = robot.name](const char* interface, const char* method,
                                          Map arguments) { return ask(name, interface, method, std::move(arguments)); },
         .now = [this] { return seconds(server_.host().snapshot().time.time_since_epoch()); },
         .problem = problem_});
    if (!opened) return tl::unexpected(std::move(opened.error()));
    actions_[robot.name] = std::move(*opened);
    return {};
  }

  // Null: the simulator does not say.
  Value ask(const std::string& robot, const char* interface, const char* method, Map arguments = {}) {
    mission::CallOutcome out = server_.host().call(interface, method, Value(std::move(arguments)), robot);
    return out.ok ? std::move(out.result) : Value();
  }

  void send(const std::string& name, Map message) {
    topics_.at(name)->call("message", Value(std::move(message)), rpc::kNoDeadline,
                           [this, name](const rpc::Outcome& out) {
                             if (!out && problem_ && !told_.exchange(true))
                               problem_(fmt::format("{}: {}", name, out.error().message));
                           });
  }

  // What is mounted on the robots.
  void send_mounts() {
    List transforms;
    for (const Robot& robot : robots_)
      transforms.push_back(transform(0, robot.frames() + "base_link", robot.frames() + "laser", robot.laser));
    send("/tf_static", Map{{"transforms", std::move(transforms)}});
  }

  void run() {
    send_mounts();
    std::unique_lock lock(mutex_);
    for (std::int64_t tick = 0; !stopped_; ++tick) {
      lock.unlock();
      const double now = seconds(server_.host().snapshot().time.time_since_epoch());
      send("/clock", Map{{"clock", ros_stamp(now)}});
      List transforms;
      for (const Robot& robot : robots_) step(robot, now, tick, transforms);
      send("/tf", Map{{"transforms", std::move(transforms)}});
      lock.lock();
      changed_.wait_for(lock, kPeriod, [&] { return stopped_; });
    }
  }

  void step(const Robot& robot, double now, std::int64_t tick, List& transforms) {
    const std::string frames = robot.frames();
    const Value odometry = ask(robot.name, "Base", "getOdometry");
    const Value position = ask(robot.name, "Localization", "getCurrentPosition");
    if (odometry.is_null() || position.is_null()) return;
    const Pose odom = pose_of(odometry.find("pose"));
    const Pose believed = pose_of(position.find("pose"));
    transforms.push_back(transform(now, "map", frames + "odom", believed * inverse(odom)));
    transforms.push_back(transform(now, frames + "odom", frames + "base_link", odom));
    const Value* twist = odometry.find("twist");
    send(robot.prefix + "/odom",
         Map{{"header", ros_header(now, frames + "odom")},
             {"child_frame_id", frames + "base_link"},
             {"pose", Map{{"pose", ros_pose(odom)}, {"covariance", covariance(nullptr)}}},
             {"twist",
              Map{{"twist", Map{{"linear", ros_vector(twist->find("vx")->number(), twist->find("vy")->number(), 0)},
                                {"angular", ros_vector(0, 0, twist->find("omega")->number())}}},
                  {"covariance", covariance(nullptr)}}}});
    actions_.at(robot.name)->step(now, believed, tick % (kTicksPerSecond / 2) == 0);
    if (tick % 2 == 0) publish_scan(robot, now, frames);
    if (tick % (kTicksPerSecond / 2) == 0) {
      publish_battery(robot, now);
      send(robot.prefix + "/amcl_pose",
           Map{{"header", ros_header(now, "map")},
               {"pose", Map{{"pose", ros_pose(believed)}, {"covariance", covariance(position.find("covariance"))}}}});
    }
    if (tick % (10 * kTicksPerSecond) == 0) publish_map(robot, now);
  }

  void publish_scan(const Robot& robot, double now, const std::string& frames) {
    const Value scan = ask(robot.name, "Laser", "getLaserMeasurement");
    if (scan.is_null()) return;
    Map out{{"header", ros_header(now, frames + "laser")}};
    for (const char* name :
         {"angle_min", "angle_max", "angle_increment", "scan_time", "range_min", "range_max", "ranges"})
      out[name] = *scan.find(name);
    send(robot.prefix + "/scan", std::move(out));
  }

  void publish_battery(const Robot& robot, double now) {
    const Value state = ask(robot.name, "Battery", "getBatteryState");
    if (state.is_null()) return;
    constexpr const char* kStatuses[] = {"UNKNOWN", "CHARGING", "DISCHARGING", "NOT_CHARGING", "FULL"};
    std::int64_t status = 0;
    for (std::int64_t i = 0; i < 5; ++i) {
      if (state.find("power_supply_status")->text() == kStatuses[i]) status = i;
    }
    const double unknown = std::nan("");
    Map out{{"header", ros_header(now, "")},
            {"charge", unknown},
            {"capacity", unknown},
            {"design_capacity", unknown},
            {"power_supply_status", status}};
    for (const char* name : {"voltage", "temperature", "current", "percentage", "present"})
      out[name] = *state.find(name);
    send(robot.prefix + "/battery_state", std::move(out));
  }

  void publish_map(const Robot& robot, double now) {
    const Value names = ask(robot.name, "MapServer", "getMapNames");
    if (names.as_list() == nullptr || names.as_list()->empty()) return;
    const Value reply = ask(robot.name, "MapServer", "getMap", Map{{"map_id", names.as_list()->front()}});
    const Value* grid = reply.find("grid");
    const Value* info = grid != nullptr ? grid->find("info") : nullptr;
    if (info == nullptr) return;
    send(robot.prefix + "/map", Map{{"header", ros_header(now, "map")},
                                    {"info", Map{{"map_load_time", ros_stamp(0)},
                                                 {"resolution", *info->find("resolution")},
                                                 {"width", *info->find("width")},
                                                 {"height", *info->find("height")},
                                                 {"origin", ros_pose(pose_of(info->find("origin")))}}},
                                    {"data", *grid->find("data")}});
  }

  processes::SimServer& server_;
  const std::function<void(const std::string&)> problem_;
  std::vector<Robot> robots_;
  std::map<std::string, std::unique_ptr<rpc::Caller>> topics_;
  std::vector<std::unique_ptr<rpc::Opened>> heard_;
  std::map<std::string, std::unique_ptr<RosActions>> actions_;
  std::atomic<bool> told_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

RosRobot::RosRobot(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RosRobot::~RosRobot() = default;

Result<std::unique_ptr<RosRobot>> RosRobot::start(processes::SimServer& server, const sim::World& world,
                                                  std::function<void(const std::string&)> problem) {
  auto impl = std::make_unique<Impl>(server, std::move(problem));
  if (auto opened = impl->open(world); !opened) return tl::unexpected(std::move(opened.error()));
  return std::unique_ptr<RosRobot>(new RosRobot(std::move(impl)));
}

}  // namespace sentree::cli
