#pragma once

#include <vector>

#include "sentree/bt/tree.h"
#include "sentree/project/plan.h"

namespace sentree::project {

/// Skills below a ReactiveSequence or ReactiveFallback that never end: at each tick it begins with its first child, so
/// an action there that takes time starts anew whenever a later sibling is RUNNING, and halts that. An action takes
/// time if only events end it that a tick does not bring by itself. Format 4.
///
/// Warning: check.reactive. Cost: O(nodes + transitions of charts).
void check_reactive(const bt::Tree& tree, const std::vector<LeafPlan>& leaves, Diagnostics& diagnostics);

}  // namespace sentree::project
