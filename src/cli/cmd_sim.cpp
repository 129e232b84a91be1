#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>

#include "sentree/cli/colours.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/ros_robot.h"
#include "sentree/cli/terminal_map.h"
#include "sentree/cli/tour.h"
#include "sentree/cli/yarp_network.h"
#include "sentree/cli/yarp_robot.h"
#include "sentree/processes/component.h"
#include "sentree/processes/control.h"
#include "sentree/ros/address.h"
#include "sentree/rpc/middleware.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"
#include "sentree/yarp/address.h"

namespace sentree::cli {

namespace {

constexpr Duration kFrame = std::chrono::milliseconds(100);

Value pose_value(const sim::Pose2& pose) { return Map{{"x", pose.x}, {"y", pose.y}, {"theta", pose.theta}}; }

struct RobotView {
  std::string name;
  sim::Pose2 pose;
  sim::Pose2 believed;
  double charge = 0.0;
  bool charging = false;
  std::string status;
  std::string error;
  std::string target;
  double remaining_m = 0.0;
  std::int64_t collisions = 0;
};

// What the services would say of a robot, and the truth. `state` is a copy: asking changes nothing.
std::vector<RobotView> look(const sim::World& world, sim::State& state) {
  std::vector<RobotView> views;
  state.clock.paused = true;
  for (std::size_t i = 0; i < state.robots.size(); ++i) {
    const sim::RobotState& robot = state.robots[i];
    const Map none;
    const auto navigation = sim::call(
        world, state,
        {.service = "Navigation", .method = "getNavigationState", .args = none, .robot = world.robots[i].name}, {});
    views.push_back({.name = world.robots[i].name,
                     .pose = robot.truth.pose,
                     .believed = estimated_pose(robot.localization, robot.odometry),
                     .charge = robot.battery.charge,
                     .charging = sim::is_charging(robot.battery),
                     .status = std::string(navigation->find("status")->text()),
                     .error = std::string(navigation->find("error_code")->text()),
                     .target = std::string(navigation->find("target_name")->text()),
                     .remaining_m = navigation->find("distance_remaining")->number(),
                     .collisions = robot.truth.collisions});
  }
  return views;
}

std::string json_line(const sim::World& world, sim::State state) {
  const double time = seconds(state.time.time_since_epoch());
  List robots;
  for (const RobotView& robot : look(world, state)) {
    robots.push_back(Map{{"name", robot.name},
                         {"pose", pose_value(robot.pose)},
                         {"believed", pose_value(robot.believed)},
                         {"charge", robot.charge},
                         {"charging", robot.charging},
                         {"status", robot.status},
                         {"error_code", robot.error},
                         {"target", robot.target},
                         {"distance_remaining", robot.remaining_m},
                         {"collisions", robot.collisions}});
  }
  return to_json(Value(Map{{"time", time}, {"robots", std::move(robots)}})) + "\n";
}

std::string robot_text(const RobotView& robot) {
  std::string line = fmt::format("{} at ({:.2f}, {:.2f}, {:.0f}°)  {:.1f} %{}  {}", robot.name, robot.pose.x,
                                 robot.pose.y, robot.pose.theta * 57.29577951308232, robot.charge * 100.0,
                                 robot.charging ? " charging" : "", robot.status);
  if (robot.error != "NONE") line += " " + robot.error;
  if (!robot.target.empty()) line += " " + robot.target;
  if (robot.remaining_m > 0.0) line += fmt::format(", {:.1f} m left", robot.remaining_m);
  const double off = distance(robot.pose.position(), robot.believed.position());
  if (off > 0.02) line += fmt::format(", believes to be {:.2f} m off", off);
  return line;
}

std::string text_lines(const sim::World& world, sim::State state) {
  std::string text;
  const double time = seconds(state.time.time_since_epoch());
  for (const RobotView& robot : look(world, state)) text += fmt::format("{:8.1f} s  {}\n", time, robot_text(robot));
  return text;
}

std::vector<std::string> frame(const sim::World& world, const sim::State& state, const std::string& title,
                               const TerminalSize& size) {
  std::vector<std::string> lines;
  const sim::TimeControl& clock = state.clock;
  std::string time = fmt::format("{:.1f} s", seconds(state.time.time_since_epoch()));
  if (clock.paused)
    time += "  paused";
  else if (clock.factor != 1.0)
    time += fmt::format("  × {}", shortest_decimal(clock.factor));
  lines.push_back(fmt::format(" {}   {}", title, time));
  sim::State copy = state;
  for (const RobotView& robot : look(world, copy))
    lines.push_back(fmt::format(" {} {}", battery_bar(robot.charge), robot_text(robot)));
  lines.emplace_back();
  const int room = size.rows - static_cast<int>(lines.size()) - 2;
  if (room > 3) {
    for (const std::string& line : map_lines(world, state, size.columns - 2, room)) lines.push_back(" " + line);
  }
  lines.push_back(coloured(kDim, " sentree call: what it offers   Ctrl-C: end"));
  return lines;
}

// As fast as the machine allows, until the tour or the duration is over. The same every time.
int sprint(const sim::World& world, Tour tour, const SimCommand& command, std::optional<Duration> duration) {
  sim::State state = sim::initial_state(world, command.seed);
  state.clock.paused = true;  // only what is asked for below advances it
  const Tour::Call call = [&](const std::string& robot, const std::string& method, const Map& arguments) {
    return sim::call(world, state, {.service = "Navigation", .method = method, .args = arguments, .robot = robot}, {});
  };
  const std::int64_t lines_s = command.json ? 1 : 10;
  std::int64_t next_line = 0;
  for (;;) {
    tour.step(call);
    const bool over = duration ? state.time.time_since_epoch() >= *duration : tour.is_over();
    if (over || seconds(state.time.time_since_epoch()) >= static_cast<double>(next_line)) {
      print(command.json ? json_line(world, state) : text_lines(world, state));
      next_line += lines_s;
    }
    if (over) break;
    sim::advance_by(world, state, kFrame);
  }
  for (const std::string& missed : tour.missed()) say("! " + missed);
  return tour.missed().empty() ? kOk : kFindings;
}

// Whether ports there are known to the name server of YARP that is configured.
bool asks_configured_names(const rpc::Address& address) {
  if (address.scheme != "yarp") return false;
  const auto port = yarp::PortAddress::parse(address.path);
  return port && port->direct.host.empty() && port->server.host.empty();
}

// Of a service of those that are served there.
std::string address_of(const std::string& at, const std::string& service) {
  rpc::Address address = *rpc::Address::parse(at);
  if (address.kind != rpc::Address::Kind::kOther) {
    address.service = service;
    return to_string(address);
  }
  if (address.scheme == "yarp") {
    auto port = *yarp::PortAddress::parse(address.path);
    port.name = port.name_of(service);
    return to_string(port);
  }
  const std::string options = address.path.substr(std::min(address.path.find('?'), address.path.size()));
  return address.scheme + ":" + ros::GraphAddress::parse(address.path)->name_of(service) + options;
}

// Draws, prints and drives until a signal or the end. The signals are blocked.
int watch(processes::SimServer& server, const sim::World& world, Tour tour, const SimCommand& command,
          std::optional<Duration> duration, const sigset_t& signals) {
  const bool live = !command.json && !command.headless && isatty(STDOUT_FILENO) == 1;
  if (live) print_screen("\x1b[?1049h\x1b[?25l");  // another screen, no cursor
  const Tour::Call call = [&](const std::string& robot, const std::string& method,
                              const Map& arguments) -> Result<Value> {
    mission::CallOutcome outcome = server.host().call("Navigation", method, arguments, robot);
    if (outcome.ok) return std::move(outcome.result);
    return fail("cli.call", outcome.message);
  };
  const double line_s = command.json ? 1.0 : 5.0;
  double next_line = 0.0;
  int code = kOk;
  std::size_t told = 0;
  for (;;) {
    tour.step(call);
    const sim::State state = server.host().snapshot();
    const double time = seconds(state.time.time_since_epoch());
    if (live) {
      const TerminalSize size = terminal_size();
      const std::string speed = command.speed == 1.0 ? "" : "   × " + shortest_decimal(command.speed);
      print_frame(frame(world, state, command.world + speed, size), size);
    } else {
      // A reset starts time anew.
      if (time + line_s < next_line) next_line = 0.0;
      if (time >= next_line) {
        print(command.json ? json_line(world, state) : text_lines(world, state));
        next_line = std::floor(time / line_s + 1.0) * line_s;
      }
      for (; told < tour.missed().size(); ++told) say("! " + tour.missed()[told]);
    }
    if (duration && state.time.time_since_epoch() >= *duration) break;
    const timespec wait{.tv_sec = 0, .tv_nsec = kFrame.count()};
    if (sigtimedwait(&signals, nullptr, &wait) > 0) {
      // Without a duration this is how it ends.
      if (duration) code = kInterrupted;
      break;
    }
  }
  if (live) {
    print_screen("\x1b[?25h\x1b[?1049l");
    print(text_lines(world, server.host().snapshot()));
    for (const std::string& missed : tour.missed()) say("! " + missed);
  }
  if (code == kOk && !tour.missed().empty()) code = kFindings;
  return code;
}

// Where a simulated robot is to be found: addresses, ports of YARP, topics of ROS.
class Served {
 public:
  int begin(processes::SimServer& server, const sim::World& world, const SimCommand& command,
            const std::optional<rpc::Address>& address) {
    std::vector<rpc::Address> addresses;
    if (address) addresses.push_back(*address);
    if (command.yarp || (address && asks_configured_names(*address))) {
      auto there = ensure_name_server("", command.insecure);
      if (!there) {
        say(to_string(there.error()));
        return kEnvironment;
      }
      names_ = std::move(*there);
    }
    // What --at says of a network is said of it once.
    const auto also = [&](const char* where) {
      const rpc::Address all = *rpc::Address::parse(where);
      if (!address || address->scheme != all.scheme) addresses.push_back(all);
    };
    if (command.yarp) also("yarp:/");
    if (command.ros) also("ros:/");
    for (const rpc::Address& each : addresses) {
      rpc::ServerOptions options;
      options.insecure = command.insecure;
      options.on_peer_error = [](const std::string& what) { say("! " + what); };
      auto started = rpc::serve(each, server.services(), std::move(options));
      if (!started) {
        say(to_string(started.error()));
        return kEnvironment;
      }
      served_.push_back(std::move(*started));
      const std::string at = served_.back()->address();
      say("listening on " + at);
      for (const rpc::NamedService& service : server.services())
        server.tell_address(service.name, address_of(at, service.name));
    }
    for (const rpc::Address& each : addresses) {
      // Ports for data are found by their names.
      if (each.scheme != "yarp" || !yarp::PortAddress::parse(each.path)->direct.host.empty()) continue;
      auto started = YarpRobot::start(server, world, each);
      if (!started) {
        say(to_string(started.error()));
        return kEnvironment;
      }
      in_yarp_.push_back(std::move(*started));
    }
    if (command.ros) {
      auto started = RosRobot::start(server, world, [](const std::string& what) { say("! " + what); });
      if (!started) {
        say(to_string(started.error()));
        return kEnvironment;
      }
      robot_ = std::move(*started);
      say("publishing as a robot of ROS 2");
    }
    return kOk;
  }

 private:
  std::unique_ptr<yarp::NameServer> names_;
  std::vector<std::unique_ptr<rpc::Opened>> served_;
  std::vector<std::unique_ptr<YarpRobot>> in_yarp_;
  std::unique_ptr<RosRobot> robot_;
};

}  // namespace

int sim(const SimCommand& command) {
  std::optional<Duration> duration;
  if (!command.duration.empty()) {
    duration = project::parse_duration(command.duration);
    if (!duration) {
      say(fmt::format("--duration {}: not a duration such as 90 s or 5 min", command.duration));
      return kUsage;
    }
  }
  auto component = processes::prepare_sim_world(command.world);
  say(component.diagnostics);
  if (!component.ok()) return kInvalidInput;
  const std::shared_ptr<const sim::World> world = component.value->world;
  auto tour = Tour::parse(*world, command.stops);
  if (!tour) {
    say(tour.error().message);
    return kUsage;
  }
  if (command.speed == 0.0) {
    if (!command.at.empty() || command.yarp || command.ros) {
      say("--speed 0 leaves no time for others to connect; serve at a speed above 0");
      return kUsage;
    }
    if (!duration && command.stops.empty()) {
      say("--speed 0 needs to know when to end: give --duration or --goto");
      return kUsage;
    }
    return sprint(*world, *std::move(tour), command, duration);
  }

  std::optional<rpc::Address> address;
  if (!command.at.empty()) {
    auto parsed = rpc::Address::parse(command.at);
    if (!parsed) {
      say("--at: " + parsed.error().message);
      return kUsage;
    }
    address = *parsed;
  }
  // Blocked before the servers' threads begin, so that they inherit it.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  processes::SimServer server(std::move(*component.value), command.seed, command.speed);
  const auto control = processes::start_control(server.control(command.world));
  if (!control) say(fmt::format("no control socket: {}", to_string(control.error())));
  Served served;
  if (const int code = served.begin(server, *world, command, address); code != kOk) return code;
  return watch(server, *world, *std::move(tour), command, duration, signals);
}

}  // namespace sentree::cli
