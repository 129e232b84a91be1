#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace sentree::text {

/// While it lives, the texts below a folder are somebody else's: what came in a recording. See `ReadFence`.
/// Thread-safe.
class SealedFolder {
 public:
  /// @param stands_for  The folder that its texts were in, if they name each other by absolute paths; empty: they do
  /// not.
  explicit SealedFolder(const std::filesystem::path& folder, const std::filesystem::path& stands_for = {});
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

  /// Where a file is that a text names: in the sealed folder if that stands for where it was. Nothing: a fence of this
  /// thread does not let it be read.
  [[nodiscard]] static std::optional<std::filesystem::path> place_of(const std::filesystem::path& file);

 private:
  std::vector<std::filesystem::path> inside_;  // the sealed folder first; empty: everything may be read
  std::filesystem::path stands_for_;
  const ReadFence* outer_;
};

}  // namespace sentree::text
