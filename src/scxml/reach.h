#pragma once

#include <vector>

#include "sentree/scxml/chart.h"

namespace sentree::scxml {

/// By state: whether some sequence of events could enter it, if every condition could hold and every event came.
/// Cost: O(size).
[[nodiscard]] std::vector<bool> reachable_states(const Chart& chart);

}  // namespace sentree::scxml
