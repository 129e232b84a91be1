#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// Largest image file that is read.
inline constexpr std::size_t kImageBytesMax = 256U << 20U;

/// Gives the bytes of a file by its path, relative to whoever names it.
using FileReader = std::function<Result<std::string>(const std::string& path)>;

/// A grey image as read: row 0 is the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;   ///< 0 black to 255 white; other depths are scaled to this.
  std::vector<std::uint8_t> alpha;  ///< As grey; empty if the image has none.
};

/// Reads PGM (P2, P5; any maxval) or PNG, told apart by their first bytes.
/// Errors: map.bad-image (not an image, or a broken one), map.truncated (says how much is missing), map.too-large.
[[nodiscard]] Result<Image> parse_image(std::string_view bytes, const std::string& file);

/// Reads a map as ROS map_server does: the yaml's source, and the image that it names through `read`.
///
/// Modes trinary (default), scale and raw; `negate`, both thresholds, origin with heading. Beyond map_server's keys
/// nothing is accepted. Errors: yaml.*, map.missing-key, map.bad-value, map.unknown-key, those of the image and of
/// `read`.
[[nodiscard]] Loaded<GridMap> parse_map(std::string_view source, const std::string& file, const FileReader& read);

}  // namespace sentree::sim
