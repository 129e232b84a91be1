#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/monitor/monitor.h"

namespace sentree::cli {

/// One monitor for each requirement of a file. Without a vocabulary, services and leaves are taken on trust.
/// Codes: file.*, those of `parse_requirements` and of `monitor::Model::make`.
[[nodiscard]] Loaded<std::vector<monitor::Model>> load_requirement_file(const std::string& file,
                                                                        const monitor::Vocabulary* vocabulary);

/// The project that a file belongs to: the folder of the nearest sentree.yaml above it; empty: none.
[[nodiscard]] std::filesystem::path project_above(const std::filesystem::path& file);

/// What the project in a folder observes. Codes: those of `load_project` and of `prepare`.
[[nodiscard]] Loaded<monitor::Vocabulary> vocabulary_of_project(const std::filesystem::path& folder);

}  // namespace sentree::cli
