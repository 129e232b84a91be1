#include "sentree/sim/map_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/sim/detail/png_image.h"
#include "sentree/sim/detail/yaml_fields.h"
#include "sentree/text/yaml.h"

namespace sentree::sim {

namespace {

// Header and ascii samples of a PGM: whole numbers between white space and comments.
class PgmReader {
 public:
  PgmReader(std::string_view bytes, std::size_t start) : bytes_(bytes), at_(start) {}

  // Nothing at the end of the file, on what is no digit, or above `max`.
  std::optional<int> number(int max) {
    while (at_ < bytes_.size()) {
      const char c = bytes_[at_];
      if (c == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n' && bytes_[at_] != '\r') ++at_;
      } else if (is_space(c)) {
        ++at_;
      } else {
        break;
      }
    }
    int value = 0;
    const std::size_t first = at_;
    for (; at_ < bytes_.size() && bytes_[at_] >= '0' && bytes_[at_] <= '9'; ++at_) {
      // Before the bound is met, the next digit may lead out of an int.
      const std::int64_t next = std::int64_t{value} * 10 + (bytes_[at_] - '0');
      if (next > max) return std::nullopt;
      value = static_cast<int>(next);
    }
    if (at_ == first) return std::nullopt;
    return value;
  }
  // The one white-space character that ends the header of a P5.
  bool single_space() { return at_ < bytes_.size() && is_space(bytes_[at_++]); }
  bool at_end() const { return at_ >= bytes_.size(); }
  std::string_view rest() const { return bytes_.substr(at_); }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  std::string_view bytes_;
  std::size_t at_;
};

std::uint8_t scaled(int value, int max) {
  return static_cast<std::uint8_t>((std::min(value, max) * 255 + max / 2) / max);
}

Result<Image> parse_pgm(std::string_view bytes, const std::string& file) {
  const bool ascii = bytes[1] == '2';
  constexpr int kMaxvalMax = 65535;
  PgmReader reader(bytes, 2);
  const auto width = reader.number(1 << 30);
  const auto height = reader.number(1 << 30);
  const auto max = reader.number(kMaxvalMax);
  if (!width || !height || !max || *width == 0 || *height == 0 || *max == 0) {
    return fail("map.bad-image", "the PGM header needs width, height and greatest value, all above 0", {file});
  }
  const std::size_t cells = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
  if (*width > kMapSideMax || *height > kMapSideMax || cells > kMapCellsMax) {
    return fail("map.too-large",
                fmt::format("the image has {} x {} cells; at most {} cells and {} a side are supported", *width,
                            *height, kMapCellsMax, kMapSideMax),
                {file});
  }
  const auto truncated = [&](std::size_t have) {
    return fail("map.truncated",
                fmt::format("the image ends after {} of {} cells; the file was cut off, fetch it again", have, cells),
                {file});
  };
  Image image{.width = *width, .height = *height};
  image.grey.resize(cells);
  if (ascii) {
    for (std::size_t i = 0; i < cells; ++i) {
      const auto value = reader.number(*max);
      if (!value && reader.at_end()) return truncated(i);
      if (!value) {
        return fail("map.bad-image", fmt::format("cell {} is no number from 0 to {}", i, *max), {file});
      }
      image.grey[i] = scaled(*value, *max);
    }
    return image;
  }
  if (!reader.single_space()) return truncated(0);
  const std::string_view data = reader.rest();
  const std::size_t octets = *max > 255 ? 2 : 1;
  if (data.size() < cells * octets) return truncated(data.size() / octets);
  const auto octet = [&](std::size_t i) { return static_cast<int>(static_cast<unsigned char>(data[i])); };
  for (std::size_t i = 0; i < cells; ++i) {
    image.grey[i] = scaled(octets == 1 ? octet(i) : octet(2 * i) * 256 + octet(2 * i + 1), *max);
  }
  return image;
}

enum class Mode { kTrinary, kScale, kRaw };

struct Meaning {
  Mode mode = Mode::kTrinary;
  bool negate = false;
  double occupied = 0.65;
  double free = 0.25;
};

// As in nav2_map_server's map_io and ROS 1's image_loader.
std::int8_t occupancy(const Meaning& meaning, int grey, int alpha) {
  if (meaning.mode == Mode::kRaw) return static_cast<std::int8_t>(grey <= 100 ? grey : GridMap::kUnknown);
  if (meaning.mode == Mode::kScale && alpha < 255) return GridMap::kUnknown;
  const double darkness = (meaning.negate ? grey : 255 - grey) / 255.0;
  if (darkness > meaning.occupied) return 100;
  if (darkness < meaning.free) return 0;
  if (meaning.mode == Mode::kTrinary) return GridMap::kUnknown;
  return static_cast<std::int8_t>(std::lround(99.0 * (darkness - meaning.free) / (meaning.occupied - meaning.free)));
}

}  // namespace

Result<Image> parse_image(std::string_view bytes, const std::string& file) {
  if (bytes.starts_with("\x89PNG")) return parse_png(bytes, file);
  if (bytes.starts_with("P5") || bytes.starts_with("P2")) return parse_pgm(bytes, file);
  if (bytes.starts_with("version https://git-lfs")) {
    return fail("map.bad-image", "the file is a Git LFS pointer; run `git lfs pull`", {file});
  }
  return fail("map.bad-image", "the image is neither PGM (P2, P5) nor PNG", {file});
}

Loaded<GridMap> parse_map(std::string_view source, const std::string& file, const FileReader& read) {
  Loaded<GridMap> loaded;
  const auto root = text::parse_yaml(source, file);
  if (!root) {
    loaded.diagnostics.push_back(root.error());
    return loaded;
  }
  YamlFields fields(*root, "map", "the map", loaded.diagnostics);
  std::string image_name;
  Meaning meaning;
  double resolution = 0.0;
  Pose2 origin;
  // One at a time where missing is an error too.
  const text::YamlNode* image_node = fields.required("image");
  fields.text("image", image_name);
  if (fields.required("resolution") != nullptr) fields.number("resolution", resolution, {0.0, 100.0, true});
  const text::YamlNode* origin_node = fields.required("origin");
  if (origin_node != nullptr) fields.pose("origin", origin);
  fields.number("occupied_thresh", meaning.occupied, {0.0, 1.0});
  fields.number("free_thresh", meaning.free, {0.0, 1.0});
  if (const text::YamlNode* negate = fields.node("negate")) {
    // map_server writes 0 or 1; YAML's own truth values are taken too.
    if (const auto number = negate->integer(); number && (*number == 0 || *number == 1))
      meaning.negate = *number == 1;
    else
      fields.boolean("negate", meaning.negate);
  }
  const std::array<std::string, 3> modes{"trinary", "scale", "raw"};
  if (const auto mode = fields.choice("mode", modes)) meaning.mode = static_cast<Mode>(*mode);
  if (meaning.free >= meaning.occupied) {
    fields.error("bad-value",
                 fmt::format("free_thresh {} is not below occupied_thresh {}", shortest_decimal(meaning.free),
                             shortest_decimal(meaning.occupied)),
                 fields.span());
  }
  fields.finish();
  if (has_errors(loaded.diagnostics)) return loaded;

  const auto bytes = read(image_name);
  if (!bytes) {
    Diagnostic missing = bytes.error();
    missing.message += " (the map's image)";
    missing.span = image_node->span;
    loaded.diagnostics.push_back(std::move(missing));
    return loaded;
  }
  // Shown beside the yaml, where a person finds it.
  const std::string shown = (std::filesystem::path(file).parent_path() / image_name).string();
  const auto image = parse_image(*bytes, shown);
  if (!image) {
    loaded.diagnostics.push_back(image.error());
    return loaded;
  }
  std::vector<std::int8_t> cells(image->grey.size());
  const auto width = static_cast<std::size_t>(image->width);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t row = i / width;
    const std::size_t target = (static_cast<std::size_t>(image->height) - 1 - row) * width + i % width;
    cells[target] = occupancy(meaning, image->grey[i], image->alpha.empty() ? 255 : image->alpha[i]);
  }
  loaded.value = GridMap(image->width, image->height, resolution, origin, std::move(cells));
  return loaded;
}

}  // namespace sentree::sim
