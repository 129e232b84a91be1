#pragma once

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

struct UnsetBlackboard : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() {
    return {format4(leaf("UnsetBlackboard", Category::kAction, {input<std::string>("key")}))};
  }
  static std::optional<may::Failing> always_fails(const may::Given& given) { return given.lacks({0}); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto key = m.read_text(n, 0);
    if (!key) return m.fail(id, "bt.missing-port", "needs \"key\", the name of an entry");
    const std::uint32_t cell = m.blackboard().find_cell(m.model().scope(id), *key);
    if (cell != kNone) m.blackboard().unset(cell);
    return Next::done(Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
