#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

namespace sentree::groot {

/// Nodes that Groot can number: 16 bits, from 1.
inline constexpr std::size_t kNodesMax = 65'535;

/// Groot 2's number of a node.
[[nodiscard]] constexpr std::uint16_t uid_of(bt::NodeId node) { return static_cast<std::uint16_t>(node + 1); }

/// A tree as both Groots want it described. A plain value that does not refer to the tree.
struct TreeImage {
  /// A blackboard by the name that Groot 2 asks for: the tree's ID, or the path of a SubTree's instance.
  struct Board {
    std::string name;
    std::string scope;  ///< As `bt::export_blackboard` names it.
  };
  std::size_t nodes = 0;
  std::string xml;                     ///< For Groot 2.
  std::string flat;                    ///< For Groot 1: a FlatBuffer, all nodes idle.
  std::vector<std::size_t> status_at;  ///< Where in `flat` the status of each node is.
  std::uint16_t base = 0;              ///< Groot 1 knows node n as base + n + 1.
  std::vector<Board> boards;
};

/// @param base  Added to Groot 1's numbers: it takes a tree for a new one only by numbers that it does not know. Made
///              smaller where they would not fit.
/// Error: groot.too-many-nodes.
[[nodiscard]] Result<TreeImage> describe(const bt::Tree& tree, std::uint16_t base = 0);

/// The tree as BehaviorTree.CPP 4.10 shows it to Groot 2: every node with its number as `_uid`, every instance of a
/// SubTree as a BehaviorTree of its own with its `_fullpath`, and models of all nodes, built-in ones included.
[[nodiscard]] std::string write_xml(const bt::Tree& tree);

/// All entries as `bt::export_blackboard` gives them, and as null those without a value and C++ objects: so
/// BehaviorTree.CPP shows them to Groot 2.
[[nodiscard]] Value boards(const bt::Tree& tree, const bt::State& state);

/// What BehaviorTree.CPP calls the instance of a SubTree, by its node: the names of the instances around it and its
/// own, joined with '/'; the own name is its attribute `name`, else its ID and its number ("Dock::7"). Each is there
/// once. Empty for nodes that are no SubTree.
[[nodiscard]] std::vector<std::string> instance_paths(const bt::Tree& tree);

}  // namespace sentree::groot
