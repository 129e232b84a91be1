#pragma once

#include <cstdint>

namespace sentree::cli {

/// Bytes that this process can still take: of what the machine, the control group and the limit of its address space
/// leave, the least. 0: nobody says.
[[nodiscard]] std::uint64_t available_memory();

}  // namespace sentree::cli
