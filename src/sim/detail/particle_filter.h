#pragma once

#include "sentree/sim/localization.h"

namespace sentree::sim {

/// Draws particles about the estimate, as wide as its covariance, at least a few centimetres and degrees.
void scatter_around(const LocalizationSpec& spec, Localization& state);

/// Draws particles over all free cells and headings. No effect on a map without a free cell.
void scatter_everywhere(const LocalizationSpec& spec, const GridMap& map, Localization& state);

/// One turn of the filter: moves the particles by a noisy `motion` (base_link), weights them by the scan, draws
/// the next generation, and sets estimate, covariance and status.
///
/// Its size follows the spread of the particles (KLD sampling). Readings worse in the short than in the long run
/// bring random particles in, so that a robot that was carried away is found again.
/// Cost: O(particles · beams) look-ups.
/// Sources: Fox, "KLD-Sampling: Adaptive Particle Filters", 2001; Thrun, Burgard, Fox, "Probabilistic
/// Robotics", 2005, tables 5.6 (odometry motion model), 6.3 (likelihood field) and 8.3 (augmented MCL).
void update_particles(const LocalizationModel& model, Localization& state, const Pose2& motion, const Sight& sight);

}  // namespace sentree::sim
