#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sentree/bt/tree.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/chart_memory.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"

namespace sentree::project {

/// An entry of `monitors:` that names a .req file stands for one monitor for each of its requirements, named like it;
/// with a name of its own, for its only requirement. A file that cannot be read stays one entry, and `prepare` says
/// what is wrong with it.
[[nodiscard]] std::vector<MonitorEntry> expand_requirements(const Project& project, MonitorEntry entry);
/// Whether the entry stands for a .req file whose requirements could not be told.
[[nodiscard]] bool is_unread_requirements(const MonitorEntry& entry);

/// What a project observes.
/// @param tree  Null: the mission could not be loaded, so nothing is known of it.
/// @param world  Null: there is none, or it could not be loaded.
[[nodiscard]] monitor::Vocabulary vocabulary_of(const std::map<std::string, ServicePlan>& services,
                                                const bt::Tree* tree, const std::vector<LeafPlan>& leaves,
                                                const sim::World* world, ChartMemory& charts);
[[nodiscard]] monitor::Vocabulary vocabulary_of(const Plan& plan);
/// The models of the project: their names, what they choose, and the texts that they write down, which may come in
/// what they answer and publish.
/// @param charts  By name, as far as they could be loaded.
void add_models(const std::vector<std::string>& names, const std::vector<std::pair<std::string, scxml::Chart>>& charts,
                ChartMemory& memory, monitor::Vocabulary& vocabulary);

}  // namespace sentree::project
