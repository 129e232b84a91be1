#include "sentree/sim/navigator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sentree/base/value.h"
#include "sentree/sim/detail/clearance.h"
#include "sentree/sim/detail/obstacle_layer.h"
#include "sentree/sim/detail/path.h"
#include "sentree/sim/detail/route.h"

namespace sentree::sim {

namespace {

constexpr double kPassWaypoint_m = 0.25;  // an intermediate waypoint counts as visited
constexpr double kProgress_m = 0.10;
constexpr double kTurnInPlace_rad = 0.50;  // heading errors from here on are turned away standing
constexpr double kTurnGain = 2.5;          // 1/s
constexpr double kBodyMargin_m = 0.02;     // kept from what the laser sees and the map shows, beyond the radius
constexpr double kPathMargin_m = 0.02;
constexpr Duration kRetry = std::chrono::milliseconds(500);
constexpr Duration kBackUp = std::chrono::milliseconds(1500);
constexpr double kBackUp_m_s = -0.10;
constexpr Duration kRecoveryWait = std::chrono::seconds(5);
constexpr double kRecoverySpin_rad = 1.57;
// A robot that does not know where it is turns and looks around for as long.
constexpr Duration kLocalizing = std::chrono::seconds(60);
constexpr Duration kChargeWait = std::chrono::seconds(30);
constexpr double kMotionDone_m = 0.01;
constexpr double kMotionDone_rad = 0.02;

void end(Navigator& state, NavigationStatus status, NavigationError error, std::string message, TimePoint now) {
  state.status = status;
  state.error = error;
  state.error_message = std::move(message);
  state.ended = now;
  state.path.clear();
  state.passed = 0;
}

void abort(Navigator& state, NavigationError error, std::string message, TimePoint now) {
  // The way to a dock is docking's first stage.
  if (state.goal.kind == GoalKind::kDock && error != NavigationError::kFailedToCharge &&
      error != NavigationError::kTimeout) {
    message = "the dock was not reached: " + message;
    error = NavigationError::kFailedToStage;
  }
  end(state, NavigationStatus::kAborted, error, std::move(message), now);
}

void think(Navigator& state) {
  state.status = NavigationStatus::kThinking;
  state.path.clear();
  state.passed = 0;
}

void note_progress(Navigator& state, TimePoint now) {
  state.best_remaining_m = state.distance_remaining_m;
  state.progress_at = now;
}

// Gives up after the last recovery; else forgets what was seen and plans anew: at once, having turned, having waited,
// having backed up, and so on.
void recover(const NavigationModel& model, Navigator& state, NavigationError error, std::string message,
             TimePoint now) {
  if (state.recoveries >= model.spec.recoveries_max) {
    abort(state, error, std::move(message), now);
    return;
  }
  ++state.recoveries;
  state.seen.clear();
  think(state);
  Duration lasts{};
  state.recovery = {};
  switch (state.recoveries % 4) {
    case 2:
      state.recovery.omega = std::min(0.5, model.limits.turn_rad_s);
      lasts = from_seconds(kRecoverySpin_rad / state.recovery.omega);
      break;
    case 3: lasts = kRecoveryWait; break;
    case 0:
      state.recovery.vx = kBackUp_m_s;
      lasts = kBackUp;
      break;
    default: break;
  }
  if (lasts > Duration{}) state.status = NavigationStatus::kWaitingObstacle;
  state.recovering_until = now + lasts;
  state.retry_at = state.recovering_until;
  state.progress_at = state.recovering_until;
}

void plan(const NavigationModel& model, Navigator& state, const NavigationInput& input) {
  const Vec2 target = state.goal.waypoints[state.waypoint].position();
  Route route = find_route({model.map, model.distance, model.costs, model.spec.plan_expansions_max, model.radius_m},
                           input.pose.position(), target, input.announced, state.seen);
  if (route.error == NavigationError::kNone) {
    state.path = std::move(route.points);
    state.passed = 0;
    const PathPlace place = place_on_path(state.path, 0, input.pose.position(), 0.0);
    state.distance_remaining_m = place.remaining_m;
    // A detour is longer than what was left before; progress is measured anew.
    state.best_remaining_m = place.remaining_m;
    state.status = NavigationStatus::kMoving;
    return;
  }
  if (!route.blocked_by_seen) {
    abort(state, route.error, std::move(route.message), input.now);
    return;
  }
  // What the laser saw may go away.
  state.path.clear();
  state.status = NavigationStatus::kWaitingObstacle;
  state.retry_at = input.now + kRetry;
  if (input.now - state.progress_at > model.spec.patience) {
    recover(model, state, route.error, std::move(route.message), input.now);
  }
}

bool crosses_path(const NavigationModel& model, const Navigator& state, std::span<const Cell> cells) {
  const double near_m = model.radius_m + kPathMargin_m + model.map.resolution_m() / 2;
  for (const Cell c : cells) {
    const Vec2 centre = model.map.centre(c);
    for (std::size_t i = state.passed; i + 1 < state.path.size(); ++i) {
      if (distance_to_segment(state.path[i], state.path[i + 1], centre) < near_m) return true;
    }
  }
  return false;
}

// The returns of the latest scan from within `reach`, in base_link now.
std::vector<Vec2> returns_nearby(const NavigationModel& model, const NavigationInput& input, double reach) {
  std::vector<Vec2> points;
  const std::vector<double>& ranges = input.sight.ranges_within(reach);
  const std::span<const Vec2> beams = beam_directions(model.laser, ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double range = ranges[i];
    if (!(range > 0.0 && range <= reach)) continue;
    const Vec2 at_scan = transform(model.laser.mount, {range * beams[i].x, range * beams[i].y});
    points.push_back(inverse_transform(input.moved_since_scan, at_scan));
  }
  return points;
}

// Follows the command for a moment and then brakes, and keeps clear of the map's walls and of everything the laser
// sees. What is already too near may be left, not approached.
bool is_safe(const NavigationModel& model, const NavigationInput& input, const Twist2& command) {
  constexpr Duration kStep = std::chrono::milliseconds(50);
  constexpr int kStepsOfCommand = 3;
  const double speed = std::max(std::abs(command.vx), std::abs(input.twist.vx));
  if (speed == 0.0) return true;
  // Further than it gets before it stands.
  const double reach_m = speed * 0.2 + speed * speed / model.limits.acceleration_m_s2;
  const double needed_m = model.radius_m + kBodyMargin_m;
  const double seen_m = needed_m + reach_m + norm(model.laser.mount.position());
  const bool is_clear = input.sight.is_clear(seen_m);
  if (is_clear && is_roomy(model.map, model.distance, input.pose.position(), needed_m + reach_m)) return true;
  const std::vector<Vec2> returns = is_clear ? std::vector<Vec2>() : returns_nearby(model, input, seen_m);
  const auto room = [&](const Pose2& in_base) {
    double room_m = clearance(model.map, model.distance, transform(input.pose, in_base.position()), needed_m);
    for (const Vec2 point : returns) room_m = std::min(room_m, distance(in_base.position(), point));
    return room_m;
  };
  double nearest_m = room({});
  Twist2 twist = input.twist;
  Pose2 at;
  constexpr int kStepsMax = 100;
  for (int i = 0; i < kStepsMax && (i < kStepsOfCommand || twist.vx != 0.0); ++i) {
    twist = accelerate(model.limits, twist, i < kStepsOfCommand ? command : Twist2{0.0, command.omega}, kStep);
    at = compose(at, arc(twist, kStep));
    const double room_m = room(at);
    if (room_m < needed_m && room_m < nearest_m) return false;
    nearest_m = std::min(nearest_m, room_m);
  }
  return true;
}

Twist2 turn_towards(const NavigationModel& model, double error_rad) {
  const double omega = std::clamp(kTurnGain * error_rad, -model.limits.turn_rad_s, model.limits.turn_rad_s);
  return {0.0, omega};
}

Twist2 safely(const NavigationModel& model, Navigator& state, const NavigationInput& input, Twist2 command) {
  if (is_safe(model, input, command)) {
    if (state.status == NavigationStatus::kWaitingObstacle) state.status = NavigationStatus::kMoving;
    return command;
  }
  const Twist2 slow{command.vx * 0.3, command.omega};
  if (is_safe(model, input, slow)) return slow;
  state.status = NavigationStatus::kWaitingObstacle;
  return {0.0, command.omega};
}

// The furthest point within the look-ahead to which the way is straight and free.
Vec2 carrot(const NavigationModel& model, const Navigator& state, const NavigationInput& input,
            const PathPlace& place) {
  const Vec2 here = input.pose.position();
  for (double ahead = model.spec.lookahead_m; ahead > 0.1; ahead /= 2) {
    const Vec2 point = point_ahead(state.path, place, ahead);
    if (segment_cost(model.costs, model.map, here, point) >= 0.0) return point;
  }
  return point_ahead(state.path, place, 0.1);
}

Twist2 finish(const NavigationModel& model, Navigator& state, const NavigationInput& input, double off_m) {
  const double error = wrap_angle(state.goal.waypoints.back().theta - input.pose.theta);
  const bool standing = std::abs(input.twist.vx) < 0.02;
  if (std::abs(error) <= model.spec.goal_angular_tolerance_rad * 0.8 && standing &&
      off_m <= model.spec.goal_linear_tolerance_m) {
    state.distance_remaining_m = off_m;
    if (state.goal.kind != GoalKind::kDock || input.charging) {
      end(state, NavigationStatus::kGoalReached, NavigationError::kNone, {}, input.now);
      return {};
    }
    if (state.waiting_since == TimePoint{}) state.waiting_since = input.now;
    state.progress_at = input.now;
    if (input.now - state.waiting_since > kChargeWait)
      abort(state, NavigationError::kFailedToCharge, "the battery did not begin to charge at the dock", input.now);
    return {};
  }
  return turn_towards(model, error);
}

Twist2 follow(const NavigationModel& model, Navigator& state, const NavigationInput& input) {
  const Vec2 here = input.pose.position();
  const PathPlace place = place_on_path(state.path, state.passed, here, 2 * model.spec.lookahead_m);
  state.passed = place.segment;
  state.distance_remaining_m = place.remaining_m + distance(here, place.nearest);
  if (state.distance_remaining_m < state.best_remaining_m - kProgress_m) note_progress(state, input.now);

  const bool last = state.waypoint + 1 == state.goal.waypoints.size();
  const double off_m = distance(here, state.path.back());
  if (!last && off_m < kPassWaypoint_m) {
    ++state.waypoint;
    state.progress_at = input.now;
    think(state);
    return {};
  }
  if (last) {
    const bool was_turning = state.turning;
    state.turning = off_m <= model.spec.goal_linear_tolerance_m * (was_turning ? 1.0 : 0.5);
    if (state.turning && !was_turning) state.progress_at = input.now;
    if (state.turning) return finish(model, state, input, off_m);
  }

  const Vec2 ahead = carrot(model, state, input, place);
  const Vec2 offset = ahead - here;
  const double error = wrap_angle(std::atan2(offset.y, offset.x) - input.pose.theta);
  if (std::abs(error) > kTurnInPlace_rad) return turn_towards(model, error);
  // Half the deceleration, so that the end is met without overshoot.
  const double braking = std::sqrt(model.limits.acceleration_m_s2 * (last ? off_m : off_m + 0.2));
  const double speed = std::min(model.limits.speed_m_s * (1.0 - std::abs(error) / kTurnInPlace_rad), braking);
  return safely(model, state, input, {std::max(speed, 0.02), turn_towards(model, error).omega});
}

// Turns slowly until the localization knows the place, for a bounded time.
Twist2 find_place(const NavigationModel& model, Navigator& state, const NavigationInput& input) {
  if (state.status != NavigationStatus::kPreparingBeforeMove) {
    state.status = NavigationStatus::kPreparingBeforeMove;
    state.progress_at = input.now;
  }
  if (input.now - state.progress_at > kLocalizing) {
    end(state, NavigationStatus::kError, NavigationError::kTfError, "the localization does not know where the robot is",
        input.now);
    return {};
  }
  return {0.0, std::min(0.5, model.limits.turn_rad_s)};
}

// A straight drive or a spin.
Twist2 move(const NavigationModel& model, Navigator& state, const NavigationInput& input) {
  const Pose2 moved = relative(state.last_pose, input.pose);
  state.last_pose = input.pose;
  const bool spins = state.goal.kind == GoalKind::kSpin;
  state.done += spins ? moved.theta : moved.x;
  const double left = state.goal.amount - state.done;
  state.distance_remaining_m = spins ? 0.0 : std::abs(left);
  state.status = NavigationStatus::kMoving;
  const bool past = left * state.goal.amount <= 0.0;
  if (past || std::abs(left) <= (spins ? kMotionDone_rad : kMotionDone_m)) {
    end(state, NavigationStatus::kGoalReached, NavigationError::kNone, {}, input.now);
    return {};
  }
  if (spins) return turn_towards(model, left);
  double speed_max = model.limits.speed_m_s;
  if (state.goal.speed_m_s > 0.0) speed_max = std::min(speed_max, state.goal.speed_m_s);
  const double speed = std::min(speed_max, std::sqrt(model.limits.acceleration_m_s2 * std::abs(left)));
  const Twist2 command{std::copysign(std::max(speed, std::min(speed_max, 0.02)), left), 0.0};
  const Twist2 slow{command.vx * 0.3, 0.0};
  for (const Twist2& try_it : {command, slow}) {
    if (!is_safe(model, input, try_it)) continue;
    state.progress_at = input.now;
    return try_it;
  }
  state.status = NavigationStatus::kWaitingObstacle;
  if (input.now - state.progress_at > model.spec.patience) {
    const bool undocks = state.goal.kind == GoalKind::kUndock;
    abort(state, undocks ? NavigationError::kFailedToControl : NavigationError::kCollisionAhead,
          "something is in the way of the robot's straight drive", input.now);
  }
  return {};
}

}  // namespace

bool is_active(NavigationStatus status) {
  switch (status) {
    case NavigationStatus::kPreparingBeforeMove:
    case NavigationStatus::kMoving:
    case NavigationStatus::kWaitingObstacle:
    case NavigationStatus::kPaused:
    case NavigationStatus::kThinking: return true;
    case NavigationStatus::kIdle:
    case NavigationStatus::kGoalReached:
    case NavigationStatus::kAborted:
    case NavigationStatus::kFailing:
    case NavigationStatus::kError: return false;
  }
  return false;
}

std::int64_t start_goal(const NavigationSpec& spec, Navigator& state, std::string name, std::vector<Pose2> waypoints,
                        TimePoint now, GoalKind kind) {
  Navigator fresh;
  fresh.status = NavigationStatus::kThinking;
  fresh.goals = state.goals + 1;
  fresh.goal = {.id = fresh.goals, .kind = kind, .name = std::move(name), .waypoints = std::move(waypoints)};
  fresh.started = fresh.ended = fresh.progress_at = fresh.retry_at = now;
  fresh.deadline = add_saturating(now, spec.goal_time_max);
  fresh.seen = std::move(state.seen);
  state = std::move(fresh);
  return state.goal.id;
}

std::int64_t start_motion(const NavigationSpec& spec, Navigator& state, GoalKind kind, double amount, const Pose2& from,
                          TimePoint now) {
  start_goal(spec, state, {}, {}, now, kind);
  state.goal.amount = amount;
  state.last_pose = from;
  return state.goal.id;
}

bool stop_goal(Navigator& state, std::int64_t goal_id, TimePoint now) {
  if (!is_active(state.status) || (goal_id != 0 && goal_id != state.goal.id)) return false;
  end(state, NavigationStatus::kIdle, NavigationError::kNone, {}, now);
  return true;
}

bool suspend(Navigator& state, TimePoint now, TimePoint until) {
  if (!is_active(state.status)) return false;
  if (state.status != NavigationStatus::kPaused) state.paused_at = now;
  state.status = NavigationStatus::kPaused;
  state.resume_at = until;
  return true;
}

bool resume(Navigator& state, TimePoint now) {
  if (state.status != NavigationStatus::kPaused) return false;
  state.deadline = add_saturating(state.deadline, now - state.paused_at);
  state.progress_at = now;
  state.retry_at = now;
  think(state);
  return true;
}

bool replan(Navigator& state, TimePoint now) {
  if (state.goal.waypoints.empty()) return false;
  if (!is_active(state.status) || state.status == NavigationStatus::kPaused) return false;
  state.retry_at = now;
  think(state);
  return true;
}

Twist2 step_navigation(const NavigationModel& model, Navigator& state, const NavigationInput& input) {
  if (!is_active(state.status)) return {};
  if (state.status == NavigationStatus::kPaused && input.now >= state.resume_at) resume(state, input.now);
  if (input.new_scan) {
    const Pose2 base_at_scan = compose(input.pose, relative(input.moved_since_scan, {}));
    const std::vector<Cell> added = update_obstacles(model.map, model.distance, model.costs, model.laser,
                                                     compose(base_at_scan, model.laser.mount), input.sight, state.seen);
    if (!state.path.empty() && crosses_path(model, state, added)) {
      think(state);
      state.retry_at = input.now;
    }
  }
  if (state.status == NavigationStatus::kPaused) return {};
  if (input.now > state.deadline) {
    abort(state, NavigationError::kTimeout,
          fmt::format("the goal was not reached within {} s", shortest_decimal(seconds(model.spec.goal_time_max))),
          input.now);
    return {};
  }
  if (input.now < state.recovering_until) {
    return is_safe(model, input, state.recovery) ? state.recovery : Twist2{};
  }
  if (state.goal.waypoints.empty()) return move(model, state, input);
  if (state.path.empty() && !input.localized) return find_place(model, state, input);
  if (state.path.empty() && input.now >= state.retry_at) plan(model, state, input);
  if (state.path.empty() || !is_active(state.status)) return {};
  const Twist2 command = follow(model, state, input);
  const Duration patience = model.spec.patience + from_seconds(2.0 * std::numbers::pi / model.limits.turn_rad_s);
  if (is_active(state.status) && input.now - state.progress_at > patience) {
    if (state.status == NavigationStatus::kWaitingObstacle)
      recover(model, state, NavigationError::kNoValidControl, "every way to go on would touch something", input.now);
    else
      recover(model, state, NavigationError::kFailedToMakeProgress, "the robot could not get on along its path",
              input.now);
    return {};
  }
  return command;
}

}  // namespace sentree::sim
