#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::project {

/// What the chart of a model may not do: answer what it does not serve, leave a call of the skills unanswered, or
/// choose in the condition of a transition, which is evaluated as often as the engine needs to. Codes: check.model,
/// check.model-answer, check.unanswered, check.choice, idl.unknown-method.
void check_model(const ModelEntry& entry, const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                 const std::vector<LeafPlan>& leaves, Diagnostics& diagnostics);

}  // namespace sentree::project
