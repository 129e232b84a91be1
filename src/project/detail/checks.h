#pragma once

#include <set>

#include "sentree/project/plan.h"

namespace sentree::project {

/// A file that the project names and that cannot be read: the message stands where it is named.
[[nodiscard]] Diagnostic missing(const Project& project, const FileRef& file, Diagnostic why);

/// What a skill's chart may not do: call what does not exist, or with wrong arguments. Also warns of replies handled
/// that no call causes, and of topics that it does not subscribe to.
///
/// @param topics  To which it does.
/// Services of the project that are not in `services` have been reported already and are passed over.
void check_skill_chart(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                       const std::set<std::string>& topics, const Project& project, Diagnostics& diagnostics);

/// A skill's chart that ends in a state that is no outcome.
void check_outcomes(const scxml::Chart& chart, Diagnostics& diagnostics);

/// Ports against data: an input that the chart has no <data> for, or whose <data> sentree.yaml sets; an output that
/// nothing feeds.
void check_leaf_ports(const bt::Tree& tree, const LeafPlan& leaf, Diagnostics& diagnostics);

/// Names that would make two different observations look alike.
void check_names(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                 const std::map<std::string, ServicePlan>& services, const Project& project, Diagnostics& diagnostics);

/// Tolerances nest: where navigation stops ⊂ where a skill sees the robot at a place ⊂ where the station charges.
/// Otherwise the robot waits for ever at a station that does not charge it, or never believes that it has arrived.
void check_tolerances(const std::vector<LeafPlan>& leaves, const sim::World& world, Diagnostics& diagnostics);

/// A gate whose patterns no call matches, or whose chart does not listen to what it is asked about.
void check_gate(const MonitorEntry& entry, const monitor::Model& model,
                const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics);

/// A source (`from:`) of a monitor's event that nobody in the project is, or that says nothing of what it is to say.
/// @param vocabulary  Null: it is not known who says what.
void check_sources(const EventRename& rename, const std::vector<LeafPlan>& leaves,
                   const std::map<std::string, ServicePlan>& services, const Project& project,
                   const monitor::Vocabulary* vocabulary, Diagnostics& diagnostics);

/// Places that the mission names and the world does not have.
void check_locations(const bt::Tree& tree, const std::vector<LeafPlan>& leaves, const sim::World& world,
                     const std::string& world_file, Diagnostics& diagnostics);

}  // namespace sentree::project
