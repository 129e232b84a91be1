#pragma once

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// Nobody says what it does (`Tree::is_unknown`). A SubTree's `Node::data`: its ID, in Model::strings.
struct Unknown : AnyNode {
  static Next enter(Machine& m, const Node& /*n*/, NodeId id) {
    return m.fail(id, "bt.unknown-node", "is known by name only and cannot run");
  }
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kLeaf | may::kRunning; }
};

}  // namespace sentree::bt::nodes
