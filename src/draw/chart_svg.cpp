#include <cmath>
#include <string>

#include "sentree/draw/chart.h"
#include "sentree/draw/detail/chart_metrics.h"
#include "sentree/draw/detail/svg.h"
#include "sentree/draw/detail/text.h"

namespace sentree::draw {
namespace {

constexpr double kCornerRadius = 9;
constexpr double kHeadLength = 9;
constexpr double kHeadWidth = 3.6;

std::string chart_rules(const Palette& p) {
  const auto rule = [](std::string_view selector, std::string_view property, std::string_view color,
                       std::string_view more) {
    return std::string(selector) + "{" + std::string(property) + ":" + std::string(color) + (more.empty() ? "" : ";") +
           std::string(more) + "}\n";
  };
  std::string css;
  css += rule(".state", "fill", p.surface, "stroke:" + std::string(p.line) + ";stroke-width:1.3");
  css += rule(".nest", "fill", p.nested, "stroke:" + std::string(p.line) + ";stroke-width:1.3");
  css += rule(".active", "stroke", p.running, "stroke-width:2.6");
  css += rule(".state.active", "fill", p.running_fill, "");
  css += rule(".inner", "stroke", p.line, "fill:none;stroke-width:1.1");
  css += rule(".inner.active", "stroke", p.running, "stroke-width:1.6");
  css += rule(".rule", "stroke", p.line, "stroke-width:0.8");
  css += rule(".region", "stroke", p.line, "stroke-width:1.2;stroke-dasharray:6 4");
  css += rule(".dot", "fill", p.ink, "");
  css += rule(".name", "fill", p.ink, "font-size:13px;font-weight:600");
  css += rule(".detail", "fill", p.muted, "font-size:11px");
  css += rule(".arrow", "stroke", p.line, "fill:none;stroke-width:1.3");
  css += rule(".head", "fill", p.line, "");
  css += rule(".label", "fill", p.ink, "font-size:11px");
  css += rule(".arrow.last", "stroke", p.running, "stroke-width:2.8");
  css += rule(".head.last", "fill", p.running, "");
  css += rule(".label.last", "fill", p.running, "");
  css += rule(".badge", "fill", p.running, "");
  css += rule(".solid", "fill", p.surface, "");
  return css;
}

class Drawer {
 public:
  Drawer(const Chart& chart, const SvgOptions& options)
      : chart_(chart),
        layout_(layout(chart)),
        svg_(layout_.size, chart.title, options, chart_rules),
        nests_(chart.states.size(), false) {
    for (const ChartState& state : chart.states) {
      if (state.parent >= 0) nests_[static_cast<std::size_t>(state.parent)] = true;
    }
  }

  std::string draw() {
    if (!chart_.title.empty()) svg_.text({kChartMargin, kChartMargin + 15}, chart_.title, "name", "start");
    // What holds others first, then arrows, then what they lead to: nothing hides a text.
    for (std::size_t s = 0; s < chart_.states.size(); ++s) {
      if (nests_[s]) state(s);
    }
    for (const Rect& line : layout_.separators) svg_.line({line.x, line.y}, {line.right(), line.bottom()}, "region");
    for (const bool last : {false, true}) {
      for (const ChartEdge& edge : layout_.edges) {
        if (transition(edge).last == last) arrow(edge);
      }
    }
    for (std::size_t s = 0; s < chart_.states.size(); ++s) {
      if (!nests_[s]) state(s);
    }
    for (const ChartEdge& edge : layout_.edges) label(edge);
    return std::move(svg_).finish();
  }

 private:
  [[nodiscard]] const ChartTransition& transition(const ChartEdge& edge) const {
    return chart_.transitions[static_cast<std::size_t>(edge.transition)];
  }

  [[nodiscard]] bool is_region(const ChartState& state) const {
    return state.parent >= 0 && chart_.states[static_cast<std::size_t>(state.parent)].kind == StateKind::kParallel;
  }

  void state(std::size_t s) {
    const ChartState& state = chart_.states[s];
    const Rect& rect = layout_.states[s];
    const std::string active = state.active ? " active" : "";
    svg_.raw("<g data-state=\"" + std::to_string(s) + "\">\n");
    svg_.title((state.name.empty() ? std::string(to_string(state.kind)) : state.name) +
               (state.active ? ": active" : ""));
    switch (state.kind) {
      case StateKind::kInitial: svg_.circle(rect.center(), kInitialSize / 2, "dot"); break;
      case StateKind::kHistoryShallow:
      case StateKind::kHistoryDeep:
        svg_.circle(rect.center(), kHistorySize / 2, "state");
        svg_.text({rect.center().x, rect.center().y + 4.5}, state.kind == StateKind::kHistoryDeep ? "H*" : "H", "name");
        break;
      case StateKind::kFinal:
        svg_.rect(rect, kCornerRadius, "state" + active);
        svg_.rect(
            {rect.x + kFinalInset, rect.y + kFinalInset, rect.width - 2 * kFinalInset, rect.height - 2 * kFinalInset},
            kCornerRadius - kFinalInset, "inner" + active);
        texts(s);
        break;
      case StateKind::kState:
      case StateKind::kParallel:
        // A region with states inside has the dashed lines for an outline.
        if (!nests_[s] || !is_region(state)) svg_.rect(rect, kCornerRadius, (nests_[s] ? "nest" : "state") + active);
        texts(s);
        break;
    }
    if (state.active && !nests_[s]) {
      const Point c{rect.right() - 2, rect.y + 2};
      svg_.circle(c, 8, "badge");
      svg_.raw("<path class=\"solid\" d=\"M" + coordinate(c.x - 2.5) + " " + coordinate(c.y - 4) + "L" +
               coordinate(c.x + 4.2) + " " + coordinate(c.y) + "L" + coordinate(c.x - 2.5) + " " + coordinate(c.y + 4) +
               "Z\"/>\n");
    }
    svg_.raw("</g>\n");
  }

  // The name, and below a rule the lines; a lone name stands in the middle.
  void texts(std::size_t s) {
    const Rect& rect = layout_.states[s];
    const auto& names = layout_.names[s];
    const auto& lines = layout_.lines[s];
    const bool centred = !nests_[s];
    double y = rect.y + kStatePaddingY;
    if (centred) {
      const double height = static_cast<double>(names.size()) * kStateNameHeight +
                            static_cast<double>(lines.size()) * kStateLineHeight +
                            (names.empty() || lines.empty() ? 0 : kStateRule);
      y = rect.center().y - height / 2;
    }
    for (const std::string& name : names) {
      svg_.text({centred ? rect.center().x : rect.x + kStatePaddingX, y + kStateNameHeight - 5}, name, "name",
                centred ? "middle" : "start");
      y += kStateNameHeight;
    }
    if (!names.empty() && !lines.empty()) {
      if (centred) {
        const double inset = chart_.states[s].kind == StateKind::kFinal ? kFinalInset : 0;
        svg_.line({rect.x + inset, y + kStateRule / 2}, {rect.right() - inset, y + kStateRule / 2}, "rule");
      }
      y += kStateRule;
    }
    const double inset = chart_.states[s].kind == StateKind::kFinal ? kFinalInset : 0;
    for (const std::string& line : lines) {
      svg_.text({rect.x + kStatePaddingX + inset, y + kStateLineHeight - 4}, line, "detail", "start");
      y += kStateLineHeight;
    }
  }

  void arrow(const ChartEdge& edge) {
    if (edge.curve.size() < 4) return;
    const std::string last = transition(edge).last ? " last" : "";
    Curve curve = edge.curve;
    const Point tip = curve.back();
    // The direction of arrival: from the nearest point that is not the tip itself.
    Point before = tip;
    for (std::size_t i = curve.size(); i > 0 && before == tip; --i) before = curve[i - 1];
    const double length = std::hypot(tip.x - before.x, tip.y - before.y);
    const Point along = length > 0 ? Point{(tip.x - before.x) / length, (tip.y - before.y) / length} : Point{0, 1};
    const Point neck{tip.x - along.x * kHeadLength, tip.y - along.y * kHeadLength};
    curve.back() = {tip.x - along.x * kHeadLength * 0.8, tip.y - along.y * kHeadLength * 0.8};
    svg_.path(curve, "arrow" + last);
    svg_.raw("<path class=\"head" + last + "\" d=\"M" + coordinate(tip.x) + " " + coordinate(tip.y) + "L" +
             coordinate(neck.x - along.y * kHeadWidth) + " " + coordinate(neck.y + along.x * kHeadWidth) + "L" +
             coordinate(neck.x + along.y * kHeadWidth) + " " + coordinate(neck.y - along.x * kHeadWidth) + "Z\"/>\n");
  }

  void label(const ChartEdge& edge) {
    if (edge.lines.empty()) return;
    svg_.raw("<g>\n");
    svg_.title(label_text(transition(edge)));  // unshortened
    double y = edge.label.y;
    for (const std::string& line : edge.lines) {
      svg_.text({edge.label.x, y + kLabelHeight - 4}, line, transition(edge).last ? "label last" : "label", "start");
      y += kLabelHeight;
    }
    svg_.raw("</g>\n");
  }

  const Chart& chart_;
  ChartLayout layout_;
  SvgWriter svg_;
  std::vector<bool> nests_;
};

}  // namespace

std::string to_svg(const Chart& chart, const SvgOptions& options) { return Drawer(chart, options).draw(); }

}  // namespace sentree::draw
