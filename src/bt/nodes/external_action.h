#pragma once

#include <array>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// A leaf that a skill runs.
struct ExternalAction : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kAlways}};
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kLeaf | may::kRunning; }
  static Next enter(Machine& m, const Node& n, NodeId id) { return m.enter_external(n, id); }
  static void halt(Machine& m, const Node& n, NodeId id) { m.halt_external(n, id); }
};

}  // namespace sentree::bt::nodes
