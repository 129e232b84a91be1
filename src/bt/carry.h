#pragma once

#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// A state that goes on with another tree.
struct Carried {
  State state;
  /// By node of the tree before: what it is in the tree after, or kNoNode.
  std::vector<NodeId> node_of;
};

/// `state`, of the tree `before`, as a state of the tree `after`, which takes its place while it goes on.
///
/// Nodes are the same if their parents are and their IDs and names, in order; external leaves also if their paths are
/// the same, wherever they stand. Entries of the blackboard are the same if SubTree and name are. What is new is idle.
/// Code bt.cannot-carry, one for each thing that stands in the way: a node at work that is gone, has moved or is
/// another one, or that counts children which are others now; an entry whose type does not take its value.
[[nodiscard]] Loaded<Carried> carry(const Tree& before, const State& state, const Tree& after);

}  // namespace sentree::bt
