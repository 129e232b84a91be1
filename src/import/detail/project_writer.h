#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::import {

/// Of the addresses that stand in for those of components and nodes, which nobody knows here.
inline constexpr int kFirstPort = 10'001;

/// `text` as a name of a service, a file or a leaf: letters, digits, '_', '-'; what else it has becomes '_'.
[[nodiscard]] std::string safe_name(std::string_view text);

/// `name`, or the first of name_2, name_3 … that is not in `taken`, to which it is added.
[[nodiscard]] std::string unused_name(std::string name, std::set<std::string>& taken);

/// A YAML scalar, quoted where a plain one would be read as something else.
[[nodiscard]] std::string yaml_text(std::string_view text);

}  // namespace sentree::import
