#pragma once

#include "sentree/bt/nodes/node.h"

// A decorator's child. The machine resets a completed child after each of its ticks.

namespace sentree::bt::nodes {

inline NodeId only_child(const Machine& m, const Node& n) { return m.child(n, 0); }

}  // namespace sentree::bt::nodes
