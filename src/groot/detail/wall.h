#pragma once

#include <chrono>
#include <cstdint>

namespace sentree::groot {

/// The machine's clock, microseconds since 1970, as Groot is told it.
inline std::int64_t wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace sentree::groot
