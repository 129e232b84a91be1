#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::text {

/// No file that people write by hand is larger; maps have a bound of their own.
inline constexpr std::size_t kFileSizeMax = 64U << 20U;

/// The bytes of a regular file; of XML that is not in UTF-8, the same in UTF-8 (`xml_as_utf8`). `shown_as` is the name
/// used in messages (default: the path). Errors: file.not-found, file.not-a-file, file.unreadable, file.too-large.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path, std::string shown_as = {},
                                            std::size_t size_max = kFileSizeMax);

/// A file that was read, with the path as it was opened.
struct ReadFile {
  std::filesystem::path path;
  std::string content;
};

/// Keeps what `read_file` reads in this thread while it lives, each path once, in the order of the first reading: what
/// a project consists of is what its loaders read. One at a time per thread.
class ReadLog {
 public:
  ReadLog();
  ~ReadLog();
  ReadLog(const ReadLog&) = delete;
  ReadLog& operator=(const ReadLog&) = delete;
  [[nodiscard]] const std::vector<ReadFile>& files() const { return files_; }

 private:
  friend Result<std::string> read_file(const std::filesystem::path&, std::string, std::size_t);
  std::vector<ReadFile> files_;
};

/// The hashes of what `read_file` reads in this thread while it lives. One at a time per thread, beside a ReadLog.
class ReadHashes {
 public:
  ReadHashes();
  ~ReadHashes();
  ReadHashes(const ReadHashes&) = delete;
  ReadHashes& operator=(const ReadHashes&) = delete;
  [[nodiscard]] const std::set<std::uint64_t>& hashes() const { return hashes_; }

 private:
  friend Result<std::string> read_file(const std::filesystem::path&, std::string, std::size_t);
  std::set<std::uint64_t> hashes_;
};

/// Writes beside the file and renames, so that a reader sees the old or the new content, never half. A link stays, and
/// the file that it names is written; into a device or a pipe it is written as it stands, without waiting for who might
/// read a pipe. Error: file.unwritable.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view content);

}  // namespace sentree::text
