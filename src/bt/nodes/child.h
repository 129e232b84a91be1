#pragma once

#include "sentree/bt/nodes/user.h"

namespace sentree::bt::nodes {

/// Ticks a child that answers at once, where its parent stands: most nodes are leaves, so that they are visited in a
/// loop. `kUsual` is what most of them say there.
/// IDLE, which no child says but by a slip of the file: it does not answer at once, which `Next::tick` is for, or the
/// tick is given up.
template <Status kUsual>
[[gnu::always_inline]] inline Status tick_child(Machine& m, NodeId id) {
  const Node& n = m.node(id);
  return n.tick == Node::kPlain ? User::tick_plain<kUsual>(m, n, id) : m.tick_at_once(n, id);
}

}  // namespace sentree::bt::nodes
