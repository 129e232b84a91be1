#include "sentree/cli/tarball.h"

#include <fmt/format.h>

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>
#include <numeric>

#include "sentree/base/assert.h"

namespace sentree::cli {

namespace {

constexpr std::size_t kBlock = 512;
constexpr std::uintmax_t kFileMax = 077777777777;  // eleven octal digits

tl::unexpected<Diagnostic> failure(const char* code, const std::filesystem::path& file, const std::string& what) {
  return tl::unexpected(Diagnostic{.code = code, .message = fmt::format("{}: {}", file.string(), what)});
}

}  // namespace

Tarball::Tarball(std::filesystem::path path)
    : path_(std::move(path)), partial_(fmt::format("{}.{}.part", path_.string(), getpid())) {
  gzip_ = gzopen(partial_.c_str(), "wbx9");
}

Tarball::~Tarball() {
  if (gzip_ == nullptr) return;
  gzclose(static_cast<gzFile>(gzip_));
  std::error_code error;
  std::filesystem::remove(partial_, error);
}

Result<void> Tarball::write(std::string_view octets) {
  if (gzip_ == nullptr) return failure("file.unwritable", path_, "cannot be written here");
  const std::size_t written = gzfwrite(octets.data(), 1, octets.size(), static_cast<gzFile>(gzip_));
  if (written != octets.size()) return failure("file.unwritable", path_, "cannot be written; is the disk full?");
  return {};
}

Result<void> Tarball::write_header(const std::string& name, std::uintmax_t size) {
  // IEEE Std 1003.1, pax, "ustar Interchange Format".
  std::array<char, kBlock> header{};
  const auto put = [&](std::size_t at, std::string_view text) {
    std::copy(text.begin(), text.end(), header.data() + at);
  };
  const auto put_octal = [&](std::size_t at, int digits, std::uintmax_t value) {
    for (int digit = digits; digit-- > 0; value /= 8)
      header[at + static_cast<std::size_t>(digit)] = static_cast<char>('0' + value % 8);
  };
  SENTREE_ASSERT(name.size() <= 100 && size <= kFileMax);
  put(0, name);
  put_octal(100, 7, 0644);
  put_octal(108, 7, 0);
  put_octal(116, 7, 0);
  put_octal(124, 11, size);
  put_octal(136, 11, static_cast<std::uintmax_t>(std::time(nullptr)));
  put(148, "        ");  // the sum is made with blanks in its place
  put(156, "0");
  put(257, std::string_view("ustar\00000", 8));
  const unsigned sum = std::accumulate(header.begin(), header.end(), 0U,
                                       [](unsigned so_far, char c) { return so_far + static_cast<unsigned char>(c); });
  put_octal(148, 6, sum);
  return write({header.data(), header.size()});
}

Result<void> Tarball::add(const std::string& name, std::string_view content) {
  if (auto done = write_header(name, content.size()); !done) return done;
  if (auto done = write(content); !done) return done;
  return write(std::string((kBlock - content.size() % kBlock) % kBlock, '\0'));
}

Result<void> Tarball::add_file(const std::string& name, const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  if (error || !in) return failure("file.unreadable", file, "cannot be read");
  if (size > kFileMax) return failure("file.unreadable", file, "has more than 8 GB");
  if (auto done = write_header(name, size); !done) return done;
  std::string piece(std::size_t{1} << 16, '\0');
  // No more than the header says: a run that goes on may still write to its recording.
  for (std::uintmax_t left = size; left > 0;) {
    const std::size_t wanted = static_cast<std::size_t>(std::min<std::uintmax_t>(left, piece.size()));
    if (!in.read(piece.data(), static_cast<std::streamsize>(wanted)))
      return failure("file.unreadable", file, "became shorter while it was read");
    if (auto done = write({piece.data(), wanted}); !done) return done;
    left -= wanted;
  }
  return write(std::string(static_cast<std::size_t>((kBlock - size % kBlock) % kBlock), '\0'));
}

Result<void> Tarball::finish() {
  if (auto done = write(std::string(2 * kBlock, '\0')); !done) return done;
  const int closed = gzclose(static_cast<gzFile>(gzip_));
  gzip_ = nullptr;
  std::error_code error;
  if (closed == Z_OK) std::filesystem::rename(partial_, path_, error);
  if (closed == Z_OK && !error) return {};
  std::filesystem::remove(partial_, error);
  return failure("file.unwritable", path_, "cannot be written; is the disk full?");
}

}  // namespace sentree::cli
