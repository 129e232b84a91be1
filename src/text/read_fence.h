#pragma once

#include <filesystem>
#include <vector>

namespace sentree::text {

/// While it lives, the texts below a folder are somebody else's: what came in a recording. See `ReadFence`.
/// Thread-safe.
class SealedFolder {
 public:
  /// @param folder  Absolute, without links.
  explicit SealedFolder(std::filesystem::path folder);
  ~SealedFolder();
  SealedFolder(const SealedFolder&) = delete;
  SealedFolder& operator=(const SealedFolder&) = delete;

 private:
  std::filesystem::path folder_;
};

/// Around whatever follows the names of files in a project's texts. If the project is below a sealed folder,
/// `read_file` in this thread reads nothing outside of that folder and of `also` while the fence lives: file.outside.
/// In other projects it does nothing. Fences may stand inside each other.
class ReadFence {
 public:
  /// @param also  Folders that come with the program; empty paths are left out.
  explicit ReadFence(const std::filesystem::path& project, const std::vector<std::filesystem::path>& also = {});
  ~ReadFence();
  ReadFence(const ReadFence&) = delete;
  ReadFence& operator=(const ReadFence&) = delete;

  /// Whether a fence of this thread lets the file be read.
  [[nodiscard]] static bool lets(const std::filesystem::path& file);

 private:
  std::vector<std::filesystem::path> inside_;  // empty: everything may be read
  const ReadFence* outer_;
};

}  // namespace sentree::text
