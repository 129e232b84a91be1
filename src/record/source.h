#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::record {

/// What a recording is read from, at any place.
class Source {
 public:
  virtual ~Source() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Up to `length` bytes from `offset`: fewer at the end, nothing beyond it. Error: record.unreadable.
  [[nodiscard]] virtual Result<std::string> read(std::uint64_t offset, std::uint64_t length) = 0;
};

class StringSource final : public Source {
 public:
  /// `text` is borrowed.
  explicit StringSource(std::string_view text) : text_(text) {}
  std::uint64_t size() const override { return text_.size(); }
  Result<std::string> read(std::uint64_t offset, std::uint64_t length) override {
    if (offset >= text_.size()) return std::string();
    return std::string(text_.substr(offset, length));
  }

 private:
  std::string_view text_;
};

/// A file, which may still be growing; it is read as long as it was when it was opened.
class FileSource final : public Source {
 public:
  /// Errors: file.not-found, file.not-a-file, record.unreadable.
  [[nodiscard]] static Result<std::unique_ptr<Source>> open(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  Result<std::string> read(std::uint64_t offset, std::uint64_t length) override;

 private:
  FileSource(int file, std::uint64_t size, std::string name) : file_(file), size_(size), name_(std::move(name)) {}
  int file_;
  std::uint64_t size_;
  std::string name_;
};

}  // namespace sentree::record
