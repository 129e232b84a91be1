#include <array>
#include <string>

#include "sentree/draw/detail/escape.h"
#include "sentree/draw/tree.h"

namespace sentree::draw {
namespace {

constexpr std::array<std::string_view, 5> kShapeNames = {"control", "decorator", "condition", "action", "subtree"};
constexpr std::array<std::string_view, 6> kStatusNames = {"idle",    "running", "success",
                                                          "failure", "skipped", "halting"};
// ✓ and friends beside the name: the status is readable without colour. They are data for a renderer that picks the
// font.
constexpr std::array<std::string_view, 6> kStatusSigns = {"", " ▶", " ✓", " ✗", " »", " ■"};
constexpr std::array<std::string_view, 6> kStatusColors = {"#6e7781", "#0b62c4", "#11703a",
                                                           "#b8340c", "#7a5a00", "#7a5a00"};
constexpr std::array<std::string_view, 6> kStatusFills = {"#ffffff", "#e1efff", "#e2f5e8",
                                                          "#ffeae2", "#fbf3d5", "#fbf3d5"};

std::size_t index(TreeStatus status) { return static_cast<std::size_t>(status); }

std::string label(const TreeNode& node, std::string_view line_break, std::string (*escape)(std::string_view)) {
  std::string text = escape(node.symbol);
  const auto add = [&](std::string_view line) {
    if (!text.empty()) text += line_break;
    text += escape(line);
  };
  if (!node.title.empty() || node.status != TreeStatus::kIdle)
    add(node.title + std::string(kStatusSigns[index(node.status)]));
  for (const std::string& line : node.lines) add(line);
  return text;
}

}  // namespace

std::string_view to_string(TreeStatus status) { return kStatusNames[index(status)]; }

std::string to_dot(const Tree& tree) {
  std::string out = "digraph tree {\n  ordering=out;\n";
  if (tree.direction == Direction::kRight) out += "  rankdir=LR;\n";
  if (!tree.title.empty()) out += "  label=\"" + dot_escape(tree.title) + "\"; labelloc=t;\n";
  out += "  node [fontname=\"Helvetica\", fontsize=11, style=filled, fillcolor=white];\n  edge [arrowhead=none];\n";
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const TreeNode& node = tree.nodes[i];
    std::string_view shape = "shape=box";
    switch (node.shape) {
      case TreeShape::kControl: break;
      case TreeShape::kDecorator: shape = "shape=hexagon"; break;
      case TreeShape::kCondition: shape = "shape=ellipse"; break;
      case TreeShape::kAction: break;
      case TreeShape::kSubtree: shape = "shape=box, peripheries=2"; break;
    }
    out += "  n" + std::to_string(i) + " [" + std::string(shape) + ", label=\"" + label(node, "\\n", dot_escape) + "\"";
    if (node.status != TreeStatus::kIdle) {
      out += ", color=\"" + std::string(kStatusColors[index(node.status)]) + "\", fillcolor=\"" +
             std::string(kStatusFills[index(node.status)]) + "\", penwidth=2";
    }
    out += "];\n";
  }
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    if (tree.nodes[i].parent >= 0)
      out += "  n" + std::to_string(tree.nodes[i].parent) + " -> n" + std::to_string(i) + ";\n";
  }
  return out + "}\n";
}

std::string to_mermaid(const Tree& tree) {
  std::string out;
  if (!tree.title.empty()) out += "---\ntitle: \"" + mermaid_escape(tree.title) + "\"\n---\n";
  out += tree.direction == Direction::kRight ? "flowchart LR\n" : "flowchart TD\n";
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const TreeNode& node = tree.nodes[i];
    std::string_view open = "[";
    std::string_view close = "]";
    switch (node.shape) {
      case TreeShape::kControl: break;
      case TreeShape::kDecorator:
        open = "{{";
        close = "}}";
        break;
      case TreeShape::kCondition:
        open = "([";
        close = "])";
        break;
      case TreeShape::kAction: break;
      case TreeShape::kSubtree:
        open = "[[";
        close = "]]";
        break;
    }
    out += "  n" + std::to_string(i) + std::string(open) + "\"" + label(node, "<br/>", mermaid_escape) + "\"" +
           std::string(close) + "\n";
  }
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    if (tree.nodes[i].parent >= 0)
      out += "  n" + std::to_string(tree.nodes[i].parent) + " --- n" + std::to_string(i) + "\n";
  }
  for (std::size_t s = 1; s < kStatusNames.size(); ++s) {
    std::string members;
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
      if (index(tree.nodes[i].status) == s) members += (members.empty() ? "n" : ",n") + std::to_string(i);
    }
    if (members.empty()) continue;
    out += "  classDef " + std::string(kStatusNames[s]) + " stroke:" + std::string(kStatusColors[s]) +
           ",stroke-width:2px\n";
    out += "  class " + members + " " + std::string(kStatusNames[s]) + "\n";
  }
  return out;
}

Value to_value(const Tree& tree, const TreeLayout& layout) {
  const auto texts = [](const std::vector<std::string>& lines) { return Value(List(lines.begin(), lines.end())); };
  List nodes;
  List edges;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const TreeNode& node = tree.nodes[i];
    const Rect& rect = layout.nodes[i];
    nodes.push_back(Map{{"x", rect.x},
                        {"y", rect.y},
                        {"width", rect.width},
                        {"height", rect.height},
                        {"parent", node.parent},
                        {"shape", kShapeNames[static_cast<std::size_t>(node.shape)]},
                        {"status", to_string(node.status)},
                        {"symbol", node.symbol},
                        {"title", texts(layout.titles[i])},
                        {"lines", texts(layout.lines[i])}});
    List points;
    for (const Point& p : layout.edges[i]) points.push_back(List{p.x, p.y});
    edges.push_back(std::move(points));
  }
  return Map{{"size", Map{{"width", layout.size.width}, {"height", layout.size.height}}},
             {"nodes", std::move(nodes)},
             {"edges", std::move(edges)}};
}

}  // namespace sentree::draw
