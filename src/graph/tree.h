#pragma once

#include <vector>

#include "sentree/bt/palette.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"
#include "sentree/draw/tree.h"

namespace sentree::graph {

struct TreeOptions {
  bool ports = true;       ///< A line per port: "destination: kitchen".
  bool conditions = true;  ///< A line per pre- and post-condition.
};

/// The tree for drawing, node i of the drawing being node i of the tree; with a state, coloured by it. O(nodes).
[[nodiscard]] draw::Tree drawing_of(const bt::Tree& tree, const bt::State* state = nullptr,
                                    const TreeOptions& options = {});
/// A palette for drawing: its nodes with their ports, below a box that counts them. SubTrees are left out.
[[nodiscard]] draw::Tree drawing_of(const std::vector<bt::NodeModel>& models);

}  // namespace sentree::graph
