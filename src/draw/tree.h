#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/draw/geometry.h"
#include "sentree/draw/style.h"

namespace sentree::draw {

/// How a node looks. As in Colledanchise & Ögren, "Behavior Trees in Robotics and AI", 2018: boxes with a symbol,
/// ellipses for conditions, rectangles for actions.
enum class TreeShape {
  kControl,    ///< Box with the symbol.
  kDecorator,  ///< Diamond, stretched to hold its text.
  kCondition,  ///< Ellipse.
  kAction,     ///< Rectangle.
  kSubtree,    ///< Rectangle with double sides.
};

/// Shown by colour, by the weight or dashes of the outline, and by a badge with a sign: readable without colour.
enum class TreeStatus { kIdle, kRunning, kSuccess, kFailure, kSkipped, kHalting };

[[nodiscard]] std::string_view to_string(TreeStatus status);

/// Symbols of the literature, for `TreeNode::symbol`. Others are drawn as text.
inline constexpr std::string_view kSequenceSymbol = "→";
inline constexpr std::string_view kFallbackSymbol = "?";
inline constexpr std::string_view kParallelSymbol = "⇉";

struct TreeNode {
  /// Index of the parent, less than the node's own; -1: a root. Children are drawn in the order of their indices.
  int parent = -1;
  TreeShape shape = TreeShape::kAction;
  std::string symbol;              ///< Only for kControl and kDecorator; may be empty.
  std::string title;               ///< First line, e.g. the node's name. UTF-8.
  std::vector<std::string> lines;  ///< Further lines, smaller: type, ports. UTF-8.
  TreeStatus status = TreeStatus::kIdle;
};

/// One tree, or several side by side.
struct Tree {
  std::string title;  ///< For screen readers, and above the drawing when not empty.
  std::vector<TreeNode> nodes;
  Direction direction = Direction::kDown;
};

/// Where things are. Deterministic: the same tree gives the same numbers, whatever fonts the machine has.
struct TreeLayout {
  Size size;                                     ///< Of the drawing with its margins.
  std::vector<Rect> nodes;                       ///< By node index.
  std::vector<Curve> edges;                      ///< By node index: from the parent to the node; empty for a root.
  std::vector<std::vector<std::string>> lines;   ///< By node index: `TreeNode::lines` as wrapped and shortened to fit.
  std::vector<std::vector<std::string>> titles;  ///< By node index: the title, wrapped.
};

/// A line of text wider than this is wrapped, then shortened with "…".
inline constexpr double kTreeTextWidthMax = 190;
/// A node shows at most this many lines of each kind.
inline constexpr int kTreeLinesMax = 12;

/// Compact tidy layout: no overlaps, order kept, a parent centred over its children, equal subtrees drawn equally.
///
/// Time and memory O(nodes + text). No recursion: depth is not bounded by the stack.
/// Source: van der Ploeg, "Drawing Non-layered Tidy Trees in Linear Time", 2014.
[[nodiscard]] TreeLayout layout(const Tree& tree);

/// Down, as in the literature, unless the drawing would be a long stripe and one to the right would be less of one.
/// Cost: two layouts.
[[nodiscard]] Direction best_direction(const Tree& tree);

/// Positions, shapes and texts as data, for a page that draws by itself:
/// {size: {width, height}, nodes: [{x, y, width, height, parent, shape, status, symbol, title: […], lines: […]}],
/// edges: [[[x, y], …]]}.
[[nodiscard]] Value to_value(const Tree& tree, const TreeLayout& layout);

/// Each writer gives the same bytes for the same tree, and escapes every text.
[[nodiscard]] std::string to_svg(const Tree& tree, const SvgOptions& options = {});
/// Graphviz.
[[nodiscard]] std::string to_dot(const Tree& tree);
/// Mermaid `flowchart`.
[[nodiscard]] std::string to_mermaid(const Tree& tree);

}  // namespace sentree::draw
