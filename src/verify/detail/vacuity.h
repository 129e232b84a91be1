#pragma once

#include <string>
#include <vector>

#include "sentree/verify/monitor_memory.h"

namespace sentree::verify {

/// What a requirement that holds rests on.
struct Vacuity {
  std::string why;                      ///< It says nothing; empty: some behaviour puts it to the test.
  std::vector<std::string> never_seen;  ///< Observations that it speaks of, besides others, and that never come.
};

/// @param memory  Of the monitor, which was stepped along every edge.
[[nodiscard]] Vacuity vacuity(const Graph& graph, const monitor::Model& model, const MonitorMemory& memory);

}  // namespace sentree::verify
