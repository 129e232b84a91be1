#pragma once

#include <string>
#include <string_view>

#include "sentree/draw/geometry.h"
#include "sentree/draw/style.h"

namespace sentree::draw {

/// The colours of a theme. Names say what they are used for; values are CSS colours.
struct Palette {
  std::string_view background;
  std::string_view surface;  ///< Inside of nodes and states.
  std::string_view nested;   ///< Inside of states that hold others.
  std::string_view ink;      ///< Text.
  std::string_view muted;    ///< Secondary text.
  std::string_view line;     ///< Outlines, arrows.
  std::string_view running;
  std::string_view running_fill;
  std::string_view success;
  std::string_view success_fill;
  std::string_view failure;
  std::string_view failure_fill;
  std::string_view quiet;  ///< Skipped, halting.
  std::string_view quiet_fill;
};

[[nodiscard]] const Palette& light_palette();
[[nodiscard]] const Palette& dark_palette();

/// Builds the text of one SVG document. Numbers and texts come out the same on every machine; texts are escaped here.
class SvgWriter {
 public:
  /// `rules` gives the style sheet of a palette; it is written once, or for both themes.
  SvgWriter(Size size, std::string_view title, const SvgOptions& options, std::string (*rules)(const Palette&));

  /// Markup as it is; for what the helpers below do not cover. Texts in it must be escaped.
  void raw(std::string_view markup) { out_ += markup; }
  void rect(const Rect& rect, double radius, std::string_view css_class);
  void ellipse(const Rect& bounds, std::string_view css_class);
  void circle(Point center, double radius, std::string_view css_class);
  void line(Point from, Point to, std::string_view css_class);
  void path(const Curve& curve, std::string_view css_class);
  /// `anchor` is SVG's text-anchor: start, middle, end. `at` is on the baseline.
  void text(Point at, std::string_view text, std::string_view css_class, std::string_view anchor = "middle");
  void title(std::string_view text);

  [[nodiscard]] std::string finish() &&;

 private:
  std::string out_;
};

/// SVG path data of a curve.
[[nodiscard]] std::string path_data(const Curve& curve);

}  // namespace sentree::draw
