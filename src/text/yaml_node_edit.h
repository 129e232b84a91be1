#pragma once

#include <string>
#include <string_view>

#include "sentree/text/yaml.h"

namespace sentree::text {

/// The entry of a mapping, made if it is not there; what is no mapping becomes one.
[[nodiscard]] YamlNode& member(YamlNode& mapping, std::string_view key);
/// Sets an entry to a text.
void set_scalar(YamlNode& mapping, std::string_view key, std::string text);

}  // namespace sentree::text
