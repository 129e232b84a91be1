#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace sentree::lsp {

/// The absolute, lexically normal path of a "file:" URI of this machine; nothing for any other.
/// Source: RFC 8089, RFC 3986.
[[nodiscard]] std::optional<std::filesystem::path> path_of(std::string_view uri);
[[nodiscard]] std::string uri_of(const std::filesystem::path& path);

}  // namespace sentree::lsp
