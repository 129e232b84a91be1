#include <algorithm>
#include <array>
#include <string>

#include "sentree/draw/chart.h"
#include "sentree/draw/detail/escape.h"
#include "sentree/draw/geometry.h"

namespace sentree::draw {
namespace {

constexpr std::array<std::string_view, 6> kKindNames = {"state", "parallel", "initial",
                                                        "final", "history",  "deep-history"};

// Children of each state, those of the drawing last.
std::vector<std::vector<int>> children_of(const Chart& chart) {
  std::vector<std::vector<int>> children(chart.states.size() + 1);
  for (std::size_t s = 0; s < chart.states.size(); ++s) {
    const int parent = chart.states[s].parent;
    children[parent < 0 ? chart.states.size() : at(parent)].push_back(static_cast<int>(s));
  }
  return children;
}

// Visits the states as nested blocks, without recursion: `open` before a state's children, `close` after them.
template <class Open, class Close>
void visit(const Chart& chart, Open open, Close close) {
  const auto children = children_of(chart);
  struct Frame {
    int state;
    std::size_t next;
  };
  std::vector<Frame> path = {{static_cast<int>(chart.states.size()), 0}};
  while (!path.empty()) {
    Frame& frame = path.back();
    const auto& here = children[at(frame.state)];
    if (frame.next < here.size()) {
      const int child = here[frame.next++];
      open(child, path.size(), children[at(child)]);
      path.push_back({child, 0});
    } else {
      const int done = frame.state;
      path.pop_back();
      if (!path.empty()) close(done, path.size(), children[at(done)]);
    }
  }
}

// Deeper nesting is written without further indentation, so that the text grows with the states only.
std::string indent(std::size_t depth) { return std::string(2 * std::min<std::size_t>(depth, 32), ' '); }

// What is written inside a state: its lines, and its transitions without target.
std::vector<std::vector<std::string>> texts_of(const Chart& chart) {
  std::vector<std::vector<std::string>> texts;
  for (const ChartState& state : chart.states) texts.push_back(state.lines);
  for (const ChartTransition& transition : chart.transitions) {
    if (transition.targets.empty()) texts[at(transition.source)].push_back(label_text(transition));
  }
  return texts;
}

std::string id(int s) { return "s" + std::to_string(s); }

std::string active_members(const Chart& chart, std::string_view separator) {
  std::string members;
  for (std::size_t s = 0; s < chart.states.size(); ++s) {
    if (!chart.states[s].active) continue;
    if (!members.empty()) members += separator;
    members += id(static_cast<int>(s));
  }
  return members;
}

std::string to_dot_state(const Chart& chart, int s, const std::vector<std::string>& texts) {
  const ChartState& state = chart.states[at(s)];
  std::string attributes;
  switch (state.kind) {
    case StateKind::kInitial: attributes = "shape=point, width=0.16, fillcolor=black"; break;
    case StateKind::kHistoryShallow: attributes = "shape=circle, label=\"H\""; break;
    case StateKind::kHistoryDeep: attributes = "shape=circle, label=\"H*\""; break;
    case StateKind::kFinal:
    case StateKind::kState:
    case StateKind::kParallel:
      attributes = "shape=box, style=\"rounded,filled\", label=\"" + dot_escape(state.name);
      for (const std::string& line : texts) attributes += "\\n" + dot_escape(line);
      attributes += "\"";
      if (state.kind == StateKind::kFinal) attributes += ", peripheries=2";
      break;
  }
  if (state.active) attributes += ", color=\"#0b62c4\", fillcolor=\"#e1efff\", penwidth=2.5";
  return id(s) + " [" + attributes + "];\n";
}

// An arrow to a cluster needs a node to end at: the first atomic state inside.
std::vector<int> anchors(const Chart& chart) {
  std::vector<int> anchor(chart.states.size());
  std::vector<bool> nests(chart.states.size(), false);
  for (std::size_t s = chart.states.size(); s > 0; --s) {
    const int i = static_cast<int>(s) - 1;
    if (!nests[at(i)]) anchor[at(i)] = i;
    const int parent = chart.states[at(i)].parent;
    if (parent < 0) continue;
    nests[at(parent)] = true;
    anchor[at(parent)] = anchor[at(i)];
  }
  return anchor;
}

bool is_inside(const Chart& chart, int s, int ancestor) {
  while (s > ancestor) s = chart.states[at(s)].parent;
  return s == ancestor;
}

// The arrows of each state's block, those of the drawing last. An arrow is written in the innermost block that holds
// both its ends: written elsewhere, it would move an end there.
template <class Write>
std::vector<std::vector<std::string>> arrows_of(const Chart& chart, Write write) {
  std::vector<std::vector<std::string>> arrows(chart.states.size() + 1);
  for (const ChartTransition& transition : chart.transitions) {
    for (std::size_t k = 0; k < transition.targets.size(); ++k) {
      int block = chart.states[at(transition.source)].parent;
      while (block >= 0 && !is_inside(chart, chart.states[at(transition.targets[k])].parent, block))
        block = chart.states[at(block)].parent;
      const bool initial = chart.states[at(transition.source)].kind == StateKind::kInitial;
      arrows[block < 0 ? chart.states.size() : at(block)].push_back(
          write(transition, initial ? "[*]" : id(transition.source), id(transition.targets[k]), k == 0));
    }
  }
  return arrows;
}

}  // namespace

std::string_view to_string(StateKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

std::string to_dot(const Chart& chart) {
  const auto texts = texts_of(chart);
  std::string out = "digraph chart {\n  compound=true;\n";
  if (!chart.title.empty()) out += "  label=\"" + dot_escape(chart.title) + "\"; labelloc=t;\n";
  out +=
      "  node [fontname=\"Helvetica\", fontsize=11, fillcolor=white];\n  edge [fontname=\"Helvetica\", fontsize=9];\n"
      "  graph [fontname=\"Helvetica\", fontsize=11, style=rounded];\n";
  visit(
      chart,
      [&](int s, std::size_t depth, const std::vector<int>& children) {
        const ChartState& state = chart.states[at(s)];
        out += indent(depth);
        if (children.empty()) {
          out += to_dot_state(chart, s, texts[at(s)]);
          return;
        }
        const bool region = state.parent >= 0 && chart.states[at(state.parent)].kind == StateKind::kParallel;
        out += "subgraph cluster_" + id(s) + " { label=\"" + dot_escape(state.name);
        for (const std::string& line : texts[at(s)]) out += "\\n" + dot_escape(line);
        out += "\"; labeljust=l;";
        out += region ? " style=dashed;" : " style=rounded;";
        if (state.active) out += " color=\"#0b62c4\"; penwidth=2.5;";
        out += "\n";
      },
      [&](int, std::size_t depth, const std::vector<int>& children) {
        if (!children.empty()) out += indent(depth) + "}\n";
      });
  const std::vector<int> anchor = anchors(chart);
  for (const ChartTransition& transition : chart.transitions) {
    bool first = true;
    for (const int target : transition.targets) {
      const int tail = anchor[at(transition.source)];
      const int head = anchor[at(target)];
      out += "  " + id(tail) + " -> " + id(head) + " [";
      if (tail != transition.source && !is_inside(chart, target, transition.source))
        out += "ltail=cluster_" + id(transition.source) + ", ";
      if (head != target && !is_inside(chart, transition.source, target)) out += "lhead=cluster_" + id(target) + ", ";
      out += "label=\"" + (first ? dot_escape(label_text(transition)) : "") + "\"";
      if (transition.last) out += ", color=\"#0b62c4\", penwidth=2.5";
      out += "];\n";
      first = false;
    }
  }
  return out + "}\n";
}

std::string to_mermaid(const Chart& chart) {
  const auto texts = texts_of(chart);
  std::string out;
  if (!chart.title.empty()) out += "---\ntitle: \"" + mermaid_escape(chart.title) + "\"\n---\n";
  out += "stateDiagram-v2\n";
  const auto arrows = arrows_of(chart, [](const ChartTransition& transition, const std::string& source,
                                          const std::string& target, bool labelled) {
    const std::string label = labelled ? mermaid_state_escape(label_text(transition)) : "";
    return source + " --> " + target + (label.empty() ? "" : " : " + label);
  });
  const auto write_arrows = [&](std::size_t block, std::size_t depth) {
    for (const std::string& arrow : arrows[block]) out += indent(depth) + arrow + "\n";
  };
  std::vector<int> seen_regions(chart.states.size(), 0);
  visit(
      chart,
      [&](int s, std::size_t depth, const std::vector<int>& children) {
        const ChartState& state = chart.states[at(s)];
        if (state.kind == StateKind::kInitial) return;
        const bool region = state.parent >= 0 && chart.states[at(state.parent)].kind == StateKind::kParallel;
        if (region && seen_regions[at(state.parent)]++ > 0) out += indent(depth) + "--\n";
        std::string_view name = state.name;
        if (state.kind == StateKind::kHistoryShallow) name = "H";
        if (state.kind == StateKind::kHistoryDeep) name = "H*";
        const std::string shown = mermaid_state_escape(name) + (state.kind == StateKind::kFinal ? " ◉" : "");
        out += indent(depth) + "state \"" + shown + "\" as " + id(s) + (children.empty() ? "\n" : " {\n");
        if (children.empty()) {
          for (const std::string& line : texts[at(s)])
            out += indent(depth) + id(s) + " : " + mermaid_state_escape(line) + "\n";
        }
      },
      [&](int s, std::size_t depth, const std::vector<int>& children) {
        if (children.empty()) return;
        write_arrows(at(s), depth + 1);
        out += indent(depth) + "}\n";
      });
  write_arrows(chart.states.size(), 1);
  if (const std::string members = active_members(chart, ","); !members.empty()) {
    out += "  classDef active fill:#e1efff,stroke:#0b62c4,stroke-width:3px\n  class " + members + " active\n";
  }
  return out;
}

std::string to_plantuml(const Chart& chart) {
  const auto texts = texts_of(chart);
  std::string out = "@startuml\nhide empty description\n";
  if (!chart.title.empty()) out += "title " + plantuml_escape(chart.title) + "\n";
  const auto arrows = arrows_of(chart, [](const ChartTransition& transition, const std::string& source,
                                          const std::string& target, bool labelled) {
    const std::string label = labelled ? plantuml_escape(label_text(transition)) : "";
    return source + (transition.last ? " -[#0b62c4,bold]-> " : " --> ") + target + (label.empty() ? "" : " : " + label);
  });
  std::vector<int> seen_regions(chart.states.size(), 0);
  visit(
      chart,
      [&](int s, std::size_t depth, const std::vector<int>& children) {
        const ChartState& state = chart.states[at(s)];
        if (state.kind == StateKind::kInitial) return;
        const bool region = state.parent >= 0 && chart.states[at(state.parent)].kind == StateKind::kParallel;
        if (region && seen_regions[at(state.parent)]++ > 0) out += indent(depth) + "--\n";
        std::string stereotype;
        switch (state.kind) {
          case StateKind::kHistoryShallow: stereotype = " <<history>>"; break;
          case StateKind::kHistoryDeep: stereotype = " <<history*>>"; break;
          case StateKind::kFinal: stereotype = " <<final>>"; break;
          case StateKind::kInitial:
          case StateKind::kState:
          case StateKind::kParallel: break;
        }
        // A final state's mark has no name; it is a state with a double name instead, so that "success" can be told
        // from "failure".
        if (state.kind == StateKind::kFinal) stereotype.clear();
        const std::string shown = plantuml_escape(state.name) + (state.kind == StateKind::kFinal ? " ◉" : "");
        out += indent(depth) + "state \"" + shown + "\" as " + id(s) + stereotype +
               (state.active ? " #e1efff;line:0b62c4;line.bold" : "") + (children.empty() ? "\n" : " {\n");
        for (const std::string& line : texts[at(s)])
          out += indent(depth + (children.empty() ? 0 : 1)) + id(s) + " : " + plantuml_escape(line) + "\n";
      },
      [&](int s, std::size_t depth, const std::vector<int>& children) {
        if (children.empty()) return;
        for (const std::string& arrow : arrows[at(s)]) out += indent(depth + 1) + arrow + "\n";
        out += indent(depth) + "}\n";
      });
  for (const std::string& arrow : arrows[chart.states.size()]) out += arrow + "\n";
  return out + "@enduml\n";
}

Value to_value(const Chart& chart, const ChartLayout& layout) {
  const auto texts = [](const std::vector<std::string>& lines) { return Value(List(lines.begin(), lines.end())); };
  const auto rect_of = [](const Rect& rect) {
    return Map{{"x", rect.x}, {"y", rect.y}, {"width", rect.width}, {"height", rect.height}};
  };
  List states;
  for (std::size_t s = 0; s < chart.states.size(); ++s) {
    const ChartState& state = chart.states[s];
    Map value = rect_of(layout.states[s]);
    value["parent"] = state.parent;
    value["kind"] = to_string(state.kind);
    value["active"] = state.active;
    value["name"] = texts(layout.names[s]);
    value["lines"] = texts(layout.lines[s]);
    states.push_back(std::move(value));
  }
  List edges;
  for (const ChartEdge& edge : layout.edges) {
    const ChartTransition& transition = chart.transitions[at(edge.transition)];
    List curve;
    for (const Point& p : edge.curve) curve.push_back(List{p.x, p.y});
    edges.push_back(Map{{"transition", edge.transition},
                        {"source", transition.source},
                        {"target", edge.target},
                        {"last", transition.last},
                        {"curve", std::move(curve)},
                        {"label", rect_of(edge.label)},
                        {"lines", texts(edge.lines)}});
  }
  List separators;
  for (const Rect& line : layout.separators) separators.push_back(List{line.x, line.y, line.right(), line.bottom()});
  return Map{{"size", Map{{"width", layout.size.width}, {"height", layout.size.height}}},
             {"states", std::move(states)},
             {"edges", std::move(edges)},
             {"separators", std::move(separators)}};
}

}  // namespace sentree::draw
