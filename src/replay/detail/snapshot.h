#pragma once

#include <functional>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/inside.h"

namespace sentree::replay {

/// Saves everything that a run is at this instant, as data: `sequence` (observations so far), `tree` (octets of
/// `bt::save`), `skills` by leaf, `monitors` by name, and `world` if the simulator runs in this process.
///
/// Called in the director's actor; the parts come in from the actors that own them, and `done` is told in the last of
/// these. In virtual time that is the same instant.
void take_snapshot(runtime::RunInside& inside, const project::Plan& plan,
                   std::function<void(TimePoint, const Map&)> done);
/// The same of a run in virtual time that is over, when no actor takes anything any more.
[[nodiscard]] Map snapshot_of_end(runtime::RunInside& inside, const project::Plan& plan);

}  // namespace sentree::replay
