#pragma once

#include <string>

namespace sentree::cli {

/// Draws an SVG document as PNG into a file, or onto standard output if `output` is empty, with librsvg's rsvg-convert.
/// Returns the exit code; says on standard error what is wrong, also that the program is not installed.
[[nodiscard]] int write_png(const std::string& svg, const std::string& output);

}  // namespace sentree::cli
