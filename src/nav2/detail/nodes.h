#pragma once

#include <vector>

#include "sentree/base/value.h"
#include "sentree/bt/context.h"
#include "sentree/bt/palette.h"
#include "sentree/bt/registry.h"

namespace sentree::nav2::detail {

/// What a port holds, to be compared.
[[nodiscard]] Value held(const bt::Context& self, const char* port);

/// Conditions, selectors and decorators over what is on the blackboard.
void add_leaves(bt::Registry& registry);

/// The leaves that charts in skills/nav2 run.
[[nodiscard]] std::vector<bt::NodeModel> skill_models();

}  // namespace sentree::nav2::detail
