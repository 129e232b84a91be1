#pragma once

#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/bt/tree.h"
#include "sentree/project/plan.h"

namespace sentree::project {

/// What is said to run elsewhere does so: every "{name}" is a process, and no skill there subscribes to topics.
void check_processes(const Scenario& scenario, Diagnostics& diagnostics);

/// A process that is to run a skill runs one that the mission has and that calls nothing inside this one, and one that
/// runs a monitor one of the project's.
void check_process_skills(const Scenario& scenario, const bt::Tree& tree, const std::vector<LeafPlan>& plans,
                          Diagnostics& diagnostics);

}  // namespace sentree::project
