#pragma once

#include <vector>

#include "sentree/bt/write.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// What a palette must know of a project's skills: their IDs, whether each is an action or a condition, and their
/// ports.
///
/// The skills are those of `skills:` and the charts of the folder skills/, but not charts that are named (<scxml name>)
/// after another skill, which are variants of it. Of each:
/// - action or condition as the mission says; a skill that it does not mention is an action if its chart handles `tick`
/// or
///   `halt` or has a <final id="halted">, since a condition is done at its first tick.
/// - inputs are the top-level <data> without a value, and those with a constant that nothing in the chart changes,
///   which is the port's default; outputs are the params of <donedata> in top-level <final>s; a name that is both is
///   both, unless it has a value of its own.
/// - type and description are those of the mission's TreeNodesModel where it has the port; else a constant tells the
/// type. A skill without a chart here (one in another language) is as the TreeNodesModel has it; without that its ports
/// are the attributes that the mission gives it, inout where one is an entry anywhere. Sorted by ID. Codes: those of
/// the files that cannot be read, as errors; the mission may be missing.
[[nodiscard]] Loaded<std::vector<bt::NodeModel>> skill_models(const Project& project);

}  // namespace sentree::project
