#pragma once

#include "sentree/base/time.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// Longest leap of simulated time that one `advance` makes; what is beyond is dropped from the clock's anchor.
inline constexpr Duration kAdvanceMax = std::chrono::hours(24);

/// Advances the world to time `now` of the run, in whole steps of `world.step`; what is left of a step waits. How
/// often it is called makes no difference. No effect while paused, with factor 0, or if `now` is past.
/// Cost: at most about 1 ms a simulated second and robot, most of it laser scans and plans.
void advance(const World& world, State& state, TimePoint now);

/// As `advance`, but where nobody has looked at the latest scan it may not have been cast.
void advance_uncast(const World& world, State& state, TimePoint now);
/// Casts the scans that have not been.
void cast_scans(const World& world, State& state);

/// From `now` on, simulated time follows the run's clock anew; what was simulated stays, and what lies between is left
/// out.
void follow(State& state, TimePoint now);

/// Advances by a duration of simulated time, whatever the clock says.
void advance_by(const World& world, State& state, Duration duration);

}  // namespace sentree::sim
