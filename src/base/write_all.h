#pragma once

#include <string_view>

namespace sentree {

/// Writes all octets to a descriptor, whatever signals come and however little it takes at once.
/// False: it does not take them, and errno says why (ENOSPC where it takes none and says nothing).
[[nodiscard]] bool write_all(int descriptor, std::string_view octets);

}  // namespace sentree
