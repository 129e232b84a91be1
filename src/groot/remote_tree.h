#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::groot {

/// A tree that another program executes, as its publisher describes it, made one that `bt::load` reads with
/// `LoadOptions::partial`: every instance of a SubTree is a BehaviorTree of its own.
struct RemoteTree {
  struct Board {
    std::string name;       ///< As the publisher calls it.
    std::uint16_t uid = 0;  ///< Of the SubTree's node; 0: the main tree's.
  };
  std::string mission;
  std::vector<std::uint16_t> uids;  ///< By the number that the node has in the tree loaded from `mission`.
  std::vector<Board> boards;
};

struct RemoteTreeOptions {
  /// Leaves of these names get their number behind it, as those do whose name is there already.
  std::span<const std::string_view> reserved = {};
  /// Leaves out what nodes are given: for a tree whose ports or scripts cannot be read.
  bool bare = false;
};

/// Nodes inside nodes, SubTrees expanded, and nodes that are read.
inline constexpr std::size_t kRemoteDepthMax = 2'000;
inline constexpr std::size_t kRemoteNodesMax = 65'535;

/// Reads the answer to `Ask::kTree`. A SubTree whose instance is not described, or is described for another node, is
/// one of which nothing is known.
/// Errors: xml.*, bt.not-a-tree, groot.tree (no tree, a node without a number, too deep, too large).
[[nodiscard]] Result<RemoteTree> read_remote_tree(const std::string& xml, const RemoteTreeOptions& options = {});

}  // namespace sentree::groot
