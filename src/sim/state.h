#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/base/value.h"
#include "sentree/sim/ground_truth.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

struct RobotState {
  GroundTruth truth;
  Battery battery;
  int station = -1;     ///< Index of the station at which it stands; -1: none.
  TimePoint arrived{};  ///< When it came there.
  Pose2 odometry;       ///< In the odom frame.
  Twist2 odometry_twist;
  VelocityCommand command;  ///< Of the Base service; it wins over navigation until it ends.
  Twist2 drive;             ///< What navigation wants.
  Scan scan;
  /// Where the laser stood: the scan's rays have not been cast, and nothing but the map's walls is in their way. Only
  /// in states that `advance_uncast` leaves.
  std::optional<Pose2> uncast;
  Pose2 scan_odometry;  ///< Odometry pose at the scan.
  Localization localization;
  Navigator navigator;
  Rng odometry_rng{0};
  Rng laser_rng{0};

  friend bool operator==(const RobotState&, const RobotState&) = default;
};

/// How simulated time follows the run's clock.
struct TimeControl {
  double factor = 1.0;  ///< Simulated seconds per second; 0: as fast as the host steps it.
  bool paused = false;
  TimePoint run_anchor{};  ///< At this time of the run …
  TimePoint sim_anchor{};  ///< … simulated time was this.

  friend bool operator==(const TimeControl&, const TimeControl&) = default;
};

/// Everything about a world that changes. A plain value: a copy continues alike, equal states behave alike.
struct State {
  TimePoint time{};  ///< Simulated; a multiple of the world's step.
  std::uint64_t seed = 0;
  TimeControl clock;
  std::vector<RobotState> robots;  ///< As in the world.
  std::vector<Obstacle> obstacles;
  std::vector<Door> doors;
  std::vector<NamedLocation> locations;
  std::vector<NamedArea> areas;
  std::vector<NamedPath> paths;
  std::vector<NamedObject> objects;

  friend bool operator==(const State&, const State&) = default;
  /// Equal states hash alike.
  [[nodiscard]] std::uint64_t hash() const;
};

/// The world at time 0.
[[nodiscard]] State initial_state(const World& world, std::uint64_t seed);

/// The state as data that `restore` reads back to an equal one.
[[nodiscard]] Value save(const State& state);

/// Errors: sim.bad-state naming the member, also when the state is not one of this world.
[[nodiscard]] Result<State> restore(const World& world, const Value& saved);

}  // namespace sentree::sim
