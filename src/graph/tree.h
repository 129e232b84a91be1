#pragma once

#include <string>
#include <string_view>
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

/// The literature's sign for a control node or decorator of that ID: an R marks the memoryless ones, a star the one
/// that remembers. The ID itself, where there is none.
[[nodiscard]] std::string symbol_of(std::string_view id);

/// The tree for drawing, node i of the drawing being node i of the tree; with a state, coloured by it. O(nodes).
[[nodiscard]] draw::Tree drawing_of(const bt::Tree& tree, const bt::State* state = nullptr,
                                    const TreeOptions& options = {});
/// A palette for drawing: its nodes with their ports, below a box that counts them. SubTrees are left out.
[[nodiscard]] draw::Tree drawing_of(const std::vector<bt::NodeModel>& models);

}  // namespace sentree::graph
