#pragma once

#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::project {

/// Under which names the nodes in C++ that a mission has of plug-ins are registered: each once, in order.
[[nodiscard]] std::vector<std::string> cpp_nodes(const Plan& plan);
/// The first few of them, for a sentence; empty: there are none.
[[nodiscard]] std::string shown_cpp_nodes(const Plan& plan);

}  // namespace sentree::project
