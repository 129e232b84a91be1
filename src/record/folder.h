#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::record {

/// What a folder of recordings may hold before the oldest are removed.
struct FolderLimits {
  std::size_t recordings = 30;
  std::uint64_t bytes = std::uint64_t{2} << 30U;
};

/// A name for a new recording, "<name>-<YYYYMMDD>-<hhmmss>.mcap" in UTC, with a number behind it when it is taken.
/// Characters of `name` other than letters, digits, '-' and '_' become '_'.
[[nodiscard]] std::filesystem::path new_recording(const std::filesystem::path& folder, std::string_view name);

/// Removes the oldest recordings until there is room for another one, and returns those it removed. Only files that
/// `new_recording` named are looked at, and those that are being written stay.
std::vector<std::filesystem::path> remove_old(const std::filesystem::path& folder, const FolderLimits& limits);

}  // namespace sentree::record
