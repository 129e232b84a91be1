#pragma once

#include <string>
#include <string_view>

#include "sentree/base/diagnostic.h"
#include "sentree/bt/tree.h"

namespace sentree::project {

/// What a mission's file says that nobody reads, and that looks like a slip: attributes of <root>, types of ports,
/// leaves that its TreeNodesModel has under a name nearly the same.
///
/// Warnings: check.unknown-attribute, check.unknown-type, check.undeclared-leaf. Cost: O(size).
/// @param source  Of the file, which loads.
void check_mission(const bt::Tree& tree, std::string_view source, const std::string& file, Diagnostics& diagnostics);

}  // namespace sentree::project
