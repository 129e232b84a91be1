#pragma once

#include <string_view>
#include <vector>

#include "sentree/bt/palette.h"
#include "sentree/bt/registry.h"

namespace sentree::nav2 {

/// Under this name `palettes:` and `--palette` know what follows.
inline constexpr std::string_view kPalette = "nav2";

/// Registers those of Nav2's control nodes and decorators that need no ROS: PipelineSequence, RecoveryNode, RoundRobin,
/// NonblockingSequence, PersistentSequence, RateController, SingleTrigger, GoalUpdatedController.
///
/// What a child returned stays its status while one of these nodes runs, so an action that is done is not begun again
/// by being ticked again, only below a decorator. What Nav2's documentation leaves open: children that are skipped
/// count as done; if all are, so is the node; a recovery that is skipped has recovered nothing, which is FAILURE.
/// Source: docs.nav2.org, "Introduction To Nav2 Specific Nodes" and "Navigation Plugins", 2025.
void add_nodes(bt::Registry& registry);

/// Those that need ROS (transforms, topics or services), as they are declared: they can be drawn, not run.
[[nodiscard]] const std::vector<bt::NodeModel>& models();

}  // namespace sentree::nav2
