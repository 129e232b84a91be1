#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/bt/tree.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/chart_memory.h"
#include "sentree/project/plan.h"

namespace sentree::project {

/// The skills' charts against what they are fed with: events, expressions, outcomes, and inputs that have no value;
/// entries that other nodes read and nobody writes.
///
/// Errors: check.missing-input, check.unwritten-entry, check.unknown-word (of a port that is a word of an interface),
/// those of `check_skill_events`. Warnings: check.unwritten-entry of what skill or node can do without,
/// check.unknown-word where it is near to none, check.unused-skill (an entry of `skills:` that no leaf uses; an error
/// if it is a leaf's name misspelt).
void check_skills(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                  const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                  const Project& project, ChartMemory& charts, Diagnostics& diagnostics);

}  // namespace sentree::project
