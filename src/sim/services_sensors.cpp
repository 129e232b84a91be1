// Battery, Laser, Localization and Base: what the robot measures, and its wheels.

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "sentree/sim/detail/service_handlers.h"

namespace sentree::sim {

namespace {

// --- Battery

Value battery_state(const Context& c) {
  const Battery& battery = c.robot().battery;
  const BatterySpec& spec = c.spec().battery;
  Value answer = std::move(c.former);
  Record record(answer, 8);
  put_header(record.entry("header"), c.state, "base_link");
  record.set("voltage", voltage_V(spec, battery));
  record.set("current", battery.current_A);
  record.set("percentage", battery.charge);
  record.set("temperature", battery.temperature_C);
  record.set("power_supply_status", to_value(status(battery)));
  record.set("warning", to_value(warning(spec, battery)));
  record.set("present", Value(true));
  return answer;
}

Value battery_charge(const Context& c) { return c.robot().battery.charge * 100.0; }

Value battery_is_charging(const Context& c) { return is_charging(c.robot().battery); }

Value battery_voltage(const Context& c) { return voltage_V(c.spec().battery, c.robot().battery); }
Value battery_current(const Context& c) { return c.robot().battery.current_A; }
Value battery_temperature(const Context& c) { return c.robot().battery.temperature_C; }

Value battery_status(const Context& c) {
  const RobotState& robot = c.robot();
  switch (warning(c.spec().battery, robot.battery)) {
    case BatteryWarning::kLow: return "LOW_WARNING";
    case BatteryWarning::kCritical: return "CRITICAL_WARNING";
    case BatteryWarning::kNone: break;
  }
  if (is_charging(robot.battery)) return "OK_IN_CHARGE";
  return robot.battery.full || robot.truth.twist == Twist2{} ? "OK_STANDBY" : "OK_IN_USE";
}

Value battery_info(const Context& c) {
  return fmt::format("simulated battery of {}, {} Ah", c.spec().name, shortest_decimal(c.spec().battery.capacity_Ah));
}

// --- Laser

Value laser_measurement(const Context& c) {
  const LaserSpec& spec = c.spec().laser;
  const Scan& scan = c.robot().scan;
  List ranges;
  ranges.reserve(scan.ranges.size());
  for (const double range : scan.ranges) ranges.emplace_back(range);
  return Map{{"header", Map{{"stamp", seconds(scan.stamp)}, {"frame_id", "laser"}}},
             {"angle_min", spec.angle_min_rad},
             {"angle_max", spec.angle_min_rad + spec.angle_increment_rad * (spec.beams - 1)},
             {"angle_increment", spec.angle_increment_rad},
             {"scan_time", seconds(spec.period)},
             {"range_min", spec.range_min_m},
             {"range_max", spec.range_max_m},
             {"ranges", std::move(ranges)}};
}

Value raw_data(const Context& c) {
  List ranges;
  for (const double range : c.robot().scan.ranges) ranges.emplace_back(range);
  return ranges;
}

Value interval(double min, double max) { return Map{{"min", min}, {"max", max}}; }

Value laser_status(const Context&) { return "OK_IN_USE"; }
Value distance_range(const Context& c) { return interval(c.spec().laser.range_min_m, c.spec().laser.range_max_m); }
Value scan_limits(const Context& c) {
  const LaserSpec& spec = c.spec().laser;
  return interval(spec.angle_min_rad, spec.angle_min_rad + spec.angle_increment_rad * (spec.beams - 1));
}
Value horizontal_resolution(const Context& c) { return c.spec().laser.angle_increment_rad; }
Value scan_rate(const Context& c) { return 1.0 / seconds(c.spec().laser.period); }
Value laser_info(const Context& c) {
  return fmt::format("simulated laser of {}, {} beams", c.spec().name, c.spec().laser.beams);
}

// --- Localization

Value localization_status(const Context& c) { return to_value(c.robot().localization.status); }

Value current_position(const Context& c) {
  const Localization& localization = c.robot().localization;
  List covariance;
  for (const double entry : localization.estimate.covariance) covariance.emplace_back(entry);
  return Map{{"header", header(c.state)},
             {"pose", to_value(estimated_pose(localization, c.robot().odometry))},
             {"covariance", std::move(covariance)}};
}

// A cloud of thousands is thinned to at most this many.
constexpr std::size_t kPosesShown = 500;

Value estimated_poses(const Context& c) {
  const std::vector<Particle>& particles = c.robot().localization.particles;
  List poses;
  const auto add = [&](const Pose2& pose) {
    poses.push_back(Map{{"header", header(c.state)}, {"pose", to_value(pose)}});
  };
  if (particles.empty()) add(estimated_pose(c.robot().localization, c.robot().odometry));
  const std::size_t stride = particles.size() / kPosesShown + 1;
  for (std::size_t i = 0; i < particles.size(); i += stride) add(particles[i].pose);
  return poses;
}

Value estimated_odometry(const Context& c) {
  return odometry(c.state, estimated_pose(c.robot().localization, c.robot().odometry), c.robot().odometry_twist, "map");
}

Value set_estimate(const Context& c) {
  const PoseEstimate estimate = c.args.estimate("pose");
  if (!c.args.problem().empty()) return {};
  set_initial_pose(c.spec().localization, c.robot().localization, estimate, c.robot().odometry);
  return return_code("OK");
}

Value reinitialize(const Context& c) {
  if (c.spec().localization.method == LocalizationSpec::Method::kOdometry) return return_code("NOT_IMPLEMENTED");
  reinitialize_globally(c.spec().localization, c.world.map, c.robot().localization, c.robot().odometry);
  return return_code("OK");
}

Value start_localization(const Context& c) {
  set_running(c.robot().localization, true);
  return return_code("OK");
}

Value stop_localization(const Context& c) {
  set_running(c.robot().localization, false);
  return return_code("OK");
}

// --- Base

Value apply_velocity(const Context& c) {
  double sideways = 0.0;
  const Twist2 twist = c.args.twist("cmd", &sideways);
  const double timeout_s = c.args.number("timeout");
  if (!c.args.problem().empty()) return {};
  const MotionLimits& limits = c.spec().limits;
  // The wheels turn and roll; they do not slide.
  if (sideways != 0.0) return return_code("NOT_IMPLEMENTED");
  if (std::abs(twist.vx) > limits.speed_m_s || std::abs(twist.omega) > limits.turn_rad_s || timeout_s < 0.0) {
    return return_code("OUT_OF_BOUNDS");
  }
  c.robot().command = {twist, add_saturating(c.state.time, from_seconds(timeout_s))};
  return return_code("OK");
}

Value last_velocity(const Context& c) {
  const RobotState& robot = c.robot();
  return to_value(robot.command != VelocityCommand{} ? robot.command.twist : robot.drive);
}

Value base_odometry(const Context& c) {
  return odometry(c.state, c.robot().odometry, c.robot().odometry_twist, "odom");
}

Value reset_odometry(const Context& c) {
  RobotState& robot = c.robot();
  // Everything that was noted in the odom frame moves with it.
  const auto moved = [&](const Pose2& pose) { return relative(robot.odometry, pose); };
  robot.localization.map_to_odom = compose(robot.localization.map_to_odom, robot.odometry);
  robot.localization.updated_at = moved(robot.localization.updated_at);
  robot.scan_odometry = moved(robot.scan_odometry);
  robot.odometry = {};
  return return_code("OK");
}

}  // namespace

std::span<const Method> battery_methods() {
  static constexpr std::array kMethods{
      Method{"getBatteryState", battery_state},     Method{"getBatteryCharge", battery_charge},
      Method{"isCharging", battery_is_charging},    Method{"getBatteryVoltage", battery_voltage},
      Method{"getBatteryCurrent", battery_current}, Method{"getBatteryTemperature", battery_temperature},
      Method{"getBatteryStatus", battery_status},   Method{"getBatteryInfo", battery_info}};
  return kMethods;
}

std::span<const Method> laser_methods() {
  static constexpr std::array kMethods{Method{"getLaserMeasurement", laser_measurement},
                                       Method{"getRawData", raw_data},
                                       Method{"getDeviceStatus", laser_status},
                                       Method{"getDistanceRange", distance_range},
                                       Method{"getScanLimits", scan_limits},
                                       Method{"getHorizontalResolution", horizontal_resolution},
                                       Method{"getScanRate", scan_rate},
                                       Method{"getDeviceInfo", laser_info}};
  return kMethods;
}

std::span<const Method> localization_methods() {
  static constexpr std::array kMethods{Method{"getLocalizationStatus", localization_status},
                                       Method{"getCurrentPosition", current_position},
                                       Method{"getEstimatedPoses", estimated_poses},
                                       Method{"getEstimatedOdometry", estimated_odometry},
                                       Method{"setInitialPose", set_estimate},
                                       Method{"reinitializeGlobalLocalization", reinitialize},
                                       Method{"startLocalizationService", start_localization},
                                       Method{"stopLocalizationService", stop_localization}};
  return kMethods;
}

std::span<const Method> base_methods() {
  static constexpr std::array kMethods{Method{"applyVelocityCommand", apply_velocity},
                                       Method{"getLastVelocityCommand", last_velocity},
                                       Method{"getOdometry", base_odometry}, Method{"resetOdometry", reset_odometry}};
  return kMethods;
}

}  // namespace sentree::sim
