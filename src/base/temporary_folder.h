#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

namespace sentree {

/// A private folder in the system's place for temporary files. It is gone with this object, with all that is in it.
/// What processes that were killed have left is taken away by the next process of the same user that makes one.
class TemporaryFolder {
 public:
  /// @param purpose   Part of its name: "sentree-purpose-8fK2aQ".
  /// @param path_max  Octets that its path may have, where sockets are to have names in it: if the system's place is
  ///                  longer (TMPDIR), it is in /tmp.
  explicit TemporaryFolder(std::string_view purpose, std::size_t path_max = SIZE_MAX);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Empty: none could be made.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;  // held while its process lives
};

/// Takes away what no living process holds, of this user, in the place for temporary files. Folders younger than `age`
/// stay: they may be in the making. The first TemporaryFolder of a process calls it.
void clean_temporary_folders(const std::filesystem::path& place, std::chrono::seconds age);
/// The same in the system's place, of those older than a minute; once in a process.
void clean_temporary_folders();

/// Keeps another process's folder while this process lives, whatever becomes of that one: for what is found there by
/// its path. Other folders are left alone.
void keep_temporary_folder(const std::filesystem::path& folder);

}  // namespace sentree
