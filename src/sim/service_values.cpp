#include "sentree/sim/service_values.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace sentree::sim {

Value return_code(std::string_view name) { return name; }

Value to_value(const Pose2& pose) { return record("x", pose.x, "y", pose.y, "theta", pose.theta); }
Value to_value(Vec2 point) { return Map{{"x", point.x}, {"y", point.y}}; }
Value to_value(const Twist2& twist) { return Map{{"vx", twist.vx}, {"vy", 0.0}, {"omega", twist.omega}}; }

Value to_value(NavigationStatus status) {
  switch (status) {
    case NavigationStatus::kIdle: return "IDLE";
    case NavigationStatus::kPreparingBeforeMove: return "PREPARING_BEFORE_MOVE";
    case NavigationStatus::kMoving: return "MOVING";
    case NavigationStatus::kWaitingObstacle: return "WAITING_OBSTACLE";
    case NavigationStatus::kGoalReached: return "GOAL_REACHED";
    case NavigationStatus::kAborted: return "ABORTED";
    case NavigationStatus::kFailing: return "FAILING";
    case NavigationStatus::kPaused: return "PAUSED";
    case NavigationStatus::kThinking: return "THINKING";
    case NavigationStatus::kError: return "ERROR";
  }
  return {};
}

Value to_value(NavigationError error) {
  switch (error) {
    case NavigationError::kNone: return "NONE";
    case NavigationError::kGoalRejected: return "GOAL_REJECTED";
    case NavigationError::kFailedToMakeProgress: return "FAILED_TO_MAKE_PROGRESS";
    case NavigationError::kNoValidControl: return "NO_VALID_CONTROL";
    case NavigationError::kCollisionAhead: return "COLLISION_AHEAD";
    case NavigationError::kDockNotInDb: return "DOCK_NOT_IN_DB";
    case NavigationError::kFailedToStage: return "FAILED_TO_STAGE";
    case NavigationError::kFailedToControl: return "FAILED_TO_CONTROL";
    case NavigationError::kFailedToCharge: return "FAILED_TO_CHARGE";
    case NavigationError::kStartOutsideMap: return "START_OUTSIDE_MAP";
    case NavigationError::kGoalOutsideMap: return "GOAL_OUTSIDE_MAP";
    case NavigationError::kStartOccupied: return "START_OCCUPIED";
    case NavigationError::kGoalOccupied: return "GOAL_OCCUPIED";
    case NavigationError::kPlanTimeout: return "PLAN_TIMEOUT";
    case NavigationError::kNoValidPath: return "NO_VALID_PATH";
    case NavigationError::kTfError: return "TF_ERROR";
    case NavigationError::kTimeout: return "TIMEOUT";
  }
  return {};
}

Value to_value(LocalizationStatus status) {
  switch (status) {
    case LocalizationStatus::kNotYetLocalized: return "NOT_YET_LOCALIZED";
    case LocalizationStatus::kLocalizedOk: return "LOCALIZED_OK";
    case LocalizationStatus::kError: return "ERROR";
  }
  return {};
}

Value to_value(PowerSupplyStatus status) {
  switch (status) {
    case PowerSupplyStatus::kUnknown: return "UNKNOWN";
    case PowerSupplyStatus::kCharging: return "CHARGING";
    case PowerSupplyStatus::kDischarging: return "DISCHARGING";
    case PowerSupplyStatus::kNotCharging: return "NOT_CHARGING";
    case PowerSupplyStatus::kFull: return "FULL";
  }
  return {};
}

Value to_value(BatteryWarning warning) {
  switch (warning) {
    case BatteryWarning::kNone: return "NONE";
    case BatteryWarning::kLow: return "LOW";
    case BatteryWarning::kCritical: return "CRITICAL";
  }
  return {};
}

void put_header(Value& out, const State& state, std::string_view frame) {
  Record record(out, 2);
  record.set("stamp", seconds(state.time));
  record.set("frame_id", frame);
}

void put_location(Value& out, const World& world, const Pose2& pose, std::string_view description) {
  Record record(out, 3);
  record.set("map_id", std::string_view(world.map_id));
  {
    Record place(record.entry("pose"), 3);
    place.set("x", pose.x);
    place.set("y", pose.y);
    place.set("theta", pose.theta);
  }
  record.set("description", description);
}

Value header(const State& state, std::string_view frame) {
  Value value;
  put_header(value, state, frame);
  return value;
}

Value location(const World& world, const Pose2& pose, std::string_view description) {
  Value value;
  put_location(value, world, pose, description);
  return value;
}

void Record::cut() {
  Map kept;
  for (std::size_t i = 0; i < next_; ++i) {
    auto& [name, value] = *(map_->begin() + static_cast<std::ptrdiff_t>(i));
    kept.append(std::move(name), std::move(value));
  }
  *map_ = std::move(kept);
}

Value area(const World& world, const NamedArea& area) {
  List points;
  for (const Vec2 point : area.points) points.push_back(to_value(point));
  return Map{{"map_id", world.map_id}, {"points", std::move(points)}, {"description", area.description}};
}

Value odometry(const State& state, const Pose2& pose, const Twist2& twist, std::string_view frame) {
  return Map{{"header", header(state, frame)},
             {"pose", to_value(pose)},
             {"twist", to_value(twist)},
             {"child_frame_id", "base_link"}};
}

Value occupancy_grid(const State& state, std::string_view code, std::string_view map_id, const GridMap& map) {
  Bytes data;
  data.octets.reserve(map.cells().size());
  for (const std::int8_t cell : map.cells()) data.octets.push_back(static_cast<std::byte>(cell));
  const Map info{{"map_id", map_id},
                 {"resolution", map.cells().empty() ? 0.0 : map.resolution_m()},
                 {"width", map.width()},
                 {"height", map.height()},
                 {"origin", to_value(map.origin())}};
  return Map{{"code", code}, {"grid", Map{{"header", header(state)}, {"info", info}, {"data", std::move(data)}}}};
}

void Arguments::wrong(const std::string& path, std::string_view expected, const Value* value) {
  if (!problem_.empty()) return;
  problem_ = value == nullptr ? path + " is missing" : fmt::format("{} is {}", path, to_json(*value).substr(0, 60));
  problem_ += fmt::format("; {} is expected", expected);
}

const Value* Arguments::argument(std::string_view name) { return args_.find(name); }

const Value* Arguments::member(const Value* of, std::string_view name, const std::string& path) {
  const Value* value = of != nullptr ? of->find(name) : nullptr;
  if (value == nullptr) wrong(fmt::format("{}.{}", path, name), "a value", nullptr);
  return value;
}

double Arguments::number(std::string_view name) {
  const Value* value = argument(name);
  if (value != nullptr && value->is_number() && std::isfinite(value->number())) return value->number();
  wrong(std::string(name), "a finite number", value);
  return 0.0;
}

double Arguments::number_in(const Value* of, std::string_view name, const std::string& path) {
  const Value* value = member(of, name, path);
  if (value != nullptr && value->is_number() && std::isfinite(value->number())) return value->number();
  wrong(fmt::format("{}.{}", path, name), "a finite number", value);
  return 0.0;
}

std::int64_t Arguments::integer(std::string_view name) {
  const Value* value = argument(name);
  if (value != nullptr && value->as_int() != nullptr) return *value->as_int();
  // A script's numbers are doubles.
  constexpr double kWholeMax = 9007199254740992.0;
  if (value != nullptr && value->as_double() != nullptr && std::abs(value->number()) <= kWholeMax &&
      std::floor(value->number()) == value->number()) {
    return static_cast<std::int64_t>(value->number());
  }
  wrong(std::string(name), "a whole number", value);
  return 0;
}

bool Arguments::boolean(std::string_view name) {
  const Value* value = argument(name);
  if (value != nullptr && value->as_bool() != nullptr) return *value->as_bool();
  wrong(std::string(name), "true or false", value);
  return false;
}

std::string Arguments::text(std::string_view name) {
  const Value* value = argument(name);
  if (value != nullptr && value->as_string() != nullptr) return *value->as_string();
  wrong(std::string(name), "a string", value);
  return {};
}

Pose2 Arguments::pose_in(const Value* value, const std::string& path) {
  Pose2 pose{number_in(value, "x", path), number_in(value, "y", path), number_in(value, "theta", path)};
  // Coordinates beyond any map, and angles that have lost their precision, are slips.
  constexpr double kMax = 1e6;
  if (std::abs(pose.x) > kMax || std::abs(pose.y) > kMax || std::abs(pose.theta) > kMax) {
    wrong(path, "a pose within a million metres", value);
    return {};
  }
  pose.theta = wrap_angle(pose.theta);
  return pose;
}

Pose2 Arguments::pose(std::string_view name) { return pose_in(argument(name), std::string(name)); }

Vec2 Arguments::point(std::string_view name) {
  const Value* value = argument(name);
  return {number_in(value, "x", std::string(name)), number_in(value, "y", std::string(name))};
}

Twist2 Arguments::twist(std::string_view name, double* sideways) {
  const Value* value = argument(name);
  *sideways = value != nullptr && value->find("vy") != nullptr ? number_in(value, "vy", std::string(name)) : 0.0;
  return {number_in(value, "vx", std::string(name)), number_in(value, "omega", std::string(name))};
}

Pose2 Arguments::location(std::string_view name, std::string& map_id, std::string& description) {
  const std::string path(name);
  const Value* value = argument(name);
  const Value* map = value != nullptr ? value->find("map_id") : nullptr;
  if (map != nullptr) map_id = map->text();
  const Value* said = value != nullptr ? value->find("description") : nullptr;
  if (said != nullptr) description = said->text();
  return pose_in(member(value, "pose", path), path + ".pose");
}

std::vector<Vec2> Arguments::area(std::string_view name, std::string& map_id, std::string& description) {
  const std::string path(name);
  const Value* value = argument(name);
  const Value* map = value != nullptr ? value->find("map_id") : nullptr;
  if (map != nullptr) map_id = map->text();
  const Value* said = value != nullptr ? value->find("description") : nullptr;
  if (said != nullptr) description = said->text();
  const Value* points = member(value, "points", path);
  std::vector<Vec2> corners;
  constexpr std::size_t kCornersMax = 1000;
  if (points == nullptr || points->as_list() == nullptr || points->as_list()->size() > kCornersMax) {
    wrong(path + ".points", fmt::format("a list of at most {} points", kCornersMax), points);
    return corners;
  }
  for (const Value& point : *points->as_list()) {
    corners.push_back({number_in(&point, "x", path + ".points"), number_in(&point, "y", path + ".points")});
  }
  return corners;
}

std::vector<Pose2> Arguments::path(std::string_view name) {
  const std::string path(name);
  const Value* poses = member(argument(name), "poses", path);
  std::vector<Pose2> found;
  if (poses == nullptr || poses->as_list() == nullptr || poses->as_list()->size() > kWaypointsMax) {
    wrong(path + ".poses", fmt::format("a list of at most {} poses", kWaypointsMax), poses);
    return found;
  }
  for (const Value& pose : *poses->as_list()) found.push_back(pose_in(&pose, path + ".poses"));
  return found;
}

std::array<double, 6> Arguments::object(std::string_view name, std::string& map_id, std::string& description) {
  const std::string path(name);
  const Value* value = argument(name);
  const Value* map = value != nullptr ? value->find("map_id") : nullptr;
  if (map != nullptr) map_id = map->text();
  const Value* said = value != nullptr ? value->find("description") : nullptr;
  if (said != nullptr) description = said->text();
  std::array<double, 6> pose{number_in(value, "x", path), number_in(value, "y", path)};
  constexpr std::array<std::string_view, 4> kOptional{"z", "roll", "pitch", "yaw"};
  for (std::size_t i = 0; i < kOptional.size(); ++i) {
    if (value != nullptr && value->find(kOptional[i]) != nullptr) pose[i + 2] = number_in(value, kOptional[i], path);
  }
  return pose;
}

std::size_t Arguments::choice(std::string_view name, std::span<const std::string_view> names) {
  const Value* value = argument(name);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (value == nullptr) break;
    if (value->text() == names[i] && value->as_string() != nullptr) return i;
    if (value->as_int() != nullptr && *value->as_int() == static_cast<std::int64_t>(i)) return i;
  }
  std::string list;
  for (const std::string_view each : names) list += (list.empty() ? "" : " or ") + std::string(each);
  wrong(std::string(name), list, value);
  return 0;
}

PoseEstimate Arguments::estimate(std::string_view name) {
  const std::string path(name);
  const Value* value = argument(name);
  PoseEstimate estimate{.pose = pose_in(member(value, "pose", path), path + ".pose")};
  const Value* covariance = value != nullptr ? value->find("covariance") : nullptr;
  if (covariance == nullptr || (covariance->as_list() != nullptr && covariance->as_list()->empty())) return estimate;
  if (covariance->as_list() == nullptr || covariance->as_list()->size() != estimate.covariance.size()) {
    wrong(path + ".covariance", "a list of 9 numbers, or an empty one", covariance);
    return estimate;
  }
  for (std::size_t i = 0; i < estimate.covariance.size(); ++i) {
    const Value& entry = (*covariance->as_list())[i];
    // Along the diagonal are variances.
    if (!entry.is_number() || !(std::abs(entry.number()) <= 1e6) || (i % 4 == 0 && entry.number() < 0.0)) {
      wrong(path + ".covariance", "finite numbers, not negative on the diagonal", covariance);
    }
    estimate.covariance[i] = entry.number();
  }
  return estimate;
}

}  // namespace sentree::sim
