#include <string>

#include "sentree/draw/detail/svg.h"
#include "sentree/draw/detail/text.h"
#include "sentree/draw/detail/tree_metrics.h"
#include "sentree/draw/tree.h"

namespace sentree::draw {
namespace {

constexpr double kBadgeRadius = 8;

std::string tree_rules(const Palette& p) {
  const auto rule = [](std::string_view selector, std::string_view body) {
    return std::string(selector) + "{" + std::string(body) + "}\n";
  };
  const auto status = [&](std::string_view name, std::string_view color, std::string_view fill,
                          std::string_view outline) {
    const std::string selector = "." + std::string(name);
    return rule(selector + " .shape",
                "fill:" + std::string(fill) + ";stroke:" + std::string(color) + ";" + std::string(outline)) +
           rule(selector + " .badge", "fill:" + std::string(color)) +
           rule(selector + " .symbol", "stroke:" + std::string(color)) +
           rule(selector + " .symboltext", "fill:" + std::string(color)) +
           rule(selector + " .side", "stroke:" + std::string(color));
  };
  std::string css;
  css += rule(".link", "fill:none;stroke:" + std::string(p.line) + ";stroke-width:1.3");
  css += rule(".shape", "fill:" + std::string(p.surface) + ";stroke:" + std::string(p.line) + ";stroke-width:1.3");
  css += rule(".side", "stroke:" + std::string(p.line) + ";stroke-width:1.3");
  css += rule(".name", "fill:" + std::string(p.ink) + ";font-size:13px;font-weight:600");
  css += rule(".detail", "fill:" + std::string(p.muted) + ";font-size:11px");
  css += rule(".symbol",
              "fill:none;stroke:" + std::string(p.ink) + ";stroke-width:2;stroke-linecap:round;stroke-linejoin:round");
  css += rule(".symboltext", "fill:" + std::string(p.ink) + ";font-size:20px;font-weight:600");
  css += rule(".sign", "fill:none;stroke:" + std::string(p.surface) +
                           ";stroke-width:2;stroke-linecap:round;stroke-linejoin:round");
  css += rule(".solid", "fill:" + std::string(p.surface));
  css += status("running", p.running, p.running_fill, "stroke-width:2.6");
  css += status("success", p.success, p.success_fill, "stroke-width:1.8");
  css += status("failure", p.failure, p.failure_fill, "stroke-width:2.6");
  css += status("skipped", p.quiet, p.quiet_fill, "stroke-width:1.5;stroke-dasharray:5 4");
  css += status("halting", p.quiet, p.quiet_fill, "stroke-width:2.4;stroke-dasharray:2 3");
  return css;
}

// Signs are drawn, not written: fonts differ in which of these characters they have.
void badge(SvgWriter& svg, TreeStatus status, Point c) {
  if (status == TreeStatus::kIdle) return;
  svg.circle(c, kBadgeRadius, "badge");
  const auto path = [&](std::string_view css_class, std::initializer_list<Point> points, bool closed) {
    std::string data;
    for (const Point& p : points)
      data += (data.empty() ? "M" : "L") + coordinate(c.x + p.x) + " " + coordinate(c.y + p.y);
    svg.raw("<path class=\"" + std::string(css_class) + "\" d=\"" + data + (closed ? "Z" : "") + "\"/>\n");
  };
  switch (status) {
    case TreeStatus::kIdle: break;
    case TreeStatus::kRunning: path("solid", {{-2.5, -4}, {4.2, 0}, {-2.5, 4}}, true); break;
    case TreeStatus::kSuccess: path("sign", {{-3.8, 0.3}, {-1.1, 3.1}, {3.9, -2.9}}, false); break;
    case TreeStatus::kFailure:
      path("sign", {{-3, -3}, {3, 3}}, false);
      path("sign", {{3, -3}, {-3, 3}}, false);
      break;
    case TreeStatus::kSkipped:
      path("sign", {{-3.5, -3}, {-0.5, 0}, {-3.5, 3}}, false);
      path("sign", {{0.8, -3}, {3.8, 0}, {0.8, 3}}, false);
      break;
    case TreeStatus::kHalting: path("solid", {{-3, -3}, {3, -3}, {3, 3}, {-3, 3}}, true); break;
  }
}

void arrow(SvgWriter& svg, Point c, double length) {
  const double half = length / 2;
  svg.raw("<path class=\"symbol\" d=\"M" + coordinate(c.x - half) + " " + coordinate(c.y) + "H" +
          coordinate(c.x + half) + "M" + coordinate(c.x + half - 4.5) + " " + coordinate(c.y - 4) + "L" +
          coordinate(c.x + half) + " " + coordinate(c.y) + "L" + coordinate(c.x + half - 4.5) + " " +
          coordinate(c.y + 4) + "\"/>\n");
}

void symbol(SvgWriter& svg, std::string_view symbol, Point c) {
  if (symbol == kSequenceSymbol) {
    arrow(svg, c, 24);
  } else if (symbol == kParallelSymbol) {
    arrow(svg, {c.x, c.y - 6}, 24);
    arrow(svg, {c.x, c.y + 6}, 24);
  } else if (is_sign(symbol)) {
    svg.text({c.x, c.y + 7}, symbol, "symboltext");
  } else {
    svg.text({c.x, c.y + 4.5}, symbol, "name");
  }
}

void outline(SvgWriter& svg, TreeShape shape, const Rect& rect) {
  switch (shape) {
    case TreeShape::kControl: svg.rect(rect, 2, "shape"); break;
    case TreeShape::kDecorator: {
      // The literature's diamond, stretched to hold a text.
      const double middle = rect.center().y;
      const Point corners[] = {{rect.x + kPoint, rect.y},        {rect.right() - kPoint, rect.y},
                               {rect.right(), middle},           {rect.right() - kPoint, rect.bottom()},
                               {rect.x + kPoint, rect.bottom()}, {rect.x, middle}};
      std::string data;
      for (const Point& p : corners) data += (data.empty() ? "M" : "L") + coordinate(p.x) + " " + coordinate(p.y);
      svg.raw("<path class=\"shape\" d=\"" + data + "Z\"/>\n");
      break;
    }
    case TreeShape::kCondition: svg.ellipse(rect, "shape"); break;
    case TreeShape::kAction: svg.rect(rect, 2, "shape"); break;
    case TreeShape::kSubtree:
      svg.rect(rect, 2, "shape");
      svg.line({rect.x + kDoubleSide, rect.y}, {rect.x + kDoubleSide, rect.bottom()}, "side");
      svg.line({rect.right() - kDoubleSide, rect.y}, {rect.right() - kDoubleSide, rect.bottom()}, "side");
      break;
  }
}

}  // namespace

std::string to_svg(const Tree& tree, const SvgOptions& options) {
  const TreeLayout placed = layout(tree);
  SvgWriter svg(placed.size, tree.title, options, tree_rules);
  if (!tree.title.empty()) svg.text({16, 31}, tree.title, "name", "start");
  for (const Curve& edge : placed.edges) svg.path(edge, "link");
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const TreeNode& node = tree.nodes[i];
    const Rect& rect = placed.nodes[i];
    svg.raw("<g class=\"" + std::string(to_string(node.status)) + "\" data-node=\"" + std::to_string(i) + "\">\n");
    std::string description = node.title;
    if (node.status != TreeStatus::kIdle) description += ": " + std::string(to_string(node.status));
    for (const std::string& line : node.lines) description += "; " + line;
    svg.title(description);
    outline(svg, node.shape, rect);

    const auto& titles = placed.titles[i];
    const auto& lines = placed.lines[i];
    const double text_height = symbol_height(node.symbol) + static_cast<double>(titles.size()) * kTitleHeight +
                               static_cast<double>(lines.size()) * kLineHeight;
    const double middle = rect.center().x;
    double y = rect.center().y - text_height / 2;
    if (!node.symbol.empty()) {
      symbol(svg, node.symbol, {middle, y + symbol_height(node.symbol) / 2 - (titles.empty() ? 0 : 1)});
      y += symbol_height(node.symbol);
    }
    for (const std::string& title : titles) {
      svg.text({middle, y + kTitleHeight - 4.5}, title, "name");
      y += kTitleHeight;
    }
    for (const std::string& line : lines) {
      svg.text({middle, y + kLineHeight - 4}, line, "detail");
      y += kLineHeight;
    }
    // On the outline; of an ellipse at 60°, above the text.
    const double inset = node.shape == TreeShape::kCondition   ? rect.width * 0.25
                         : node.shape == TreeShape::kDecorator ? kPoint
                                                               : 0;
    const double drop = node.shape == TreeShape::kCondition ? rect.height * 0.067 : 0;
    badge(svg, node.status, {rect.right() - inset, rect.y + drop});
    svg.raw("</g>\n");
  }
  return std::move(svg).finish();
}

}  // namespace sentree::draw
