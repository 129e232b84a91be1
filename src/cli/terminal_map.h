#pragma once

#include <string>
#include <vector>

#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::cli {

/// The world in a terminal of `width` x `height` characters, a line each, with colours: walls as half blocks, paths,
/// obstacles, closed doors, the first letters of locations, stations, and an arrow for each robot.
[[nodiscard]] std::vector<std::string> map_lines(const sim::World& world, const sim::State& state, int width,
                                                 int height);

/// Twenty blocks, as many full as there is charge (0 to 1); red and yellow when it runs low.
[[nodiscard]] std::string battery_bar(double charge);

/// Size of the terminal on standard output; a usual one where there is none.
struct TerminalSize {
  int columns = 120;
  int rows = 40;
};
[[nodiscard]] TerminalSize terminal_size();

/// Draws over the previous frame from the upper left corner, never more than `size.rows` lines.
void print_frame(const std::vector<std::string>& lines, const TerminalSize& size);

}  // namespace sentree::cli
