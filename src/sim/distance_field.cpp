#include "sentree/sim/distance_field.h"

#include <algorithm>
#include <cstddef>

namespace sentree::sim {

DistanceField::DistanceField(const GridMap& map)
    : width_(map.width()), height_(map.height()), squared_(map.cells().size()) {
  const auto width = static_cast<std::size_t>(width_);
  const auto height = static_cast<std::size_t>(height_);
  if (squared_.empty()) return;

  // First pass: distance within the column, row by row so that the compiler can do many columns at once.
  std::vector<std::uint8_t> column(squared_.size());
  for (std::size_t y = 0; y < height; ++y) {
    const std::int8_t* cells = map.cells().data() + y * width;
    std::uint8_t* row = column.data() + y * width;
    const std::uint8_t* below = y > 0 ? row - width : nullptr;
    for (std::size_t x = 0; x < width; ++x) {
      const int before = below != nullptr ? below[x] : kCellsMax;
      const int next = before < kCellsMax ? before + 1 : kCellsMax;
      row[x] = static_cast<std::uint8_t>(cells[x] >= GridMap::kOccupiedMin ? 0 : next);
    }
  }
  for (std::size_t y = height - 1; y-- > 0;) {
    std::uint8_t* row = column.data() + y * width;
    const std::uint8_t* above = row + width;
    for (std::size_t x = 0; x < width; ++x) {
      const int next = above[x] < kCellsMax ? above[x] + 1 : kCellsMax;
      row[x] = static_cast<std::uint8_t>(std::min<int>(row[x], next));
    }
  }

  // Second pass: the lower envelope of the row's parabolas (x - u)^2 + column(u)^2. What is capped cannot win
  // below the cap, so its parabola is left out.
  std::vector<int> site(width);  // u of each parabola of the envelope
  std::vector<int> from(width);  // first x at which it is the lowest
  constexpr int kCap = kCellsMax * kCellsMax;
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* row = column.data() + y * width;
    std::uint16_t* out = squared_.data() + y * width;
    int top = -1;
    for (int u = 0; u < width_; ++u) {
      const int g = row[u];
      if (g == kCellsMax) continue;
      bool last_of_row = false;
      while (top >= 0) {
        const int s = site[static_cast<std::size_t>(top)];
        const int x = from[static_cast<std::size_t>(top)];
        const int gs = row[s];
        if ((x - s) * (x - s) + gs * gs <= (x - u) * (x - u) + g * g) break;
        --top;
      }
      int start = 0;
      if (top >= 0) {
        const int s = site[static_cast<std::size_t>(top)];
        const int gs = row[s];
        // The first x at which u is strictly the lower; numerator >= 0 because u lost at from[top] >= 0.
        start = 1 + (u * u - s * s + g * g - gs * gs) / (2 * (u - s));
        last_of_row = start >= width_;
      }
      if (last_of_row) continue;
      ++top;
      site[static_cast<std::size_t>(top)] = u;
      from[static_cast<std::size_t>(top)] = start;
    }
    if (top < 0) {
      std::fill(out, out + width, static_cast<std::uint16_t>(kCap));
      continue;
    }
    for (int k = 0; k <= top; ++k) {
      const int s = site[static_cast<std::size_t>(k)];
      const int g2 = row[s] * row[s];
      const int begin = from[static_cast<std::size_t>(k)];
      const int end = k < top ? from[static_cast<std::size_t>(k) + 1] : width_;
      for (int x = begin; x < end; ++x) {
        out[x] = static_cast<std::uint16_t>(std::min((x - s) * (x - s) + g2, kCap));
      }
    }
  }
}

}  // namespace sentree::sim
