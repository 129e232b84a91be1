#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sentree::design {

/// Whether a text can be read as what its file's name says that it is: a chart that loads, trees whose nodes have as
/// many children as they take, requirements, YAML, XML. Others always.
[[nodiscard]] bool is_sound(const std::string& file, std::string_view text);

/// `merge`; nothing, too, where what comes of two sound texts is not sound.
[[nodiscard]] std::optional<std::string> merged_soundly(const std::string& file, std::string_view base,
                                                        std::string_view mine, std::string_view theirs);

}  // namespace sentree::design
