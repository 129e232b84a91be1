#include "sentree/sim/detail/exact_localization.h"

#include <cmath>

namespace sentree::sim {

void update_exactly(const LocalizationSpec& spec, Localization& state, const Pose2& odometry, const Pose2& truth) {
  if (!state.running || spec.method != kExact) return;
  const Pose2 motion = relative(state.updated_at, odometry);
  if (norm(motion.position()) < spec.update_distance_m && std::abs(motion.theta) < spec.update_angle_rad) return;
  // An error that the filter never has was told, and is forgotten.
  constexpr double kFarthest_m = 0.5;
  constexpr double kFarthest_rad = 0.35;
  Pose2 off = relative(truth, estimated_pose(state, odometry));
  off.theta = wrap_angle(off.theta);
  const bool goes_on = state.status == LocalizationStatus::kLocalizedOk && norm(off.position()) <= kFarthest_m &&
                       std::abs(off.theta) <= kFarthest_rad;
  // What it comes to in the long run, where odometry is exact.
  const auto spread = [](const ExactError::Part& part) {
    return part.sigma / std::sqrt(1.0 - part.stays * part.stays);
  };
  const auto next = [&](double before, const ExactError::Part& part) {
    return goes_on ? part.stays * before + part.sigma * state.rng.normal() : spread(part) * state.rng.normal();
  };
  const ExactError& error = kExactError;
  off.x = next(off.x, error.along);
  off.y = next(off.y, error.across);
  off.theta = next(off.theta, error.heading);
  const double c = std::cos(truth.theta);
  const double s = std::sin(truth.theta);
  const double along = spread(error.along) * spread(error.along);
  const double across = spread(error.across) * spread(error.across);
  const double slant = c * s * (along - across);
  state.estimate = {compose(truth, off),
                    {c * c * along + s * s * across, slant, 0.0, slant, s * s * along + c * c * across, 0.0, 0.0, 0.0,
                     spread(error.heading) * spread(error.heading)}};
  state.status = LocalizationStatus::kLocalizedOk;
  state.updated_at = odometry;
  state.map_to_odom = frame_from(state.estimate.pose, odometry);
}

}  // namespace sentree::sim
