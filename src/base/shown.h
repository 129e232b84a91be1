#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace sentree {

/// `text` as a terminal may show it, whoever wrote it: control characters but tabs and ends of lines become `\x1b` and
/// the like, so that none moves the cursor, renames the window or hides what follows. O(length).
[[nodiscard]] std::string shown(std::string_view text);

/// The same; of what is longer than 4,000 bytes the middle is left out.
[[nodiscard]] std::string shown_in_short(std::string_view text);

/// A number as people read it: 1,234,567.
[[nodiscard]] std::string grouped(std::uint64_t number);

}  // namespace sentree
