#pragma once

#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"
#include "sentree/draw/tree.h"

namespace sentree::bt {

struct GraphOptions {
  bool ports = true;       ///< A line per port: "destination: kitchen".
  bool conditions = true;  ///< A line per pre- and post-condition.
};

/// The tree for drawing, node i of the drawing being node i of the tree; with a state, coloured by it.
[[nodiscard]] draw::Tree to_graph(const Tree& tree, const State* state = nullptr, const GraphOptions& options = {});

}  // namespace sentree::bt
