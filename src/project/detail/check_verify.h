#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sentree/project/check_intervention.h"
#include "sentree/project/project.h"
#include "sentree/scxml/chart.h"

namespace sentree::project {

/// Models by name, those too whose services are elsewhere in a run: `sentree verify` lets them serve.
using ModelCharts = std::vector<std::pair<std::string, scxml::Chart>>;

/// Whether the faults of `verify:` name what is there, and `fair:` and a scenario's `choices:` choices that models
/// make, with alternatives that they have. What a script computes is taken to be right. Codes: those of
/// `check_intervention`; verify.fair, scenario.choice. Cost: O(size of the charts · choices).
void check_verify(const Scenario& scenario, const InterventionScope& scope, const ModelCharts& models,
                  Diagnostics& diagnostics);

}  // namespace sentree::project
