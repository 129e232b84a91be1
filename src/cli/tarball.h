#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::cli {

/// A .tar.gz (POSIX ustar in gzip) that comes into being beside `path` and takes that name when it is whole.
class Tarball {
 public:
  explicit Tarball(std::filesystem::path path);
  ~Tarball();  ///< What was not finished is deleted.
  Tarball(const Tarball&) = delete;
  Tarball& operator=(const Tarball&) = delete;

  /// @param name  Relative, at most 100 octets: the bound of the format.
  /// Errors, of all three: file.unwritable, file.unreadable.
  [[nodiscard]] Result<void> add(const std::string& name, std::string_view content);
  /// The content of a file, of up to 8 GB; read in pieces.
  [[nodiscard]] Result<void> add_file(const std::string& name, const std::filesystem::path& file);
  [[nodiscard]] Result<void> finish();

 private:
  [[nodiscard]] Result<void> write(std::string_view octets);
  [[nodiscard]] Result<void> write_header(const std::string& name, std::uintmax_t size);

  std::filesystem::path path_;
  std::filesystem::path partial_;
  void* gzip_ = nullptr;  ///< zlib's gzFile.
};

}  // namespace sentree::cli
