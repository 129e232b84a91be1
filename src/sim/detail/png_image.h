#pragma once

#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/sim/map_file.h"

namespace sentree::sim {

/// Reads a PNG of any colour type; colours become the mean of red, green and blue, as map_server has it.
/// Errors: map.bad-image, map.too-large.
[[nodiscard]] Result<Image> parse_png(std::string_view bytes, const std::string& file);

}  // namespace sentree::sim
