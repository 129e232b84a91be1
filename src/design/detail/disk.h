#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "sentree/base/result.h"

namespace sentree::design {

/// What is at a file's place. Neither: nothing is.
struct OnDisk {
  std::optional<std::string> text;  ///< Without that of XML, in UTF-8.
  std::string begin;                ///< Of XML that is in another encoding: its first bytes, as they are.
  std::string problem;              ///< Why what is there is no text that can be edited: "it is no UTF-8 (byte 17)".
};

/// Looks, without following links. A file above `size_max` bytes cannot be edited.
[[nodiscard]] OnDisk look_at(const std::filesystem::path& path, std::size_t size_max);

/// Writes a text so that whoever reads, or a machine that stops, finds the old or the new one: beside the file, with
/// its mode, synchronised, renamed. Folders are made. `file`: its name in messages.
/// Errors: file.unwritable, file.read-only.
[[nodiscard]] Result<void> write_safely(const std::filesystem::path& path, const std::string& file,
                                        std::string_view text);

/// Error: file.unwritable.
[[nodiscard]] Result<void> take_away(const std::filesystem::path& path, const std::string& file);

}  // namespace sentree::design
