#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::record {

/// Where a recording is written to, from its beginning to its end.
class Sink {
 public:
  virtual ~Sink() = default;
  /// All of `bytes`, or an error; after one, nothing of them needs to be there.
  [[nodiscard]] virtual Result<void> write(std::string_view bytes) = 0;
};

/// Writes to the end of a string, which is borrowed.
class StringSink final : public Sink {
 public:
  explicit StringSink(std::string& text) : text_(text) {}
  Result<void> write(std::string_view bytes) override {
    text_ += bytes;
    return {};
  }

 private:
  std::string& text_;
};

/// Keeps nothing: for who only looks at the messages that are recorded.
class NullSink final : public Sink {
 public:
  Result<void> write(std::string_view) override { return {}; }
};

/// A new file. What `write` has taken is with the system: it survives the end of the process, however that ends.
class FileSink final : public Sink {
 public:
  /// Folders above it are made. The file is locked while it is open, so that others see that it is being written.
  /// Nobody is waited for who might read a pipe: without a reader that is an error.
  /// Error: record.unwritable.
  [[nodiscard]] static Result<std::unique_ptr<FileSink>> create(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  /// Error: record.unwritable; the file then ends where the last write that succeeded did.
  Result<void> write(std::string_view bytes) override;

 private:
  FileSink(int file, std::string name) : file_(file), name_(std::move(name)) {}
  int file_;
  std::string name_;
  std::uint64_t size_ = 0;
};

}  // namespace sentree::record
