#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::import {

/// The files of a folder, read once each when they are asked for. Hidden files, build folders and links are left out,
/// so that nothing outside the folder can be reached.
class SourceFolder {
 public:
  /// Errors: file.not-found, import.too-large.
  [[nodiscard]] static Result<SourceFolder> open(const std::filesystem::path& folder);

  /// Paths relative to the folder with '/', sorted.
  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }
  /// Those with one of the endings (".xml").
  [[nodiscard]] std::vector<std::string> with_ending(std::initializer_list<std::string_view> endings) const;
  [[nodiscard]] bool contains(const std::string& file) const;
  /// The content. Errors: file.*, for a file that is not among `files` import.outside.
  [[nodiscard]] Result<std::string> read(const std::string& file) const;
  /// `reference` as written in `from`, as a path of `files`; nothing if it leads out of the folder.
  [[nodiscard]] static std::optional<std::string> resolve(const std::string& from, std::string_view reference);
  /// `file` as messages show it.
  [[nodiscard]] std::string shown(const std::string& file) const { return (folder_ / file).string(); }

 private:
  std::filesystem::path folder_;
  std::vector<std::string> files_;
};

}  // namespace sentree::import
