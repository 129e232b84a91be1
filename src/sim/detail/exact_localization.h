#pragma once

#include "sentree/sim/localization.h"

namespace sentree::sim {

/// No localization, but as good as one and far cheaper: the simulator tells where the robot is, with an error like that
/// which was measured of the filter. Odometry and scans are not looked at, so it stands beside the methods that do.
inline constexpr auto kExact = static_cast<LocalizationSpec::Method>(2);

/// What an update of the filter makes of an error: the share that stays of the one before it, which odometry has
/// changed since the last, and the standard deviation of what is added; along and across the heading [m], and of it
/// [rad]. Measured, see docs/simulator.md.
struct ExactError {
  struct Part {
    double stays;
    double sigma;
  };
  Part along{0.93, 0.0024};
  Part across{0.97, 0.0013};
  Part heading{0.84, 0.0016};
};
inline constexpr ExactError kExactError;

/// What kExact does where the others take in a scan, once the robot has moved far enough: `truth` is where it is. After
/// `reinitialize_globally` it knows its place again at the next update. No effect with other methods.
void update_exactly(const LocalizationSpec& spec, Localization& state, const Pose2& odometry, const Pose2& truth);

}  // namespace sentree::sim
