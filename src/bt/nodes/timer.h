#pragma once

#include <chrono>

#include "sentree/bt/nodes/node.h"

// On the run's time. A timer that is due makes the tree ask for a tick.

namespace sentree::bt::nodes {

inline TimePoint after(TimePoint now, std::int64_t milliseconds) {
  return add_saturating(now, from_seconds(static_cast<double>(milliseconds) * 1e-3));
}

}  // namespace sentree::bt::nodes
