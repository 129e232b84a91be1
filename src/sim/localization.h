#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/sim/geometry.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/laser.h"
#include "sentree/sim/likelihood_field.h"
#include "sentree/sim/sight.h"

namespace sentree::sim {

/// How the robot finds its place on the map. The defaults of the filter are those of YARP's amclLocalizer where it has
/// them.
struct LocalizationSpec {
  enum class Method {
    kOdometry,  ///< Initial pose plus odometry: what the paper's experiments ran. Exact without odometry noise.
    kAmcl,      ///< Adaptive Monte Carlo localization.
  };
  Method method = Method::kOdometry;
  int particles_min = 500;
  int particles_max = 2000;
  int particles_global = 20'000;  ///< When nothing is known about the pose.
  double kld_error = 0.05;
  double kld_z = 1.645;  ///< Standard normal quantile of the KLD bound (0.95).
  int beams = 50;        ///< Used of each scan, evenly spread.
  ReadingSpec reading;
  double tempering = 0.3;  ///< Exponent of the product over beams, which are not independent.
  double update_distance_m = 0.1;
  double update_angle_rad = 0.1;
  /// Motion noise (Thrun et al.): turn per turn, turn per metre, metre per metre, metre per turn.
  std::array<double, 4> motion_noise{0.10, 0.05, 0.10, 0.02};
  double recovery_slow = 0.01;  ///< Rates of the long and short averages of the likelihood;
  double recovery_fast = 0.10;  ///< random particles are added while the short one is the lower.

  friend bool operator==(const LocalizationSpec&, const LocalizationSpec&) = default;
};

enum class LocalizationStatus { kNotYetLocalized = 0, kLocalizedOk = 1, kError = 2 };

struct Particle {
  Pose2 pose;
  double weight = 0.0;
  friend bool operator==(const Particle&, const Particle&) = default;
};

/// A pose in the map frame and its covariance, row-major over (x, y, theta).
struct PoseEstimate {
  Pose2 pose;
  std::array<double, 9> covariance{};
  friend bool operator==(const PoseEstimate&, const PoseEstimate&) = default;
};

/// What the localization knows: nothing but odometry, scans and the poses that it was told.
struct Localization {
  LocalizationStatus status = LocalizationStatus::kLocalizedOk;
  PoseEstimate estimate;            ///< At the last update.
  Pose2 map_to_odom;                ///< REP 105: the odom frame in the map frame.
  Pose2 updated_at;                 ///< Odometry pose of the last filter update.
  std::vector<Particle> particles;  ///< Empty with kOdometry.
  double likelihood_slow = 0.0;
  double likelihood_fast = 0.0;
  bool running = true;  ///< Stopped, it takes nothing in and its status is kError.
  Rng rng{0};

  friend bool operator==(const Localization&, const Localization&) = default;
};

[[nodiscard]] Localization initial_localization(const LocalizationSpec& spec, const PoseEstimate& initial, Rng rng);

/// The robot is at `initial` (map frame) while odometry reads `odometry`.
void set_initial_pose(const LocalizationSpec& spec, Localization& state, const PoseEstimate& initial,
                      const Pose2& odometry);

/// Stopped, the localization takes nothing in and claims nothing (status kError); started, it goes on from its last
/// estimate.
void set_running(Localization& state, bool running);

/// Forgets the pose: particles over every free cell. No effect with kOdometry.
void reinitialize_globally(const LocalizationSpec& spec, const GridMap& map, Localization& state,
                           const Pose2& odometry);

/// The pose that follows from the last update and the odometry since.
[[nodiscard]] inline Pose2 estimated_pose(const Localization& state, const Pose2& odometry) {
  return compose(state.map_to_odom, odometry);
}

/// What a localization knows about robot and world; borrowed for the call.
struct LocalizationModel {
  const GridMap& map;
  const LikelihoodField& field;
  const LocalizationSpec& spec;
  const LaserSpec& laser;
};

/// Takes in a scan; does something once the robot moved far enough since the last update.
/// Cost: O(particles · beams).
void update_localization(const LocalizationModel& model, Localization& state, const Pose2& odometry,
                         const Sight& sight);

}  // namespace sentree::sim
