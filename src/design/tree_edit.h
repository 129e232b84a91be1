#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/palette.h"
#include "sentree/design/text_edit.h"

namespace sentree::design {

/// A node of a tree, where its text stands.
struct OutlineNode {
  std::uint32_t element = 0;  ///< Number of its element in the document, in the order of start tags.
  int parent = -1;            ///< In `OutlineTree::nodes`, less than its own place; -1: the tree's root.
  std::string id;             ///< What it is: "Sequence", "GoToLocation", of a SubTree the tree's ID.
  std::string name;           ///< Empty: it has none of its own.
  bt::Category category = bt::Category::kAction;
  bool known = true;  ///< False: nobody says what it is.
  std::size_t children_min = 0;
  std::size_t children_max = 0;
  std::size_t from = 0;                                         ///< Byte of its '<'.
  std::size_t open_end = 0;                                     ///< One past the '>' of its start tag.
  std::size_t to = 0;                                           ///< One past its last '>'.
  std::vector<std::pair<std::string, std::string>> attributes;  ///< But ID and name, in the order written.
};

struct OutlineTree {
  std::uint32_t element = 0;  ///< Of <BehaviorTree>.
  std::string id;
  std::size_t from = 0;
  std::size_t to = 0;
  std::vector<OutlineNode> nodes;  ///< A node before its children, these in the order written.
};

/// What a file of trees shows, whether or not what it says makes sense.
struct Outline {
  std::string main;  ///< main_tree_to_execute; empty: not said.
  std::vector<OutlineTree> trees;
};

/// What nodes are: the built-in ones of format 4, and those of `own`, which come first.
class Kinds {
 public:
  explicit Kinds(const std::vector<bt::NodeModel>& own);
  struct Kind {
    bt::Category category = bt::Category::kAction;
    std::size_t children_min = 0;
    std::size_t children_max = 0;
  };
  /// Null: nobody says what it is.
  [[nodiscard]] const bt::NodeModel* model(std::string_view id) const { return palette_.find(id); }
  [[nodiscard]] Kind kind(std::string_view id, const bt::NodeModel& model) const;
  [[nodiscard]] const bt::Palette& palette() const { return palette_; }

 private:
  bt::Palette palette_;
};

/// The models that the document itself declares count before `kinds`. Errors: xml.*, bt.not-a-tree.
[[nodiscard]] Result<Outline> outline_of(std::string_view xml, const Kinds& kinds, const std::string& file = {});

/// Behind child number `index` - 1 of the element `parent`, before the one that is number `index` now.
struct Slot {
  std::uint32_t parent = 0;  ///< Element; of <BehaviorTree> where the root belongs.
  std::size_t index = 0;
};

struct InsertNode {
  std::string id;
  bool subtree = false;  ///< `id` is a tree's.
  std::string name;      ///< Empty: none.
  std::vector<std::pair<std::string, std::string>> ports;
  Slot at;
};
struct DeleteNode {
  std::uint32_t node = 0;
};
struct MoveNode {
  std::uint32_t node = 0;
  Slot to;
  bool copy = false;
};
struct WrapNode {
  std::uint32_t node = 0;
  std::string id;
};
/// Its children take its place.
struct UnwrapNode {
  std::uint32_t node = 0;
};
struct SetAttribute {
  std::uint32_t node = 0;
  std::string name;
  std::optional<std::string> value;  ///< Nothing: the attribute goes.
};
/// With what is in it, as a tree of its own behind this one; a SubTree that sees all entries stands in its place.
struct ExtractTree {
  std::uint32_t node = 0;
  std::string id;  ///< Of the new tree.
};
/// Nodes written elsewhere, as another file or another editor has them: one or several elements; a <BehaviorTree>, or a
/// file of one, stands for what is in it.
struct PasteNodes {
  std::string xml;
  Slot at;
};
/// Without nodes, behind the others.
struct AddTree {
  std::string id;
};
/// A tree that no SubTree of the file is of, nor the main one, nor the only one.
struct DeleteTree {
  std::uint32_t tree = 0;  ///< Element.
};
/// A SubTree: the nodes of its tree take its place. The tree goes too, if no other SubTree of the file is of it.
struct InlineTree {
  std::uint32_t node = 0;
};
/// One gesture on several nodes, whose own `node` does not count. Moved, copied and deleted is what is inside of
/// another of them along with it, in the order written; wrapped, as children of one node, are neighbours.
struct EditNodes {
  std::vector<std::uint32_t> nodes;  ///< In any order.
  std::variant<DeleteNode, MoveNode, WrapNode, UnwrapNode, SetAttribute> gesture;
};
using TreeGesture = std::variant<InsertNode, DeleteNode, MoveNode, WrapNode, UnwrapNode, SetAttribute, ExtractTree,
                                 InlineTree, PasteNodes, AddTree, DeleteTree, EditNodes>;

struct GestureResult {
  TextEdits edits;
  std::string name;                  ///< For people: "move GoToKitchen under Recharge".
  std::vector<std::uint32_t> nodes;  ///< Of several: what they are in the edited text, as far as they can be told.
  std::vector<std::string> states;   ///< Ids of those pasted.
};

/// A change of a tree as edits of its text. What is outside the elements concerned stays byte for byte: comments, the
/// order and quotes of attributes, line ends. A node that gets a line of its own is indented like its neighbours.
/// Leaves and SubTrees in what is copied or pasted whose names their new tree has already get free ones (GoToDesk_2):
/// messages tell them apart by these.
///
/// Errors: those of `outline_of`; design.no-such-node; design.arity (a parent that takes no more children, or none),
/// design.inside-itself (a node into itself, a SubTree into its own tree), design.bad-name, design.nothing-to-do,
/// design.no-nodes (what is pasted), design.used (a tree that is deleted). The message says why, for whoever drags.
/// Cost: O(size).
[[nodiscard]] Result<GestureResult> edit_tree(std::string_view xml, const TreeGesture& gesture, const Kinds& kinds,
                                              const std::string& file = {});

}  // namespace sentree::design
