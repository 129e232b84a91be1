#pragma once

#include <filesystem>

#include "sentree/base/diagnostic.h"

namespace sentree::campaign {

/// Everything that is wrong with a project, without running it: what `project::check_project` says, then what is wrong
/// with its campaign.yaml and with scenarios that lie elsewhere in its folder, in folders at most kFolderDepthMax deep,
/// and which of its files nothing names (`project::check_unnamed`).
/// Cost: a preparation per scenario, and two for a campaign.
[[nodiscard]] Diagnostics check_project(const std::filesystem::path& folder_or_file);
inline constexpr int kFolderDepthMax = 4;

/// What is wrong with a file of what a campaign varies, of the project in its folder.
[[nodiscard]] Diagnostics check_vary(const std::filesystem::path& file);
/// Whether that is such a file, by the keys that it has.
[[nodiscard]] bool is_vary(const std::filesystem::path& file);

}  // namespace sentree::campaign
