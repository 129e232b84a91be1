#include "sentree/replay/detail/robot_topics.h"

#include "sentree/record/foxglove.h"
#include "sentree/record/schemas.h"
#include "sentree/sim/service_values.h"

namespace sentree::replay {

namespace {

constexpr std::chrono::seconds kPoseRepeat{1};
constexpr std::chrono::seconds kParticlesPeriod{1};
constexpr std::size_t kParticlesShown = 200;

record::Pose to_pose(const sim::Pose2& pose) { return {pose.x, pose.y, pose.theta}; }

std::vector<record::Pose> as_recorded(std::vector<record::Pose> poses) {
  for (record::Pose& pose : poses) pose = record::as_recorded(pose);
  return poses;
}

record::SceneThing thing_of(std::string id, const sim::Shape& shape, double height_m, std::uint32_t rgba) {
  const bool disc = shape.kind == sim::Shape::Kind::kDisc;
  return {.id = std::move(id),
          .text = {},
          .pose_map = to_pose(shape.pose),
          .disc = disc,
          .length_m = disc ? 2 * shape.radius_m : shape.length_m,
          .width_m = shape.width_m,
          .height_m = height_m,
          .rgba = rgba};
}

}  // namespace

RobotTopics::RobotTopics(record::Recorder& recorder, const sim::World& world) : recorder_(recorder), world_(world) {
  map_ = recorder.add_channel("/map", "foxglove.Grid", record::schemas::kGrid);
  scene_ = recorder.add_channel("/scene", "foxglove.SceneUpdate", record::schemas::kScene);
  for (const sim::RobotSpec& spec : world.robots) {
    const std::string base = "/" + spec.name;
    Robot& robot = robots_.emplace_back();
    robot.truth = recorder.add_channel(base + "/pose", "foxglove.PoseInFrame", record::schemas::kPose);
    robot.estimate = recorder.add_channel(base + "/pose_estimate", "foxglove.PoseInFrame", record::schemas::kPose);
    robot.scan = recorder.add_channel(base + "/scan", "foxglove.LaserScan", record::schemas::kScan);
    robot.path = recorder.add_channel(base + "/path", "foxglove.PosesInFrame", record::schemas::kPath);
    robot.battery = recorder.add_channel(base + "/battery", "sentree.Battery", record::schemas::kBattery);
    robot.motion = recorder.add_channel(base + "/motion", "sentree.Motion", record::schemas::kMotion);
    robot.particles = recorder.add_channel(base + "/particles", "foxglove.PosesInFrame", record::schemas::kPath);
  }
}

void RobotTopics::sample(const sim::State& state, TimePoint now) {
  if (!begun_) write_map(now);
  if (!begun_ || state.obstacles != obstacles_ || state.doors != doors_) write_scene(state, now);
  begun_ = true;
  for (std::size_t i = 0; i < robots_.size(); ++i) sample_robot(world_.robots[i], state.robots[i], robots_[i], now);
}

void RobotTopics::sample_robot(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot, TimePoint now) {
  const sim::Pose2 estimate = sim::estimated_pose(state.localization, state.odometry);
  const bool repeat = robot.posed == TimePoint::min() || now - robot.posed >= kPoseRepeat;
  if (repeat || !(state.truth.pose == robot.last_truth) || !(estimate == robot.last_estimate)) {
    const auto write_pose = [&](record::ChannelId channel, const sim::Pose2& pose, bool is_estimate) {
      recorder_.pack(
          channel, now, [&](record::PackedJson& out) { record::pack_pose(out, now, to_pose(pose)); },
          [&] {
            return record::PoseRecord{spec.name, is_estimate, record::as_recorded(to_pose(pose))};
          });
    };
    write_pose(robot.truth, state.truth.pose, false);
    write_pose(robot.estimate, estimate, true);
    robot.last_truth = state.truth.pose;
    robot.last_estimate = estimate;
    robot.posed = now;
  }
  if (!state.scan.ranges.empty() && state.scan.stamp != robot.scanned) {
    // Where the robot believes that the scan was taken.
    const sim::Pose2 laser =
        sim::compose(sim::estimated_pose(state.localization, state.scan_odometry), spec.laser.mount);
    recorder_.pack(
        robot.scan, now,
        [&](record::PackedJson& out) {
          record::pack_scan(out, now, to_pose(laser), spec.laser.angle_min_rad, spec.laser.angle_increment_rad,
                            state.scan.ranges);
        },
        [&] {
          record::ScanRecord made{spec.name, record::as_recorded(to_pose(laser)), {}};
          for (const double range : state.scan.ranges) made.ranges.push_back(record::range_as_recorded(range));
          return made;
        });
    robot.scanned = state.scan.stamp;
  }
  if (state.navigator.path != robot.last_path) {
    std::vector<record::Pose> poses;
    for (const sim::Vec2& point : state.navigator.path) poses.push_back({point.x, point.y, 0.0});
    recorder_.message(
        robot.path, now, [&](std::string& out) { record::append_path(out, now, poses); },
        [&] {
          return record::PathRecord{spec.name, as_recorded(poses)};
        });
    robot.last_path = state.navigator.path;
  }
  if (!(state.battery == robot.last_battery)) {
    const auto pack = [&](record::PackedJson& out) {
      out.raw(R"({"percent":)");
      out.number(state.battery.charge * 100);
      out.raw(R"(,"current_A":)");
      out.number(state.battery.current_A);
      out.raw(R"(,"charging":)");
      out.boolean(sim::is_charging(state.battery));
      out.raw(R"(,"voltage_V":)");
      out.rounded(sim::voltage_V(spec.battery, state.battery));
      out.raw(R"(,"plugged":)");
      out.boolean(state.battery.plugged);
      out.raw("}");
    };
    recorder_.pack(robot.battery, now, pack, [&] {
      return record::BatteryRecord{.robot = spec.name,
                                   .percent = state.battery.charge * 100,
                                   .current_A = state.battery.current_A,
                                   .charging = sim::is_charging(state.battery),
                                   .voltage_V = record::as_recorded(sim::voltage_V(spec.battery, state.battery)),
                                   .plugged = state.battery.plugged};
    });
    robot.last_battery = state.battery;
  }
  sample_motion(spec, state, robot, now);
  sample_particles(spec, state, robot, now);
}

void RobotTopics::sample_motion(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot, TimePoint now) {
  std::optional<sim::Pose2> goal;
  if (sim::is_active(state.navigator.status) && !state.navigator.goal.waypoints.empty())
    goal = state.navigator.goal.waypoints.back();
  Motion motion{state.odometry_twist, goal, state.navigator.status};
  if (robot.last_motion && *robot.last_motion == motion) return;
  const auto pack = [&](record::PackedJson& out) {
    out.raw(R"({"speed":)");
    out.rounded(motion.twist.vx);
    out.raw(R"(,"turn":)");
    out.rounded(motion.twist.omega);
    out.raw(R"(,"status":)");
    out.value(sim::to_value(motion.status));
    if (goal) {
      out.raw(R"(,"goal":[)");
      out.rounded(goal->x);
      out.raw(",");
      out.rounded(goal->y);
      out.raw(",");
      out.rounded(goal->theta);
      out.raw("]");
    }
    out.raw("}");
  };
  recorder_.pack(robot.motion, now, pack, [&] {
    record::MotionRecord made{spec.name, record::as_recorded(motion.twist.vx), record::as_recorded(motion.twist.omega),
                              std::string(sim::to_value(motion.status).text()), std::nullopt};
    if (goal)
      made.goal_map = {record::as_recorded(goal->x), record::as_recorded(goal->y), record::as_recorded(goal->theta)};
    return made;
  });
  robot.last_motion = motion;
}

// Some of them, after the filter has worked.
void RobotTopics::sample_particles(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot,
                                   TimePoint now) {
  const std::vector<sim::Particle>& particles = state.localization.particles;
  const bool again = robot.particles_at == TimePoint::min() || now - robot.particles_at >= kParticlesPeriod;
  if (particles.empty() || !again || (robot.filtered && *robot.filtered == state.localization.updated_at)) return;
  const std::size_t stride = (particles.size() + kParticlesShown - 1) / kParticlesShown;
  std::vector<record::Pose> poses;
  for (std::size_t i = 0; i < particles.size(); i += stride) poses.push_back(to_pose(particles[i].pose));
  recorder_.message(
      robot.particles, now, [&](std::string& out) { record::append_path(out, now, poses); },
      [&] {
        return record::ParticlesRecord{spec.name, as_recorded(poses)};
      });
  robot.particles_at = now;
  robot.filtered = state.localization.updated_at;
}

void RobotTopics::write_map(TimePoint now) {
  const sim::GridMap& map = world_.map;
  recorder_.message(map_, now, [&](std::string& out) {
    record::append_grid(out, now,
                        {.origin_map = to_pose(map.origin()),
                         .cell_m = map.resolution_m(),
                         .columns = static_cast<std::uint32_t>(map.width()),
                         .cells = map.cells()});
  });
}

void RobotTopics::write_scene(const sim::State& state, TimePoint now) {
  std::vector<record::SceneThing> things;
  for (const sim::Station& station : world_.stations) {
    things.push_back({.id = "station." + station.name,
                      .text = station.name,
                      .pose_map = to_pose(station.pose),
                      .length_m = 0.3,
                      .width_m = 0.3,
                      .height_m = 0.05,
                      .rgba = 0x2E9E5BFF});
  }
  for (const sim::NamedLocation& location : state.locations) {
    things.push_back({.id = "location." + location.name,
                      .text = location.name,
                      .pose_map = to_pose(location.pose),
                      .disc = true,
                      .length_m = 0.15,
                      .height_m = 0.02,
                      .rgba = 0x3C78D8FF});
  }
  for (const sim::Obstacle& obstacle : state.obstacles)
    things.push_back(thing_of("obstacle." + obstacle.id, obstacle.shape, 0.6, 0xB45F06FF));
  for (const sim::Door& door : state.doors) {
    if (!door.open)
      things.push_back(
          thing_of("door." + door.id, sim::Shape::wall(door.a, door.b, door.thickness_m), 1.0, 0x7F6000FF));
  }
  recorder_.message(
      scene_, now, [&](std::string& out) { record::append_scene(out, now, things); },
      [&] {
        for (record::SceneThing& thing : things) {
          thing.pose_map = record::as_recorded(thing.pose_map);
          thing.length_m = record::as_recorded(thing.length_m);
          thing.width_m = record::as_recorded(thing.disc ? thing.length_m : thing.width_m);
        }
        return record::SceneRecord{std::move(things)};
      });
  obstacles_ = state.obstacles;
  doors_ = state.doors;
}

}  // namespace sentree::replay
