#pragma once

#include <string>
#include <vector>

#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// Nodes of a project's plug-ins against what its files say of them: leaves that have a skill too, which is not run
/// then, and TreeNodesModels that give them another kind, ports that they do not have, or other directions.
///
/// Warnings: check.hidden-skill, check.plugin-model. Nothing is read without plug-ins.
/// @param registry  With the plug-ins' nodes alone.
/// @param skills    Names that have an entry or a chart.
void check_plugins(const Project& project, const bt::Registry& registry, const bt::Tree& tree,
                   const std::vector<std::string>& skills, Diagnostics& diagnostics);

}  // namespace sentree::project
