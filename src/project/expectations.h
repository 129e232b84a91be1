#pragma once

#include "sentree/base/diagnostic.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// Whether anything can come out that `sentree test` would not take.
[[nodiscard]] bool expects_anything(const Scenario& scenario);

/// That a scenario expects nothing. Note: scenario.expect.
void check_expectations(const Scenario& scenario, Diagnostics& diagnostics);

}  // namespace sentree::project
