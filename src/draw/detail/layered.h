#pragma once

#include <optional>
#include <vector>

#include "sentree/draw/geometry.h"

namespace sentree::draw {

/// Layered drawing of one directed graph: rows from top to bottom, edges mostly downwards.
///
/// Source: Sugiyama, Tagawa, Toda, "Methods for Visual Understanding of Hierarchical System Structures", 1981; rows for
/// edge labels after Gansner, Koutsofios, North, Vo, "A Technique for Drawing Directed Graphs", 1993.

/// Where a node must stand.
enum class Pin {
  kNone,
  kTop,     ///< Point on the upper border: in the first row.
  kBottom,  ///< Point on the lower border: in the last row.
  kCorner,  ///< At the left end of the first row: room that points on the border keep clear of.
};

struct LayeredNode {
  Size size;
  /// Edges attach to this part of the box, from its left; the rest is room for what belongs to the node.
  double body_width = 0;
  Pin pin = Pin::kNone;
};

struct LayeredEdge {
  int from = 0;
  int to = 0;  ///< Not `from`.
  Size label;  ///< Zero width: none.
  /// Fixed place of an end, from the left of the node's box; otherwise ends spread over the body.
  std::optional<double> from_offset;
  std::optional<double> to_offset;
};

/// The row of each node, from 0. No edge lies within a row; one whose `from` is in the higher row leaves below it and
/// enters its `to` from above, any other leaves above and enters from below.
///
/// Deterministic; keeps to the order of indices where it can. O(nodes + edges). Sizes and offsets are not looked at.
[[nodiscard]] std::vector<int> assign_rows(const std::vector<LayeredNode>& nodes,
                                           const std::vector<LayeredEdge>& edges);

struct LayeredDrawing {
  Size size;
  std::vector<Rect> nodes;    ///< By node.
  std::vector<Curve> curves;  ///< By edge, from `from` to `to`.
  std::vector<Rect> labels;   ///< By edge; empty where there is none.
};

/// Positions for the given rows. Boxes and labels do not overlap, and edges keep clear of boxes: except those edges for
/// which `bends` (decreased by what is used) does not suffice; they are drawn straight.
[[nodiscard]] LayeredDrawing place(const std::vector<LayeredNode>& nodes, const std::vector<LayeredEdge>& edges,
                                   const std::vector<int>& rows, int& bends);

/// Appends a straight piece to `to`; joins it with a straight piece before it in the same direction, up or down.
void line_to(Curve& curve, Point to);

}  // namespace sentree::draw
