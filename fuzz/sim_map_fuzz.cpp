// A map's yaml and its image, divided by the first zero octet: whatever they hold, there is a map or a message.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "sentree/sim/distance_field.h"
#include "sentree/sim/laser.h"
#include "sentree/sim/map_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::size_t split = input.find('\0');
  const std::string_view yaml = input.substr(0, split);
  const std::string image(split == std::string_view::npos ? std::string_view() : input.substr(split + 1));
  const auto map = sentree::sim::parse_map(yaml, "m.yaml",
                                           [&](const std::string&) -> sentree::Result<std::string> { return image; });
  if (map.ok() == sentree::has_errors(map.diagnostics)) std::abort();
  if (!map.ok()) return 0;
  const sentree::sim::GridMap crop = sentree::sim::cropped_to_known(*map.value);
  constexpr std::size_t kSmall = 1 << 16;
  if (crop.cells().size() > kSmall) return 0;
  const sentree::sim::DistanceField distance(crop);
  const sentree::sim::RayField rays(crop);
  const double range = rays.cast({crop.width() / 2.0, crop.height() / 2.0}, {0.6, 0.8}, 1e6);
  if (!(range >= 0.0)) std::abort();
  return 0;
}
