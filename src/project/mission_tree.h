#pragma once

#include <cstdint>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/project/project.h"
#include "sentree/scxml/chart.h"

namespace sentree::project {

/// What a tree is loaded for: to be run, or to be looked at (`bt::LoadOptions::partial`).
enum class TreePurpose : std::uint8_t { kRun, kLook };

/// Loads the tree of a project's mission with everything that it takes: further files of trees, palettes, ROS packages,
/// the C++ nodes of plug-ins, and the charts in skills/, which make leaves known that no file declares.
///
/// @param registry  Gets the C++ nodes.
/// Errors: those of bt::load, plug-ins and files, at the places in sentree.yaml that name them.
[[nodiscard]] Loaded<bt::Tree> load_mission(const Project& project, bt::Registry& registry,
                                            TreePurpose purpose = TreePurpose::kRun);

/// What is on the blackboard before the first tick, as `bt::LoadOptions::entries` takes it.
[[nodiscard]] std::vector<bt::StartEntry> start_entries(const Project& project);

/// What the leaf is that runs the chart: an action if it can be ticked again or halted, else a condition. With an entry
/// whose protocol says how the chart is halted: an action if it can be.
[[nodiscard]] bt::Category category_of(const scxml::Chart& chart, const SkillEntry* entry = nullptr);

/// Ending of the charts of the palette nav2 that send goals to Nav2's actions. Where a service of the project has such
/// an interface (nav2_msgs/action/…), they are taken before the others of their leaves.
inline constexpr std::string_view kActionChart = ".action.scxml";

/// The chart of a leaf, as `skills:` names it or where it lies by default.
[[nodiscard]] FileRef skill_file(const Project& project, const SkillEntry* entry, std::string_view leaf_id);

/// Finds `mission` among `mission_files`: the file with the tree to execute. Called when either has changed.
void find_mission(Project& project, const SourceSpan& place, Diagnostics& diagnostics);

}  // namespace sentree::project
