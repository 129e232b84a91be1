#include "sentree/sim/localization.h"

#include <cmath>

#include "sentree/sim/detail/exact_localization.h"
#include "sentree/sim/detail/particle_filter.h"

namespace sentree::sim {

Localization initial_localization(const LocalizationSpec& spec, const PoseEstimate& initial, Rng rng) {
  Localization state;
  state.rng = rng;
  set_initial_pose(spec, state, initial, {});
  return state;
}

void set_initial_pose(const LocalizationSpec& spec, Localization& state, const PoseEstimate& initial,
                      const Pose2& odometry) {
  if (state.running) state.status = LocalizationStatus::kLocalizedOk;
  state.estimate = initial;
  state.map_to_odom = frame_from(initial.pose, odometry);
  state.updated_at = odometry;
  if (spec.method == LocalizationSpec::Method::kAmcl) scatter_around(spec, state);
}

void set_running(Localization& state, bool running) {
  if (state.running == running) return;
  state.running = running;
  state.status = running ? LocalizationStatus::kLocalizedOk : LocalizationStatus::kError;
}

void reinitialize_globally(const LocalizationSpec& spec, const GridMap& map, Localization& state,
                           const Pose2& odometry) {
  if (spec.method == LocalizationSpec::Method::kOdometry) return;
  if (state.running) state.status = LocalizationStatus::kNotYetLocalized;
  state.updated_at = odometry;
  if (spec.method == kExact) return;
  scatter_everywhere(spec, map, state);
  state.map_to_odom = frame_from(state.estimate.pose, odometry);
}

void update_localization(const LocalizationModel& model, Localization& state, const Pose2& odometry,
                         const Sight& sight) {
  if (!state.running || model.spec.method == kExact) return;
  if (model.spec.method == LocalizationSpec::Method::kOdometry) {
    state.estimate.pose = estimated_pose(state, odometry);
    return;
  }
  const Pose2 motion = relative(state.updated_at, odometry);
  if (norm(motion.position()) < model.spec.update_distance_m && std::abs(motion.theta) < model.spec.update_angle_rad)
    return;
  update_particles(model, state, motion, sight);
  state.updated_at = odometry;
  state.map_to_odom = frame_from(state.estimate.pose, odometry);
}

}  // namespace sentree::sim
