#pragma once

#include <string>

#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// What a picture of the world shows beside map, stations and robots.
struct DrawingOptions {
  double pixels_per_m = 40.0;  ///< 1 to 1000; others are brought to the nearer end.
  bool places = true;          ///< Names and arrows of locations; outlines of areas.
  bool scan = true;
  bool particles = true;  ///< Thinned to at most a thousand a robot.
  bool path = true;
};

/// The world at `state` as an SVG document, +y up: walls black, unknown grey, robots as discs with a line for the
/// heading; where localization is off, its belief is dashed. The same state gives the same bytes. O(cells + beams +
/// particles).
[[nodiscard]] std::string to_svg(const World& world, const State& state, const DrawingOptions& options = {});

}  // namespace sentree::sim
