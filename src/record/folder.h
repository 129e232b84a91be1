#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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
/// `new_recording` named are looked at, and those that are being written stay, as do those of runs that wait to be
/// resumed.
/// @param waits  Whether a run goes on from that journal, which lies beside its recording. Null: none does.
std::vector<std::filesystem::path> remove_old(const std::filesystem::path& folder, const FolderLimits& limits,
                                              const std::function<bool(const std::filesystem::path&)>& waits = {});

}  // namespace sentree::record
