#pragma once

#include <cstddef>
#include <vector>

namespace sentree::draw {

/// An index into what is drawn; -1, for none, is no such index.
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Pixels at a scale of 1; x to the right, y down, as in SVG.
struct Point {
  double x = 0;
  double y = 0;
  friend bool operator==(const Point&, const Point&) = default;
};

struct Size {
  double width = 0;
  double height = 0;
  friend bool operator==(const Size&, const Size&) = default;
};

/// From its top left corner.
struct Rect {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;

  [[nodiscard]] double right() const { return x + width; }
  [[nodiscard]] double bottom() const { return y + height; }
  [[nodiscard]] Point center() const { return {x + width / 2, y + height / 2}; }
  friend bool operator==(const Rect&, const Rect&) = default;
};

/// A chain of cubic Bézier pieces: a start, then three points per piece. Empty, or 3n + 1 points.
using Curve = std::vector<Point>;

/// True if the insides of the two have a point in common; touching borders do not count.
[[nodiscard]] constexpr bool overlap(const Rect& a, const Rect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

}  // namespace sentree::draw
