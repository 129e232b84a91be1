#include "sentree/sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sentree/base/assert.h"
#include "sentree/base/present.h"
#include "sentree/sim/detail/announced.h"
#include "sentree/sim/detail/clearance.h"
#include "sentree/sim/detail/exact_localization.h"
#include "sentree/sim/scan_memo.h"
#include "sentree/sim/sight.h"

namespace sentree::sim {

namespace {

constexpr double kRounding_m = 1e-6;

// What stands in the world beside the map's walls, as this robot meets it: obstacles, closed doors, other robots.
std::vector<Shape> shapes_around(const World& world, const State& state, std::size_t robot) {
  std::vector<Shape> shapes;
  for (const Obstacle& obstacle : state.obstacles) shapes.push_back(obstacle.shape);
  for (const Door& door : state.doors) {
    if (!door.open) shapes.push_back(Shape::wall(door.a, door.b, door.thickness_m));
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i) {
    if (i == robot) continue;
    shapes.push_back(Shape::disc(state.robots[i].truth.pose.position(), world.robots[i].radius_m));
  }
  return shapes;
}

double room(const World& world, std::span<const Shape> shapes, Vec2 centre, double radius_m) {
  double room_m = clearance(world.map, world.distance, centre, radius_m);
  for (const Shape& shape : shapes) room_m = std::min(room_m, distance(shape, centre));
  return room_m;
}

int station_at(const World& world, const Pose2& pose) {
  for (std::size_t i = 0; i < world.stations.size(); ++i) {
    const Station& station = world.stations[i];
    if (distance(pose.position(), station.pose.position()) > station.linear_tolerance_m) continue;
    if (std::abs(wrap_angle(pose.theta - station.pose.theta)) <= station.angular_tolerance_rad)
      return static_cast<int>(i);
  }
  return -1;
}

void move(const World& world, const RobotSpec& spec, std::span<const Shape> shapes, RobotState& robot, Duration dt) {
  const Pose2 motion = arc(robot.truth.twist, dt);
  const Pose2 next = compose(robot.truth.pose, motion);
  bool blocked = false;
  if (motion.x != 0.0 || motion.y != 0.0) {
    const double room_next = room(world, shapes, next.position(), spec.radius_m);
    // What has been put onto the robot does not hold it: it may move away.
    blocked = room_next < spec.radius_m && room_next < room(world, shapes, robot.truth.pose.position(), spec.radius_m);
  }
  if (blocked) {
    ++robot.truth.collisions;
    robot.truth.twist = {};
    robot.odometry_twist = {};
    return;
  }
  robot.truth.pose = next;
  const Pose2 seen = measured(spec.odometry, motion, robot.odometry_rng);
  robot.odometry = compose(robot.odometry, seen);
  const double s = seconds(dt);
  robot.odometry_twist = {seen.x / s, seen.theta / s};
  if (spec.odometry == OdometryNoise{}) robot.odometry_twist = robot.truth.twist;
}

void charge(const World& world, const RobotSpec& spec, RobotState& robot, Duration dt, TimePoint now) {
  const int station = station_at(world, robot.truth.pose);
  if (station != robot.station) {
    robot.station = station;
    robot.arrived = now;
  }
  if (station >= 0 && !robot.battery.plugged && !robot.battery.full) {
    for (const Person& person : world.people) {
      if (person.station == world.stations[static_cast<std::size_t>(station)].name &&
          robot.battery.charge < person.below && now - robot.arrived >= person.after) {
        robot.battery.plugged = true;
      }
    }
    // Contacts close when the robot has docked.
    const Navigator& navigator = robot.navigator;
    if (world.stations[static_cast<std::size_t>(station)].contacts && navigator.goal.kind == GoalKind::kDock &&
        navigator.waiting_since != TimePoint{}) {
      robot.battery.plugged = true;
    }
  }
  step_battery(spec.battery, robot.battery, dt, std::abs(robot.truth.twist.vx) * seconds(dt), station >= 0);
}

bool is_any_in_reach(std::span<const Shape> shapes, const Pose2& laser, const LaserSpec& spec) {
  return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& shape) {
    return distance(shape.pose.position(), laser.position()) <= spec.range_max_m + bounding_radius(shape) + kRounding_m;
  });
}

void cast(const World& world, std::size_t index, const Pose2& laser, std::span<const Shape> shapes, RobotState& robot) {
  ScanMemo* const memo = Present<ScanMemo>::present();
  if (memo != nullptr && memo->recall(index, laser, shapes, robot.scan.ranges)) return;
  cast_scan(world.map, world.rays, shapes, laser, world.robots[index].laser, robot.scan.ranges);
  if (memo != nullptr) memo->keep(index, laser, shapes, robot.scan.ranges);
}

void sense(const World& world, const State& state, std::size_t index, std::span<const Shape> shapes,
           RobotState& robot) {
  const RobotSpec& spec = world.robots[index];
  robot.scan.stamp = state.time;
  robot.scan_odometry = robot.odometry;
  const Pose2 laser = compose(robot.truth.pose, spec.laser.mount);
  const bool is_disturbed = spec.laser.noise_m > 0.0 || spec.laser.dropout > 0.0;
  if (!is_disturbed && !is_any_in_reach(shapes, laser, spec.laser)) {
    robot.uncast = laser;
    return;
  }
  robot.uncast.reset();
  cast(world, index, laser, shapes, robot);
  disturb_scan(spec.laser, robot.laser_rng, robot.scan.ranges);
}

void cast_if_not_yet(const World& world, std::size_t index, RobotState& robot) {
  if (!robot.uncast) return;
  cast(world, index, *robot.uncast, {}, robot);
  robot.uncast.reset();
}

// What follows from where the laser stood is said without a ray. Nobody is told where that was.
class SimulatedSight final : public Sight {
 public:
  SimulatedSight(const World& world, std::size_t index, RobotState& robot)
      : world_(world), index_(index), laser_(world.robots[index].laser), robot_(robot) {}

  const std::vector<double>& ranges() const override {
    cast_if_not_yet(world_, index_, robot_);
    return robot_.scan.ranges;
  }
  void ranges_of(std::span<const std::size_t> beams, std::span<double> ranges) const override {
    if (!robot_.uncast) return Sight::ranges_of(beams, ranges);
    cast_beams(world_.map, world_.rays, *robot_.uncast, laser_, beams, ranges);
  }
  const std::vector<double>& ranges_within(double range_m) const override {
    if (!robot_.uncast) return robot_.scan.ranges;
    LaserSpec near = laser_;
    const double needed_m = std::min(near.range_max_m, range_m + world_.map.resolution_m());
    ScanMemo* const memo = Present<ScanMemo>::present();
    if (memo != nullptr) {
      if (const auto* known = memo->recall_near(index_, *robot_.uncast, needed_m)) return *known;
    }
    // Whoever looks again before the next scan may be faster by then, and look further.
    constexpr double kFurther_m = 0.05;
    near.range_max_m = memo != nullptr ? std::min(near.range_max_m, needed_m + kFurther_m) : needed_m;
    cast_scan(world_.map, world_.rays, {}, *robot_.uncast, near, near_);
    return memo != nullptr ? memo->keep_near(index_, *robot_.uncast, near.range_max_m, std::move(near_)) : near_;
  }
  bool is_clear(double range_m) const override {
    return robot_.uncast && is_roomy(world_.map, world_.distance, robot_.uncast->position(), range_m);
  }
  bool shows_walls_only(const Pose2& laser_pose, double range_m, double margin_m) const override {
    if (!robot_.uncast) return false;
    // A return lies on the edge of a wall's cell: half a diagonal from its centre, and as far from that of the cell in
    // which it is put, but for the error of the pose.
    const double turned = std::abs(wrap_angle(laser_pose.theta - robot_.uncast->theta));
    const double off_m = distance(laser_pose.position(), robot_.uncast->position()) + range_m * turned;
    return off_m + std::numbers::sqrt2 * world_.map.resolution_m() + kRounding_m <= margin_m;
  }

 private:
  const World& world_;
  const std::size_t index_;
  const LaserSpec& laser_;
  RobotState& robot_;
  mutable std::vector<double> near_;
};

// The robot's own software. It is given nothing of the ground truth.
void think(const World& world, const State& state, std::size_t index, RobotState& robot, bool new_scan) {
  const RobotSpec& spec = world.robots[index];
  const SimulatedSight sight(world, index, robot);
  if (new_scan) {
    update_localization({world.map, spec.likelihood, spec.localization, spec.laser}, robot.localization, robot.odometry,
                        sight);
  }
  if (state.time >= robot.command.until) robot.command = {};
  if (robot.command != VelocityCommand{}) return;
  if (!is_active(robot.navigator.status)) return;
  const std::vector<Cell> announced =
      robot.navigator.path.empty() ? announced_cells(world, state) : std::vector<Cell>{};
  const NavigationModel model{world.map,   world.distance, spec.costs,   spec.navigation,
                              spec.limits, spec.laser,     spec.radius_m};
  robot.drive = step_navigation(model, robot.navigator,
                                {.now = state.time,
                                 .pose = estimated_pose(robot.localization, robot.odometry),
                                 .twist = robot.odometry_twist,
                                 .localized = robot.localization.status == LocalizationStatus::kLocalizedOk,
                                 .charging = is_charging(robot.battery),
                                 .sight = sight,
                                 .new_scan = new_scan,
                                 .moved_since_scan = relative(robot.scan_odometry, robot.odometry),
                                 .announced = announced});
}

// True if a whole period of `period` begins with this step.
bool is_due(TimePoint time, Duration step, Duration period) {
  const std::int64_t every = std::max<std::int64_t>(1, period / step);
  return (time.time_since_epoch() / step) % every == 0;
}

void step(const World& world, State& state) {
  constexpr Duration kControlPeriod = std::chrono::milliseconds(40);
  for (std::size_t i = 0; i < state.robots.size(); ++i) {
    const RobotSpec& spec = world.robots[i];
    RobotState& robot = state.robots[i];
    const bool scan_due = is_due(state.time, world.step, spec.laser.period);
    const bool control_due = is_due(state.time, world.step, kControlPeriod);
    const bool moves = robot.truth.twist != Twist2{} || robot.drive != Twist2{} || robot.command.twist != Twist2{};
    std::vector<Shape> shapes;
    if (scan_due || moves) shapes = shapes_around(world, state, i);
    if (scan_due) {
      sense(world, state, i, shapes, robot);
      update_exactly(spec.localization, robot.localization, robot.odometry, robot.truth.pose);
    }
    if (scan_due || control_due) think(world, state, i, robot, scan_due);
    if (!is_active(robot.navigator.status)) robot.drive = {};
    const bool commanded = robot.command != VelocityCommand{};
    robot.truth.twist =
        accelerate(spec.limits, robot.truth.twist, commanded ? robot.command.twist : robot.drive, world.step);
    move(world, spec, shapes, robot, world.step);
    charge(world, spec, robot, world.step, state.time + world.step);
  }
  state.time += world.step;
}

void go_on_for(const World& world, State& state, Duration duration) {
  SENTREE_ASSERT(state.robots.size() == world.robots.size());
  const TimePoint until = add_saturating(state.time, std::min(duration, kAdvanceMax));
  while (state.time + world.step <= until) step(world, state);
}

}  // namespace

State initial_state(const World& world, std::uint64_t seed) {
  State state;
  state.seed = seed;
  state.obstacles = world.obstacles;
  state.doors = world.doors;
  state.locations = world.locations;
  state.areas = world.areas;
  state.robots.resize(world.robots.size());
  for (std::size_t i = 0; i < world.robots.size(); ++i) {
    const RobotSpec& spec = world.robots[i];
    RobotState& robot = state.robots[i];
    robot.truth.pose = spec.start;
    robot.battery = initial_battery(spec.battery);
    robot.station = station_at(world, spec.start);
    robot.odometry_rng = Rng::of(seed, spec.name + ".odometry");
    robot.laser_rng = Rng::of(seed, spec.name + ".laser");
    robot.localization =
        initial_localization(spec.localization, {.pose = spec.start}, Rng::of(seed, spec.name + ".localization"));
  }
  for (std::size_t i = 0; i < world.robots.size(); ++i) {
    const std::vector<Shape> shapes = shapes_around(world, state, i);
    sense(world, state, i, shapes, state.robots[i]);
  }
  cast_scans(world, state);
  return state;
}

void cast_scans(const World& world, State& state) {
  for (std::size_t i = 0; i < state.robots.size(); ++i) cast_if_not_yet(world, i, state.robots[i]);
}

void advance_by(const World& world, State& state, Duration duration) {
  go_on_for(world, state, duration);
  cast_scans(world, state);
}

void follow(State& state, TimePoint now) {
  state.clock.run_anchor = now;
  state.clock.sim_anchor = state.time;
}

void advance(const World& world, State& state, TimePoint now) {
  advance_uncast(world, state, now);
  cast_scans(world, state);
}

void advance_uncast(const World& world, State& state, TimePoint now) {
  const TimeControl& clock = state.clock;
  if (clock.paused || clock.factor <= 0.0 || now <= clock.run_anchor) return;
  const Duration run = now - clock.run_anchor;
  const Duration simulated = clock.factor == 1.0 ? run : from_seconds(seconds(run) * clock.factor);
  const TimePoint target = add_saturating(clock.sim_anchor, simulated);
  if (target <= state.time) return;
  if (target - state.time > kAdvanceMax) {
    go_on_for(world, state, kAdvanceMax);
    follow(state, now);
    return;
  }
  go_on_for(world, state, target - state.time);
}

}  // namespace sentree::sim
