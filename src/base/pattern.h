#pragma once

#include <string_view>

namespace sentree {

/// '*' in `pattern` stands for any text.
[[nodiscard]] bool matches_pattern(std::string_view pattern, std::string_view text);

}  // namespace sentree
