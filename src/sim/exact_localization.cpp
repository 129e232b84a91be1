#include "sentree/sim/exact_localization.h"

#include <cmath>

namespace sentree::sim {

void update_exactly(const LocalizationSpec& spec, Localization& state, const Pose2& odometry, const Pose2& truth) {
  if (!state.running || spec.method != kExact) return;
  const Pose2 motion = relative(state.updated_at, odometry);
  if (norm(motion.position()) < spec.update_distance_m && std::abs(motion.theta) < spec.update_angle_rad) return;
  // An autoregressive process of first order, whose variance is that of the filter. The error before is what odometry
  // made of the last one; one that the filter never has was told, and is forgotten.
  const ExactError& error = kExactError;
  constexpr double kFarthest = 5.0;  // standard deviations
  Pose2 off = relative(truth, estimated_pose(state, odometry));
  off.theta = wrap_angle(off.theta);
  const bool goes_on = state.status == LocalizationStatus::kLocalizedOk &&
                       std::abs(off.x) <= kFarthest * error.along_m && std::abs(off.y) <= kFarthest * error.across_m &&
                       std::abs(off.theta) <= kFarthest * error.heading_rad;
  const double stays = goes_on ? error.persistence : 0.0;
  const double fresh = std::sqrt(1.0 - stays * stays);
  const auto next = [&](double before, double sigma) { return stays * before + fresh * sigma * state.rng.normal(); };
  off.x = next(off.x, error.along_m);
  off.y = next(off.y, error.across_m);
  off.theta = next(off.theta, error.heading_rad);
  const double c = std::cos(truth.theta);
  const double s = std::sin(truth.theta);
  const double along = error.along_m * error.along_m;
  const double across = error.across_m * error.across_m;
  const double slant = c * s * (along - across);
  state.estimate = {compose(truth, off),
                    {c * c * along + s * s * across, slant, 0.0, slant, s * s * along + c * c * across, 0.0, 0.0, 0.0,
                     error.heading_rad * error.heading_rad}};
  state.status = LocalizationStatus::kLocalizedOk;
  state.updated_at = odometry;
  state.map_to_odom = frame_from(state.estimate.pose, odometry);
}

}  // namespace sentree::sim
