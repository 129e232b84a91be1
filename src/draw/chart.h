#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/draw/geometry.h"
#include "sentree/draw/style.h"

namespace sentree::draw {

enum class StateKind {
  kState,           ///< Atomic, or compound if it has children.
  kParallel,        ///< Its children are regions, drawn side by side with dashed lines between.
  kInitial,         ///< The filled dot; a transition leads from it to the initial state.
  kFinal,           ///< Double outline.
  kHistoryShallow,  ///< "H".
  kHistoryDeep,     ///< "H*".
};

[[nodiscard]] std::string_view to_string(StateKind kind);

struct ChartState {
  /// Index of the enclosing state, less than the state's own; -1: top level.
  int parent = -1;
  StateKind kind = StateKind::kState;
  std::string name;                ///< UTF-8; not shown for kInitial and the history kinds.
  std::vector<std::string> lines;  ///< Below the name, smaller: "entry / …", "exit / …".
  bool active = false;             ///< Part of the present configuration: coloured, with a heavier outline.
};

/// Drawn with the label `event [condition] / actions`. One without targets is written inside its state;
/// one with several has an arrow to each.
struct ChartTransition {
  int source = 0;
  std::vector<int> targets;
  std::string event;
  std::string condition;
  std::string actions;
  bool last = false;  ///< The transition taken last: coloured, with a heavier line.
};

struct Chart {
  std::string title;  ///< For screen readers, and above the drawing when not empty.
  std::vector<ChartState> states;
  std::vector<ChartTransition> transitions;
};

/// One arrow.
struct ChartEdge {
  int transition = 0;
  int target = 0;                  ///< Index of the state it leads to.
  Curve curve;                     ///< Ends at the tip of the arrow.
  Rect label;                      ///< Empty size: no label (only the first arrow of a transition has one).
  std::vector<std::string> lines;  ///< The label as wrapped and shortened.
};

/// Where things are. Deterministic: the same chart gives the same numbers, whatever fonts the machine has.
struct ChartLayout {
  Size size;
  std::vector<Rect> states;                     ///< By state index.
  std::vector<std::vector<std::string>> lines;  ///< By state index: own lines and inner transitions, wrapped.
  std::vector<std::vector<std::string>> names;  ///< By state index: the name, wrapped.
  std::vector<ChartEdge> edges;
  /// Dashed lines between the regions of parallel states, from `.x, .y` to `.x + .width, .y + .height`.
  std::vector<Rect> separators;
};

/// Text of a label or a state's name wider than this is wrapped.
inline constexpr double kChartTextWidthMax = 200;
/// Labels and names show at most this many lines of text, the last one shortened with "…".
inline constexpr int kChartLinesMax = 7;
/// Bends of arrows that one drawing routes around states. Arrows beyond are drawn straight: a chart that big
/// is not read as a picture, but it must not take minutes either.
inline constexpr int kChartBendsMax = 20'000;
/// Borders of states that the arrows of one drawing pass through. Arrows beyond are drawn straight as well.
inline constexpr int kChartPassesMax = 100'000;

/// Layered layout of each nesting level; arrows that cross a border of a state pass through a point on it.
/// States and labels of one level do not overlap; arrows keep clear of both.
///
/// Source: Sugiyama, Tagawa, Toda, "Methods for Visual Understanding of Hierarchical System Structures", 1981.
/// No recursion. Cost: near linear in states + bends for charts that people draw.
[[nodiscard]] ChartLayout layout(const Chart& chart);

/// Positions and texts as data, for a page that draws by itself: {size, states: [{x, y, width, height, parent, kind,
/// active, name, lines}], edges: [{transition, source, target, last, curve: [[x, y], …], label: {x, y, width, height},
/// lines}], separators: [[x1, y1, x2, y2]]}.
[[nodiscard]] Value to_value(const Chart& chart, const ChartLayout& layout);

/// The text of a transition's label, unwrapped: `event [condition] / actions`.
[[nodiscard]] std::string label_text(const ChartTransition& transition);

/// Each writer gives the same bytes for the same chart, and escapes every text.
[[nodiscard]] std::string to_svg(const Chart& chart, const SvgOptions& options = {});
/// Graphviz; states within states are clusters.
[[nodiscard]] std::string to_dot(const Chart& chart);
/// Mermaid `stateDiagram-v2`.
[[nodiscard]] std::string to_mermaid(const Chart& chart);
[[nodiscard]] std::string to_plantuml(const Chart& chart);

}  // namespace sentree::draw
