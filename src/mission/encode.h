#pragma once

#include <string>

#include "sentree/base/result.h"
#include "sentree/mission/state.h"
#include "sentree/mission/virtual_host.h"

namespace sentree::mission {

/// Takes out of the queue what can have no effect any more: timers that were overtaken, deadlines of ticks that were
/// answered.
void prune(State& state);

/// Appends the canonical form of a pruned state to `out`: states of one plan with equal forms behave alike from here
/// on, if the surroundings decide every choice. Times are relative to `state.now`; numbers of ticks, calls and runs are
/// renamed in the order in which they appear. Left out are counters, monitors, what only views show, and the
/// generators of the models.
///
/// For comparison within one version; it cannot be read back. Errors: those of `bt::encode` and `scxml::encode`.
[[nodiscard]] Result<void> encode(const VirtualHost& host, const State& state, std::string& out);

}  // namespace sentree::mission
