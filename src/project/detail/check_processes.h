#pragma once

#include "sentree/base/diagnostic.h"
#include "sentree/bt/tree.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// What is said to run elsewhere does so: every "{name}" is a process, and nothing elsewhere needs what is in this one.
void check_processes(const Scenario& scenario, Diagnostics& diagnostics);

/// A process that is to run a skill runs one that the mission has, and one that runs a monitor one of the project's.
void check_process_skills(const Scenario& scenario, const bt::Tree& tree, Diagnostics& diagnostics);

}  // namespace sentree::project
