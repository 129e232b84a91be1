#pragma once

#include "sentree/base/diagnostic.h"
#include "sentree/monitor/monitor.h"

namespace sentree::monitor {

/// What the monitor `before` remembers, as the memory of `after`, which takes its place at `now`. Its chart's session
/// is carried over as `scxml::carry` does; what was decided stays decided. What was observed before is in no witness.
/// Codes: those of `scxml::carry`.
[[nodiscard]] Loaded<State> carry(const Model& before, const State& state, const Model& after, TimePoint now);

}  // namespace sentree::monitor
