#pragma once

#include <cstdint>

namespace sentree {

/// Wall time since the machine was started [ms], as exact as the kernel's tick of some 4 ms. Takes a few ns.
[[nodiscard]] std::uint64_t coarse_ms();

}  // namespace sentree
