#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/sim/base.h"
#include "sentree/sim/cost_grid.h"
#include "sentree/sim/laser.h"
#include "sentree/sim/sight.h"

namespace sentree::sim {

/// YARP's ten.
enum class NavigationStatus {
  kIdle = 0,
  kPreparingBeforeMove = 1,
  kMoving = 2,
  kWaitingObstacle = 3,
  kGoalReached = 4,
  kAborted = 5,
  kFailing = 6,
  kPaused = 7,
  kThinking = 8,
  kError = 9,
};

/// Nav2's numbers.
enum class NavigationError {
  kNone = 0,
  kGoalRejected = 1,
  kFailedToMakeProgress = 105,
  kNoValidControl = 106,
  kStartOutsideMap = 203,
  kGoalOutsideMap = 204,
  kStartOccupied = 205,
  kGoalOccupied = 206,
  kPlanTimeout = 207,
  kNoValidPath = 208,
  kCollisionAhead = 714,
  kDockNotInDb = 901,
  kFailedToStage = 903,
  kFailedToControl = 905,
  kFailedToCharge = 906,
  kTfError = 9002,
  kTimeout = 9003,
};

/// How a robot pursues its goals; durations are of simulated time.
struct NavigationSpec {
  double margin_m = 0.06;  ///< Kept from walls beyond the robot's radius, when planning.
  double fade_m = 0.5;     ///< Beyond that, nearness to a wall costs something over this distance.
  double goal_linear_tolerance_m = 0.10;
  double goal_angular_tolerance_rad = 0.05;
  double lookahead_m = 0.45;
  std::uint64_t plan_expansions_max = 2'000'000;  ///< Of one search; more ends the goal with PLAN_TIMEOUT.
  Duration patience = std::chrono::seconds(8);    ///< Without progress before a recovery.
  int recoveries_max = 4;
  Duration goal_time_max = std::chrono::seconds(900);

  [[nodiscard]] InflationSpec inflation(double radius_m) const {
    return {.blocked_m = radius_m + margin_m, .inflated_m = radius_m + margin_m + fade_m};
  }
  friend bool operator==(const NavigationSpec&, const NavigationSpec&) = default;
};

/// Waypoints that one goal may have.
inline constexpr std::size_t kWaypointsMax = 1000;

enum class GoalKind {
  kGo,      ///< To the waypoints.
  kDock,    ///< The same, then wait there until the battery charges.
  kUndock,  ///< Straight back, by `amount` metres (< 0).
  kDrive,   ///< Straight ahead by `amount` metres, back if negative.
  kSpin,    ///< Turn on the spot by `amount` radians.
};

struct Goal {
  std::int64_t id = 0;  ///< From 1; 0 before the first goal.
  GoalKind kind = GoalKind::kGo;
  double amount = 0.0;
  double speed_m_s = 0.0;        ///< Of a straight drive, at most; 0: the robot's own.
  std::string name;              ///< Location or area; empty for a goal by pose.
  std::vector<Pose2> waypoints;  ///< In the map frame; the last one is the target.

  friend bool operator==(const Goal&, const Goal&) = default;
};

/// The goal that runs or ran last, and how far it got. Status and error of a goal stay until the next one.
struct Navigator {
  NavigationStatus status = NavigationStatus::kIdle;
  NavigationError error = NavigationError::kNone;
  std::string error_message;
  Goal goal;
  std::int64_t goals = 0;    ///< Ids given so far.
  std::size_t waypoint = 0;  ///< The one under way.
  TimePoint started{};
  TimePoint ended{};
  std::vector<Vec2> path;  ///< Corners from where it was planned to the waypoint.
  std::size_t passed = 0;  ///< Path segments behind the robot.
  double distance_remaining_m = 0.0;
  bool turning = false;  ///< At the target, turning to its heading.
  TimePoint paused_at{};
  TimePoint resume_at = kNever;
  TimePoint deadline = kNever;    ///< `NavigationSpec::goal_time_max` after the start, pauses not counted.
  double best_remaining_m = 0.0;  ///< Smallest distance so far; progress is what lowers it.
  TimePoint progress_at{};
  TimePoint recovering_until{};
  Twist2 recovery;            ///< Velocity until then.
  TimePoint waiting_since{};  ///< For the battery to charge, at a dock; 0: not yet.
  Pose2 last_pose;            ///< Of a straight drive or a spin, at the step before.
  double done = 0.0;          ///< Of its amount.
  TimePoint retry_at{};
  int recoveries = 0;
  std::vector<std::uint32_t>
      seen;  ///< Cells (CostGrid slots, ascending) of obstacles that the laser saw and the map does not hold.

  friend bool operator==(const Navigator&, const Navigator&) = default;
};

/// What a navigator knows about robot and world; borrowed for the call.
struct NavigationModel {
  const GridMap& map;
  const DistanceField& distance;
  const CostGrid& costs;
  const NavigationSpec& spec;
  const MotionLimits& limits;
  const LaserSpec& laser;
  double radius_m;
};

/// What it senses now.
struct NavigationInput {
  TimePoint now{};
  Pose2 pose;             ///< As localization believes.
  Twist2 twist;           ///< As odometry says.
  bool localized = true;  ///< The localization claims to know the pose.
  bool charging = false;  ///< The battery says so.
  const Sight& sight;     ///< The latest scan.
  bool new_scan = false;
  Pose2 moved_since_scan;           ///< base_link now in base_link at the time of the scan, by odometry.
  std::span<const Cell> announced;  ///< Occupied cells that the robot was told of beyond its map.
};

[[nodiscard]] bool is_active(NavigationStatus status);

/// Starts a goal in place of whatever runs; it is planned at the next step. Returns its id.
std::int64_t start_goal(const NavigationSpec& spec, Navigator& state, std::string name, std::vector<Pose2> waypoints,
                        TimePoint now, GoalKind kind = GoalKind::kGo);

/// The same for a drive, a spin or undocking, without a waypoint.
std::int64_t start_motion(const NavigationSpec& spec, Navigator& state, GoalKind kind, double amount, const Pose2& from,
                          TimePoint now);

/// Ends the active goal of that id (0: whichever) with status IDLE. False, and no effect, for any other id.
bool stop_goal(Navigator& state, std::int64_t goal_id, TimePoint now);

/// True if there was something to suspend; `until` may be kNever.
bool suspend(Navigator& state, TimePoint now, TimePoint until);
bool resume(Navigator& state, TimePoint now);
/// Plans the active goal anew. False if none is on its way.
bool replan(Navigator& state, TimePoint now);

/// Takes in what was sensed and returns the velocity to drive with. Every goal ends: reached, stopped, or with an
/// error. Cost: O(beams); a plan when one is due.
[[nodiscard]] Twist2 step_navigation(const NavigationModel& model, Navigator& state, const NavigationInput& input);

}  // namespace sentree::sim
