#include <algorithm>
#include <cstddef>

#include "sentree/base/assert.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/detail/chart_metrics.h"
#include "sentree/draw/detail/layered.h"
#include "sentree/draw/detail/text.h"
#include "sentree/draw/geometry.h"

namespace sentree::draw {
namespace {

// A point on the border of a state through which an arrow passes.
struct Port {
  bool top;
  double x = 0;  // from the left of the state
};

// The part of an arrow within one level. An end is a child of the level (with a port of that child, where the arrow
// goes on inside it), or a port of the level itself.
struct End {
  int child = -1;
  int child_port = -1;
  int own_port = -1;
};
struct Piece {
  int arrow;
  End from;
  End to;
  Curve curve;  // relative to the level's content
};

// A level is the inside of one state; level 0 is the drawing, level s + 1 the inside of state s.
struct Level {
  std::vector<int> children;
  std::vector<Port> ports;
  std::vector<Piece> pieces;
  std::vector<int> rows;  // of the children, then of the ports
  Point content;          // origin of the children's coordinates, from the corner of the state
  double content_height = 0;
  Size size;
  std::vector<double> strips;  // of a parallel state: where each region starts
  double strip_height = 0;
};

constexpr int kNowhere = -2;
struct Step {
  int level;  // a state, -1, or kNowhere
  int piece;
};
struct Arrow {
  int transition = 0;
  int source = 0;
  int target = 0;
  Step across{kNowhere, 0};
  std::vector<Step> inside_source;  // from the outermost in
  std::vector<Step> inside_target;
  std::vector<int> source_path;  // states from the end up to the child of the level that `across` is in
  std::vector<int> target_path;
  std::vector<std::string> lines;
  Size label;
};

// The arrows from a state to itself, one below the other on its right.
struct Loops {
  double width = 0;
  double height = 0;
  double drawn = 0;
};

// On one line if it fits; else event, condition and actions on lines of their own.
std::vector<std::string> label_lines(const ChartTransition& transition) {
  const std::string whole = label_text(transition);
  if (text_width(whole, kLabelSize) <= kChartTextWidthMax) return wrap(whole, kLabelSize, kChartTextWidthMax, 1);
  std::vector<std::string> lines;
  const auto add = [&](const std::string& part) {
    for (std::string& line : wrap(part, kLabelSize, kChartTextWidthMax, kChartLinesMax))
      lines.push_back(std::move(line));
  };
  add(transition.event);
  if (!transition.condition.empty()) add("[" + transition.condition + "]");
  if (!transition.actions.empty()) add("/ " + transition.actions);
  if (lines.size() > kChartLinesMax) {
    lines.resize(kChartLinesMax);
    lines.back() = wrap(lines.back() + " …", kLabelSize, kChartTextWidthMax, 1).front();
  }
  return lines;
}

class ChartPlacer {
 public:
  explicit ChartPlacer(const Chart& chart)
      : chart_(chart),
        levels_(chart.states.size() + 1),
        loops_(chart.states.size()),
        child_places_(chart.states.size()) {
    measure_texts();
    make_arrows();
    labels_.resize(arrows_.size());
    for (int s = -1; s < count(); ++s) assign_level_rows(s);
    for (int s = count() - 1; s >= -1; --s) place_level(s);
    place_states();
    place_arrows();
  }

  ChartLayout take() { return std::move(result_); }

 private:
  [[nodiscard]] int count() const { return static_cast<int>(chart_.states.size()); }
  [[nodiscard]] int parent(int s) const { return chart_.states[at(s)].parent; }
  [[nodiscard]] bool parallel(int s) const {
    return s >= 0 && chart_.states[at(s)].kind == StateKind::kParallel && !level(s).children.empty();
  }
  Level& level(int s) { return levels_[at(s + 1)]; }
  [[nodiscard]] const Level& level(int s) const { return levels_[at(s + 1)]; }

  void measure_texts() {
    depth_.resize(chart_.states.size(), 0);
    for (int s = 0; s < count(); ++s) {
      const ChartState& state = chart_.states[at(s)];
      SENTREE_ASSERT(state.parent >= -1 && state.parent < s);
      depth_[at(s)] = state.parent < 0 ? 0 : depth_[at(state.parent)] + 1;
      child_index_.push_back(static_cast<int>(level(state.parent).children.size()));
      level(state.parent).children.push_back(s);
      result_.names.push_back(wrap(state.name, kStateNameSize, kChartTextWidthMax / kStateBoldFactor, kChartLinesMax));
      result_.lines.emplace_back();
      for (const std::string& line : state.lines) add_line(s, line);
    }
    for (const ChartTransition& transition : chart_.transitions) {
      SENTREE_ASSERT(transition.source >= 0 && transition.source < count());
      if (transition.targets.empty()) add_line(transition.source, label_text(transition));
    }
  }

  void add_line(int s, const std::string& line) {
    auto& lines = result_.lines[at(s)];
    for (std::string& wrapped : wrap(line, kStateLineSize, kStateTextWidthMax, kStateTextLinesMax)) {
      if (lines.size() == kStateLinesMax) {
        lines.back() = "…";
        return;
      }
      lines.push_back(std::move(wrapped));
    }
  }

  // --- arrows and the levels they pass -------------------------------------------------------------------------------

  void make_arrows() {
    for (std::size_t t = 0; t < chart_.transitions.size(); ++t) {
      const ChartTransition& transition = chart_.transitions[t];
      for (std::size_t k = 0; k < transition.targets.size(); ++k) {
        const int target = transition.targets[k];
        SENTREE_ASSERT(target >= 0 && target < count());
        Arrow arrow;
        arrow.transition = static_cast<int>(t);
        arrow.source = transition.source;
        arrow.target = target;
        if (k == 0) {
          arrow.lines = label_lines(transition);
          for (const std::string& line : arrow.lines)
            arrow.label.width = std::max(arrow.label.width, text_width(line, kLabelSize));
          arrow.label.height = static_cast<double>(arrow.lines.size()) * kLabelHeight;
        }
        arrows_.push_back(std::move(arrow));
        if (transition.source == target) {
          Loops& loops = loops_[at(target)];
          loops.height += loop_height(arrows_.back());
          loops.width = std::max(loops.width, kLoopWidth + 6 + arrows_.back().label.width);
        } else {
          cross(static_cast<int>(arrows_.size()) - 1);
        }
      }
    }
  }

  // Adds the piece of an arrow in the innermost level that holds both ends.
  void cross(int a) {
    Arrow& arrow = arrows_[at(a)];
    int source = arrow.source;
    int target = arrow.target;
    const auto up = [&](int& s, std::vector<int>& path) {
      path.push_back(s);
      s = parent(s);
    };
    while (source != target) {
      const int source_depth = source < 0 ? -1 : depth_[at(source)];
      const int target_depth = target < 0 ? -1 : depth_[at(target)];
      if (source_depth >= target_depth) up(source, arrow.source_path);
      if (target_depth >= source_depth) up(target, arrow.target_path);
    }
    passes_ -= static_cast<int>(arrow.source_path.size() + arrow.target_path.size());
    if (passes_ < 0) return;
    const int source_child = arrow.source_path.empty() ? -1 : arrow.source_path.back();
    const int target_child = arrow.target_path.empty() ? -1 : arrow.target_path.back();
    Piece piece{a, {}, {}, {}};
    // From a state to one inside it: down from its upper border. From one inside it: down to its lower border.
    if (source_child < 0) {
      piece.from.own_port = add_port(source, true);
    } else {
      piece.from.child = source_child;
    }
    if (target_child < 0) {
      piece.to.own_port = add_port(source, false);
    } else {
      piece.to.child = target_child;
    }
    arrows_[at(a)].across = add_piece(source, std::move(piece));
  }

  int add_port(int s, bool top) {
    level(s).ports.push_back({top});
    return static_cast<int>(level(s).ports.size()) - 1;
  }

  Step add_piece(int s, Piece piece) {
    level(s).pieces.push_back(std::move(piece));
    return {s, static_cast<int>(level(s).pieces.size()) - 1};
  }

  // Rows decide on which side arrows leave and enter the states of this level, and so where they pass through borders
  // into the levels below: outer levels first.
  void assign_level_rows(int s) {
    Level& here = level(s);
    if (here.children.empty()) return;
    if (!parallel(s)) here.rows = assign_rows(layered_nodes(s), layered_edges(s));
    for (int p = 0; p < static_cast<int>(here.pieces.size()); ++p) {
      bool leaves_below = true;
      bool enters_above = false;
      if (parallel(s)) {
        const Piece& piece = here.pieces[at(p)];
        // Regions stand side by side: from one to another round below; from and to the border straight through.
        if (piece.from.own_port >= 0) enters_above = here.ports[at(piece.from.own_port)].top;
        if (piece.to.own_port >= 0) leaves_below = !here.ports[at(piece.to.own_port)].top;
      } else {
        const Piece& piece = here.pieces[at(p)];
        leaves_below = enters_above = here.rows[at(row_index(s, piece.from))] < here.rows[at(row_index(s, piece.to))];
      }
      go_inside(s, p, true, !leaves_below);
      go_inside(s, p, false, enters_above);
    }
  }

  [[nodiscard]] int row_index(int s, const End& end) const {
    return end.child >= 0 ? child_index_[at(end.child)] : static_cast<int>(level(s).children.size()) + end.own_port;
  }

  // If the arrow's end lies deeper than the child of this level, the arrow passes through the child's border.
  void go_inside(int s, int p, bool source, bool through_top) {
    Piece& piece = level(s).pieces[at(p)];
    End& end = source ? piece.from : piece.to;
    Arrow& arrow = arrows_[at(piece.arrow)];
    std::vector<int>& path = source ? arrow.source_path : arrow.target_path;
    if (end.child < 0 || path.size() < 2) return;
    path.pop_back();
    const int child = end.child;
    end.child_port = add_port(child, through_top);
    Piece inner{piece.arrow, {}, {}, {}};
    (source ? inner.from : inner.to).child = path.back();
    (source ? inner.to : inner.from).own_port = end.child_port;
    (source ? arrow.inside_source : arrow.inside_target).push_back(add_piece(child, std::move(inner)));
  }

  // --- one level -----------------------------------------------------------------------------------------------------

  // The children, the points on the border, and room for the name of the state where arrows come in beside it.
  std::vector<LayeredNode> layered_nodes(int s) {
    Level& here = level(s);
    std::vector<LayeredNode> nodes;
    for (const int child : here.children) {
      nodes.push_back({child_box(child), level(child).size.width, Pin::kNone});
    }
    bool any_top = false;
    for (const Port& port : here.ports) {
      nodes.push_back({{}, 0, port.top ? Pin::kTop : Pin::kBottom});
      any_top = any_top || port.top;
    }
    if (any_top && s >= 0) nodes.push_back({{header(s).width - 2 * kStatePaddingX, 0}, 0, Pin::kCorner});
    return nodes;
  }

  std::vector<LayeredEdge> layered_edges(int s) {
    std::vector<LayeredEdge> edges;
    for (const Piece& piece : level(s).pieces) {
      LayeredEdge edge;
      edge.from = row_index(s, piece.from);
      edge.to = row_index(s, piece.to);
      const Arrow& arrow = arrows_[at(piece.arrow)];
      if (is_across(s, piece)) edge.label = arrow.label;
      edge.from_offset = offset(piece.from);
      edge.to_offset = offset(piece.to);
      edges.push_back(edge);
    }
    return edges;
  }

  [[nodiscard]] bool is_across(int s, const Piece& piece) const {
    const Step& across = arrows_[at(piece.arrow)].across;
    return across.level == s && &level(s).pieces[at(across.piece)] == &piece;
  }

  [[nodiscard]] std::optional<double> offset(const End& end) const {
    if (end.own_port >= 0) return 0;
    if (end.child_port >= 0) return level(end.child).ports[at(end.child_port)].x;
    return std::nullopt;
  }

  // A state with the arrows to itself that stand out on its right.
  [[nodiscard]] Size child_box(int s) const {
    return {level(s).size.width + loops_[at(s)].width, level(s).size.height};
  }
  static double loop_height(const Arrow& arrow) { return std::max(arrow.label.height, kLoopWidth) + 8; }

  // Name and lines of a state: what stands above the states within it, or is all of it.
  [[nodiscard]] Size header(int s) const {
    const auto& names = result_.names[at(s)];
    const auto& lines = result_.lines[at(s)];
    Size size;
    for (const std::string& name : names)
      size.width = std::max(size.width, kStateBoldFactor * text_width(name, kStateNameSize));
    for (const std::string& line : lines) size.width = std::max(size.width, text_width(line, kStateLineSize));
    size.width += 2 * kStatePaddingX;
    size.height = 2 * kStatePaddingY + static_cast<double>(names.size()) * kStateNameHeight +
                  static_cast<double>(lines.size()) * kStateLineHeight;
    if (!names.empty() && !lines.empty()) size.height += kStateRule;
    return size;
  }

  void place_level(int s) {
    Level& here = level(s);
    if (s >= 0 && here.children.empty()) {
      here.size = leaf_size(s);
    } else if (parallel(s)) {
      place_regions(s);
    } else {
      const Size head = s >= 0 ? header(s) : Size{0, chart_.title.empty() ? 0 : kChartTitleBlock};
      const double padding = s >= 0 ? kNestPadding : kChartMargin;
      const LayeredDrawing drawing = place(layered_nodes(s), layered_edges(s), here.rows, bends_);
      here.content = {padding, s >= 0 ? head.height + (has_top_port(here) ? 0 : 2) : head.height + kChartMargin};
      here.content_height = drawing.size.height;
      for (std::size_t k = 0; k < here.children.size(); ++k)
        child_place(here.children[k]) = {drawing.nodes[k].x, drawing.nodes[k].y};
      for (std::size_t p = 0; p < here.ports.size(); ++p)
        here.ports[p].x = here.content.x + drawing.nodes[here.children.size() + p].x;
      for (std::size_t p = 0; p < here.pieces.size(); ++p) {
        here.pieces[p].curve = drawing.curves[p];
        if (is_across(s, here.pieces[p])) labels(here.pieces[p].arrow) = drawing.labels[p];
      }
      here.size = {std::max(drawing.size.width + 2 * padding, head.width),
                   here.content.y + drawing.size.height + padding};
      if (s < 0)
        here.size.width =
            std::max(here.size.width, 2 * padding + kStateBoldFactor * text_width(chart_.title, kStateNameSize));
    }
    if (s >= 0) here.size.height = std::max(here.size.height, loops_[at(s)].height);
  }

  static bool has_top_port(const Level& here) {
    return std::any_of(here.ports.begin(), here.ports.end(), [](const Port& port) { return port.top; });
  }

  Point& child_place(int s) { return child_places_[at(s)]; }
  Rect& labels(int a) { return labels_[at(a)]; }

  [[nodiscard]] Size leaf_size(int s) const {
    switch (chart_.states[at(s)].kind) {
      case StateKind::kInitial: return {kInitialSize, kInitialSize};
      case StateKind::kHistoryShallow:
      case StateKind::kHistoryDeep: return {kHistorySize, kHistorySize};
      case StateKind::kState:
      case StateKind::kParallel:
      case StateKind::kFinal: break;
    }
    const Size text = header(s);
    const double inset = chart_.states[at(s)].kind == StateKind::kFinal ? 2 * kFinalInset : 0;
    return {std::max(text.width + inset, kStateWidthMin), std::max(text.height + inset, kStateHeightMin)};
  }

  // Regions side by side, of one height; below them, tracks for arrows from one to another. A region without states
  // inside is drawn as the state it is, in a strip of its own.
  void place_regions(int s) {
    Level& here = level(s);
    const Size head = header(s);
    here.content = {0, head.height};
    double x = 0;
    double height = 0;
    for (const int child : here.children) {
      const double padding = level(child).children.empty() ? kNestPadding : 0;
      here.strips.push_back(x);
      child_place(child) = {x + padding, padding};
      x += child_box(child).width + 2 * padding;
      height = std::max(height, level(child).size.height + 2 * padding);
    }
    const double width = std::max(x, head.width);
    for (const int child : here.children) {
      if (!level(child).children.empty()) level(child).size.height = height;
    }
    here.strip_height = height;
    double track = height;
    for (Piece& piece : here.pieces) {
      const auto across = [&](const End& end) {
        const Level& region = level(end.child);
        return child_place(end.child).x +
               (end.child_port >= 0 ? region.ports[at(end.child_port)].x : region.size.width / 2);
      };
      const auto side = [&](const End& end, bool top) {
        return child_place(end.child).y + (top ? 0 : level(end.child).size.height);
      };
      if (piece.from.own_port >= 0 || piece.to.own_port >= 0) {
        const End& inside = piece.from.own_port >= 0 ? piece.to : piece.from;
        Port& port = here.ports[at(piece.from.own_port >= 0 ? piece.from.own_port : piece.to.own_port)];
        port.x = across(inside);
        piece.curve.push_back({port.x, side(inside, port.top)});
      } else {
        const Size label = arrows_[at(piece.arrow)].label;
        const double y = track + std::max(label.height, 6.0) + 8;
        const double from = across(piece.from);
        const double to = across(piece.to);
        piece.curve = {{from, side(piece.from, false)}};
        line_to(piece.curve, {from, y - 8});
        const double turn = from < to ? 8 : -8;
        piece.curve.insert(piece.curve.end(), {{from, y}, {from, y}, {from + turn, y}});
        line_to(piece.curve, {to - turn, y});
        piece.curve.insert(piece.curve.end(), {{to, y}, {to, y}, {to, y - 8}});
        line_to(piece.curve, {to, side(piece.to, false)});
        labels(piece.arrow) = {(from + to - label.width) / 2, y - 3 - label.height, label.width, label.height};
        track = y + 2;
      }
    }
    here.content_height = track > height ? track + 8 : height;
    // An arrow from a region itself to the parallel state around it needs some way to go.
    const bool to_border =
        std::any_of(here.ports.begin(), here.ports.end(), [](const Port& port) { return !port.top; });
    if (to_border) here.content_height = std::max(here.content_height, height + kNestPadding);
    here.size = {width, head.height + here.content_height};
  }

  // --- the whole -----------------------------------------------------------------------------------------------------

  void place_states() {
    result_.size = level(-1).size;
    result_.states.resize(chart_.states.size());
    for (int s = 0; s < count(); ++s) {
      const Point origin = content_origin(parent(s));
      Rect& rect = result_.states[at(s)];
      rect = {origin.x + child_place(s).x, origin.y + child_place(s).y, level(s).size.width, level(s).size.height};
      if (parallel(s)) {
        const Level& here = level(s);
        const double top = rect.y + here.content.y;
        for (std::size_t k = 1; k < here.strips.size(); ++k)
          result_.separators.push_back({rect.x + here.strips[k], top, 0, here.strip_height});
        result_.separators.push_back({rect.x, top, rect.width, 0});
      }
    }
  }

  [[nodiscard]] Point content_origin(int s) const {
    const Level& here = level(s);
    if (s < 0) return here.content;
    return {result_.states[at(s)].x + here.content.x, result_.states[at(s)].y + here.content.y};
  }

  void place_arrows() {
    for (int a = 0; a < static_cast<int>(arrows_.size()); ++a) {
      Arrow& arrow = arrows_[at(a)];
      ChartEdge edge;
      edge.transition = arrow.transition;
      edge.target = arrow.target;
      edge.lines = std::move(arrow.lines);
      if (arrow.source == arrow.target) {
        loop(a, edge);
      } else if (arrow.across.level == kNowhere) {
        straight(arrow, edge);
      } else {
        for (std::size_t k = arrow.inside_source.size(); k > 0; --k) append(edge.curve, arrow.inside_source[k - 1]);
        append(edge.curve, arrow.across);
        for (const Step& step : arrow.inside_target) append(edge.curve, step);
        if (arrow.label.width > 0) {
          const Point origin = content_origin(arrow.across.level);
          edge.label = labels(a);
          edge.label.x += origin.x;
          edge.label.y += origin.y;
        }
      }
      result_.edges.push_back(std::move(edge));
    }
  }

  void append(Curve& curve, const Step& step) {
    const Level& here = level(step.level);
    const Piece& piece = here.pieces[at(step.piece)];
    const Point origin = content_origin(step.level);
    const auto border = [&](const End& end) {
      const Port& port = here.ports[at(end.own_port)];
      const Rect& state = result_.states[at(step.level)];
      return Point{state.x + port.x, port.top ? state.y : state.bottom()};
    };
    const auto to = [&](Point p) {
      if (curve.empty()) {
        curve.push_back(p);
      } else {
        line_to(curve, p);
      }
    };
    if (piece.from.own_port >= 0) to(border(piece.from));
    to({piece.curve[0].x + origin.x, piece.curve[0].y + origin.y});
    for (std::size_t k = 1; k + 2 < piece.curve.size(); k += 3) {
      const auto absolute = [&](std::size_t i) {
        return Point{piece.curve[i].x + origin.x, piece.curve[i].y + origin.y};
      };
      const Point from = curve.back();
      const bool vertical = from.x == absolute(k).x && from.x == absolute(k + 1).x && from.x == absolute(k + 2).x;
      if (vertical) {
        line_to(curve, absolute(k + 2));
      } else {
        curve.insert(curve.end(), {absolute(k), absolute(k + 1), absolute(k + 2)});
      }
    }
    if (piece.to.own_port >= 0) to(border(piece.to));
  }

  // Beyond the bound: from border to border, whatever is in between.
  void straight(const Arrow& arrow, ChartEdge& edge) {
    const Rect& source = result_.states[at(arrow.source)];
    const Rect& target = result_.states[at(arrow.target)];
    const bool down = source.y < target.y;
    edge.curve = {{source.center().x, down ? source.bottom() : source.y}};
    line_to(edge.curve, {target.center().x, down ? target.y : target.bottom()});
    if (arrow.label.width > 0)
      edge.label = {edge.curve.front().x, edge.curve.front().y, arrow.label.width, arrow.label.height};
  }

  // An arrow from a state to itself, on its right, below those before it.
  void loop(int a, ChartEdge& edge) {
    const int s = edge.target;
    const Rect& state = result_.states[at(s)];
    Loops& loops = loops_[at(s)];
    const double height = loop_height(arrows_[at(a)]);
    const double middle = state.y + (state.height - loops.height) / 2 + loops.drawn + height / 2;
    loops.drawn += height;
    const double reach = state.right() + kLoopWidth;
    edge.curve = {
        {state.right(), middle - 9}, {reach + 6, middle - 14}, {reach + 6, middle + 14}, {state.right(), middle + 9}};
    const Size label = arrows_[at(a)].label;
    if (label.width > 0) edge.label = {reach + 4, middle - label.height / 2, label.width, label.height};
  }

  // Of one text inside a state, and of all of them.
  static constexpr double kStateTextWidthMax = 240;
  static constexpr int kStateTextLinesMax = 3;
  static constexpr std::size_t kStateLinesMax = 16;

  const Chart& chart_;
  std::vector<Level> levels_;
  std::vector<int> depth_;
  std::vector<int> child_index_;  // of a state among its parent's children
  std::vector<Arrow> arrows_;
  std::vector<Loops> loops_;         // by state
  std::vector<Point> child_places_;  // by state, relative to the content of the level above
  std::vector<Rect> labels_;         // by arrow, relative to the content of its level
  int bends_ = kChartBendsMax;
  int passes_ = kChartPassesMax;
  ChartLayout result_;
};

}  // namespace

std::string label_text(const ChartTransition& transition) {
  std::string text = transition.event;
  const auto add = [&](const std::string& part) {
    if (!text.empty()) text += ' ';
    text += part;
  };
  if (!transition.condition.empty()) add("[" + transition.condition + "]");
  if (!transition.actions.empty()) add("/ " + transition.actions);
  return text;
}

ChartLayout layout(const Chart& chart) { return ChartPlacer(chart).take(); }

}  // namespace sentree::draw
