#include "sentree/base/coarse_clock.h"

#include <time.h>

namespace sentree {

std::uint64_t coarse_ms() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC_COARSE, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000 + static_cast<std::uint64_t>(time.tv_nsec) / 1'000'000;
}

}  // namespace sentree
