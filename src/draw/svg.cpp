#include "sentree/draw/detail/svg.h"

#include <utility>

#include "sentree/draw/detail/text.h"

namespace sentree::draw {

const Palette& light_palette() {
  static constexpr Palette kPalette = {.background = "#ffffff",
                                       .surface = "#ffffff",
                                       .nested = "#f6f8fa",
                                       .ink = "#1f2328",
                                       .muted = "#59636e",
                                       .line = "#6e7781",
                                       .running = "#0b62c4",
                                       .running_fill = "#e1efff",
                                       .success = "#11703a",
                                       .success_fill = "#e2f5e8",
                                       .failure = "#b8340c",
                                       .failure_fill = "#ffeae2",
                                       .quiet = "#7a5a00",
                                       .quiet_fill = "#fbf3d5"};
  return kPalette;
}

const Palette& dark_palette() {
  static constexpr Palette kPalette = {.background = "#0f141a",
                                       .surface = "#1c232c",
                                       .nested = "#161c24",
                                       .ink = "#e8edf2",
                                       .muted = "#a3aeb9",
                                       .line = "#8b96a1",
                                       .running = "#6cb2ff",
                                       .running_fill = "#12304f",
                                       .success = "#5fd08a",
                                       .success_fill = "#123524",
                                       .failure = "#ff9471",
                                       .failure_fill = "#43210f",
                                       .quiet = "#e0b94a",
                                       .quiet_fill = "#352b0d"};
  return kPalette;
}

SvgWriter::SvgWriter(Size size, std::string_view title, const SvgOptions& options,
                     std::string (*rules)(const Palette&)) {
  const std::string width = coordinate(size.width);
  const std::string height = coordinate(size.height);
  out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" + height + "\" viewBox=\"0 0 " +
         width + " " + height +
         "\" role=\"img\" font-family=\"Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif\">\n";
  if (!title.empty()) this->title(title);
  out_ += "<style>\n";
  const auto sheet = [&](const Palette& palette) {
    out_ += ".background{fill:";
    out_ += palette.background;
    out_ += "}\n";
    out_ += rules(palette);
  };
  sheet(options.theme == Theme::kDark ? dark_palette() : light_palette());
  if (options.theme == Theme::kAuto) {
    out_ += "@media (prefers-color-scheme: dark){\n";
    sheet(dark_palette());
    out_ += "}\n";
  }
  out_ += "</style>\n";
  if (options.background) out_ += "<rect class=\"background\" width=\"" + width + "\" height=\"" + height + "\"/>\n";
}

void SvgWriter::rect(const Rect& rect, double radius, std::string_view css_class) {
  out_ += "<rect class=\"";
  out_ += css_class;
  out_ += "\" x=\"" + coordinate(rect.x) + "\" y=\"" + coordinate(rect.y) + "\" width=\"" + coordinate(rect.width) +
          "\" height=\"" + coordinate(rect.height) + "\"";
  if (radius > 0) out_ += " rx=\"" + coordinate(radius) + "\"";
  out_ += "/>\n";
}

void SvgWriter::ellipse(const Rect& bounds, std::string_view css_class) {
  const Point center = bounds.center();
  out_ += "<ellipse class=\"";
  out_ += css_class;
  out_ += "\" cx=\"" + coordinate(center.x) + "\" cy=\"" + coordinate(center.y) + "\" rx=\"" +
          coordinate(bounds.width / 2) + "\" ry=\"" + coordinate(bounds.height / 2) + "\"/>\n";
}

void SvgWriter::circle(Point center, double radius, std::string_view css_class) {
  out_ += "<circle class=\"";
  out_ += css_class;
  out_ +=
      "\" cx=\"" + coordinate(center.x) + "\" cy=\"" + coordinate(center.y) + "\" r=\"" + coordinate(radius) + "\"/>\n";
}

void SvgWriter::line(Point from, Point to, std::string_view css_class) {
  out_ += "<line class=\"";
  out_ += css_class;
  out_ += "\" x1=\"" + coordinate(from.x) + "\" y1=\"" + coordinate(from.y) + "\" x2=\"" + coordinate(to.x) +
          "\" y2=\"" + coordinate(to.y) + "\"/>\n";
}

void SvgWriter::path(const Curve& curve, std::string_view css_class) {
  if (curve.empty()) return;
  out_ += "<path class=\"";
  out_ += css_class;
  out_ += "\" d=\"" + path_data(curve) + "\"/>\n";
}

void SvgWriter::text(Point at, std::string_view text, std::string_view css_class, std::string_view anchor) {
  out_ += "<text class=\"";
  out_ += css_class;
  out_ += "\" x=\"" + coordinate(at.x) + "\" y=\"" + coordinate(at.y) + "\"";
  if (anchor != "start") {
    out_ += " text-anchor=\"";
    out_ += anchor;
    out_ += "\"";
  }
  out_ += ">" + xml_escape(text) + "</text>\n";
}

void SvgWriter::title(std::string_view text) { out_ += "<title>" + xml_escape(text) + "</title>\n"; }

std::string SvgWriter::finish() && {
  out_ += "</svg>\n";
  return std::move(out_);
}

std::string path_data(const Curve& curve) {
  if (curve.empty()) return "";
  const auto point = [](Point p) { return coordinate(p.x) + " " + coordinate(p.y); };
  std::string data = "M" + point(curve[0]);
  for (std::size_t i = 1; i + 2 < curve.size(); i += 3) {
    data += "C" + point(curve[i]) + " " + point(curve[i + 1]) + " " + point(curve[i + 2]);
  }
  return data;
}

}  // namespace sentree::draw
