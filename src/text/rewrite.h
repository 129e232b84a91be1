#pragma once

#include <filesystem>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::text {

/// True for a file that its owner or nobody may write, though another could be put in its place.
[[nodiscard]] bool is_read_only(const std::filesystem::path& path);

/// Gives a file that is there another text, as `write_file` does, and keeps what else it is: its permissions, and of
/// XML its encoding (`text` is as `read_file` gives it). Errors: file.unwritable, file.read-only; file.encoding, if
/// that encoding has not all characters of `text`.
[[nodiscard]] Result<void> rewrite_file(const std::filesystem::path& path, std::string_view text);

}  // namespace sentree::text
