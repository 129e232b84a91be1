#pragma once

#include "sentree/sim/localization.h"

namespace sentree::sim {

/// No localization, but as good as one and far cheaper: the simulator tells where the robot is, with an error like that
/// which was measured of the filter. Odometry and scans are not looked at, so it stands beside the methods that do.
inline constexpr auto kExact = static_cast<LocalizationSpec::Method>(2);

/// What the error is drawn from, at each update: standard deviations along and across the heading, and of it, and
/// the share of the error before that stays. Measured of the filter, see docs/simulator.md.
struct ExactError {
  double along_m = 0.027;
  double across_m = 0.013;
  double heading_rad = 0.0074;
  double persistence = 0.97;
};
inline constexpr ExactError kExactError;

/// What kExact does where the others take in a scan, once the robot has moved far enough: `truth` is where it is. After
/// `reinitialize_globally` it knows its place again at the next update. No effect with other methods.
void update_exactly(const LocalizationSpec& spec, Localization& state, const Pose2& odometry, const Pose2& truth);

}  // namespace sentree::sim
