#pragma once

#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/project.h"

namespace sentree::cli {

/// Lets models choose something else in a scenario: each of `choices` is "MODEL#NUMBER=VALUE", the number being that of
/// the choice among those of its model, the value as JSON. What the scenario lists behind the earliest of them is left
/// out, as is what it expects: from there on the run goes its own way.
/// Error: run.choose.
[[nodiscard]] Result<void> choose(const std::vector<std::string>& choices, project::Scenario& scenario);

}  // namespace sentree::cli
