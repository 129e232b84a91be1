#include "sentree/sim/detail/png_image.h"

#include <png.h>

#include <cstddef>
#include <vector>

#include <fmt/format.h>

namespace sentree::sim {

Result<Image> parse_png(std::string_view bytes, const std::string& file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
    return fail("map.bad-image", std::string("the PNG cannot be read: ") + png.message, {file});
  }
  const std::size_t cells = static_cast<std::size_t>(png.width) * png.height;
  if (png.width > kMapSideMax || png.height > kMapSideMax || cells > kMapCellsMax) {
    const std::string size = fmt::format("{} x {}", png.width, png.height);
    png_image_free(&png);
    return fail("map.too-large", fmt::format("the image has {} cells; at most {} are supported", size, kMapCellsMax),
                {file});
  }
  const bool has_alpha = (png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> samples(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, samples.data(), 0, nullptr) == 0) {
    return fail("map.bad-image", std::string("the PNG cannot be read: ") + png.message, {file});
  }
  Image image{.width = static_cast<int>(png.width), .height = static_cast<int>(png.height)};
  image.grey.resize(cells);
  if (has_alpha) image.alpha.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const std::uint8_t* pixel = samples.data() + 4 * i;
    image.grey[i] = static_cast<std::uint8_t>((pixel[0] + pixel[1] + pixel[2]) / 3);
    if (has_alpha) image.alpha[i] = pixel[3];
  }
  return image;
}

}  // namespace sentree::sim
