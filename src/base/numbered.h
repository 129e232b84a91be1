#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace sentree {

/// Those of `names` that are `name` with a number behind it, as leaves of one name have it in messages: "drive__3",
/// "drive__5" of "drive".
[[nodiscard]] inline std::vector<std::string> numbered(std::string_view name, const std::vector<std::string>& names) {
  std::vector<std::string> found;
  for (const std::string& one : names) {
    if (!one.starts_with(name) || !std::string_view(one).substr(name.size()).starts_with("__")) continue;
    const std::string_view number = std::string_view(one).substr(name.size() + 2);
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos) found.push_back(one);
  }
  return found;
}

}  // namespace sentree
