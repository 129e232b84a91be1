#pragma once

#include <string>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/bt/tree.h"

namespace sentree::project {

/// A file with trees of a mission, as it was read.
struct MissionSource {
  std::string text;
  std::string shown;  ///< Its name in messages.
};

/// What a mission's files say that nobody reads, and that looks like a slip: attributes of <root>, types of ports,
/// leaves that their TreeNodesModels have under a name nearly the same.
///
/// Warnings: check.unknown-attribute, check.unknown-type, check.undeclared-leaf. Cost: O(size).
/// @param files  All of them; those that do not load are passed over.
void check_mission(const bt::Tree& tree, const std::vector<MissionSource>& files, Diagnostics& diagnostics);

}  // namespace sentree::project
