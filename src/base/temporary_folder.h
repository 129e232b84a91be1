#pragma once

#include <filesystem>
#include <string_view>

namespace sentree {

/// A private folder in the system's place for temporary files. It is gone with this object, with all that is in it.
class TemporaryFolder {
 public:
  /// @param purpose  Part of its name: "sentree-purpose-8fK2aQ".
  explicit TemporaryFolder(std::string_view purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Empty: none could be made.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace sentree
