#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/source.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"

namespace sentree::bt {

struct Model;

enum class Category : std::uint8_t { kControl, kDecorator, kAction, kCondition, kSubTree };

/// "Control", "Decorator", "Action", "Condition", "SubTree": the tags of the explicit form.
[[nodiscard]] std::string_view to_string(Category category);
/// A tag of the explicit form for nodes: the node's name is its attribute ID.
[[nodiscard]] bool is_explicit_tag(std::string_view tag);

/// A port of a node as the file gives it.
struct PortFact {
  std::string_view name;
  std::string_view text;  ///< As written, or the default: "30", "{entry}", "{=}".
  std::string_view type;  ///< Declared type, e.g. "double"; empty if nobody declared one.
  bool input = true;
  bool output = false;
  bool declared = false;  ///< By the TreeNodesModel or by the C++ node.
};

/// A Behavior Tree, loaded, checked and compiled. Never changes; cheap to move; safe to share between threads.
///
/// SubTrees are expanded: every instance has nodes of its own. All views live as long as the tree.
class Tree {
 public:
  explicit Tree(std::unique_ptr<const Model> model);
  Tree(Tree&&) noexcept;
  Tree& operator=(Tree&&) noexcept;
  ~Tree();

  [[nodiscard]] std::size_t size() const;     ///< Nodes, at least one.
  [[nodiscard]] std::string_view id() const;  ///< Of the main tree.
  [[nodiscard]] int format() const;           ///< 3 or 4: whose semantics the tree runs with.

  [[nodiscard]] Category category(NodeId node) const;
  [[nodiscard]] std::string_view registration(NodeId node) const;  ///< ID, e.g. "Sequence", "GoToLocation".
  [[nodiscard]] std::string_view name(NodeId node) const;          ///< The attribute `name`, else the ID.
  /// Names of the enclosing SubTrees and of the node, joined with '.', e.g. "Sub.GoToStation". Where that is the path
  /// of several external leaves, those without a name of their own have their number behind the ID, counted from 1 in
  /// the order of the file, as BehaviorTree.CPP does it: "Sub.GoTo::7"; and so have SubTrees without a name above them.
  [[nodiscard]] std::string path(NodeId node) const;
  [[nodiscard]] NodeId parent(NodeId node) const;  ///< kNoNode for the root.
  [[nodiscard]] std::span<const NodeId> children(NodeId node) const;
  [[nodiscard]] NodeId subtree_end(NodeId node) const;  ///< One past the last descendant.
  /// The SubTree node whose definition the node belongs to; kNoNode in the main tree.
  [[nodiscard]] NodeId enclosing_subtree(NodeId node) const;
  /// ID of the BehaviorTree that the node is written in.
  [[nodiscard]] std::string_view definition(NodeId node) const;
  [[nodiscard]] SourceSpan span(NodeId node) const;              ///< Of the element that made it.
  [[nodiscard]] std::vector<PortFact> ports(NodeId node) const;  ///< Also those of SubTrees.
  /// Pre- and post-conditions as written: {"_skipIf", "n > 3"} …
  [[nodiscard]] std::vector<std::pair<std::string_view, std::string_view>> conditions(NodeId node) const;

  /// True for a node that can be looked at but not run: a SubTree whose BehaviorTree is not there, or a control node or
  /// decorator of which nobody says what it does. Only with `LoadOptions::partial`.
  [[nodiscard]] bool is_unknown(NodeId node) const;
  /// ID of the BehaviorTree that a SubTree stands for, also where that is not there; empty for other nodes.
  [[nodiscard]] std::string_view subtree_id(NodeId node) const;

  /// True for a leaf that is neither built in nor a registered C++ node: a skill runs it.
  [[nodiscard]] bool is_external(NodeId node) const;
  /// True for a node in C++ that a program or a plug-in registered.
  [[nodiscard]] bool is_user(NodeId node) const;
  [[nodiscard]] std::span<const NodeId> external_leaves() const;
  /// The name of an external leaf in messages: its path through `event_name`. Unique in the tree.
  [[nodiscard]] std::string event_name(NodeId leaf) const;
  /// The node with that path, or kNoNode. O(nodes).
  [[nodiscard]] NodeId find(std::string_view path) const;

  [[nodiscard]] const Model& model() const { return *model_; }

 private:
  std::unique_ptr<const Model> model_;
};

/// The one rule that makes an event name of a path: ASCII letters and digits, '_', '-', '.' and everything beyond
/// ASCII stay; any other character becomes '_'.
[[nodiscard]] std::string event_name(std::string_view path);

}  // namespace sentree::bt
