#include "sentree/text/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include "sentree/base/value.h"
#include "sentree/text/encoding.h"
#include "sentree/text/overlay.h"
#include "sentree/text/read_fence.h"

namespace sentree::text {

namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

thread_local ReadLog* read_log = nullptr;
thread_local ReadHashes* read_hashes = nullptr;
thread_local const Overlay* read_through = nullptr;

// Of contents that may be large, such as maps: a word at a time, by one multiplication.
std::uint64_t hash_content(std::string_view content) {
  constexpr std::uint64_t kFactor = 0xBF58476D1CE4E5B9ULL;  // SplitMix64's
  std::uint64_t hash = content.size();
  while (content.size() >= sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, content.data(), sizeof word);
    hash = (hash ^ word) * kFactor;
    hash ^= hash >> 29U;
    content.remove_prefix(sizeof word);
  }
  return hash_combine(hash, hash_bytes(content));
}

// What stands for the file, or null.
const std::string* overlaid(const std::filesystem::path& path) {
  if (read_through == nullptr || read_through->empty()) return nullptr;
  std::error_code error;
  const auto found = read_through->find(std::filesystem::absolute(path, error).lexically_normal());
  return found != read_through->end() ? &found->second : nullptr;
}

Result<std::string> read_from_disk(const std::filesystem::path& path, const SourceSpan& place, std::size_t size_max) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) return fail("file.not-found", "no such file", place);
  if (status.type() != std::filesystem::file_type::regular) return fail("file.not-a-file", "not a regular file", place);

  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return fail("file.unreadable", "cannot be read: " + std::generic_category().message(errno), place);
  std::string content;
  char buffer[64 * 1024];
  for (;;) {
    const std::size_t got = std::fread(buffer, 1, sizeof buffer, file.get());
    content.append(buffer, got);
    if (content.size() > size_max) {
      return fail("file.too-large", "larger than the " + std::to_string(size_max) + " bytes that are read at most",
                  place);
    }
    if (got < sizeof buffer) break;
  }
  if (std::ferror(file.get()))
    return fail("file.unreadable", "cannot be read: " + std::generic_category().message(errno), place);
  return content;
}

}  // namespace

ReadThrough::ReadThrough(const Overlay& overlay) { read_through = &overlay; }
ReadThrough::~ReadThrough() { read_through = nullptr; }

ReadLog::ReadLog() { read_log = this; }
ReadLog::~ReadLog() { read_log = nullptr; }

ReadHashes::ReadHashes() { read_hashes = this; }
ReadHashes::~ReadHashes() { read_hashes = nullptr; }

Result<std::string> read_file(const std::filesystem::path& path, std::string shown_as, std::size_t size_max) {
  if (shown_as.empty()) shown_as = path.string();
  const auto place = ReadFence::place_of(path);
  if (!place)
    return fail("file.outside", "it is not part of the recorded project, which may name no other files", {shown_as});
  const std::string* const edited = overlaid(path);
  auto content = edited != nullptr ? Result<std::string>(*edited) : read_from_disk(*place, {shown_as}, size_max);
  if (!content) return content;
  if (read_hashes != nullptr) read_hashes->hashes_.insert(hash_content(*content));
  if (read_log != nullptr) {
    auto& files = read_log->files_;
    if (std::none_of(files.begin(), files.end(), [&](const ReadFile& known) { return known.path == path; }))
      files.push_back({path, *content});
  }
  if (auto text = xml_as_utf8(*content)) content = std::move(*text);
  return content;
}

namespace {

// @param file  Is closed. Null: it could not be opened.
bool write_and_close(std::FILE* file, std::string_view content) {
  if (file == nullptr) return false;
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size();
  // A full disk may show only when the buffer is flushed.
  return std::fclose(file) == 0 && written;
}

// Of a device or a pipe, without waiting for who reads it.
std::FILE* open_to_write_into(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return nullptr;
  (void)::fcntl(descriptor, F_SETFL, 0);
  return ::fdopen(descriptor, "wb");
}

}  // namespace

Result<void> write_file(const std::filesystem::path& given, std::string_view content) {
  const auto unwritable = [&] {
    return fail("file.unwritable", "cannot be written: " + std::generic_category().message(errno),
                SourceSpan{given.string()});
  };
  std::error_code error;
  const auto status = std::filesystem::status(given, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
      !std::filesystem::is_directory(status)) {
    if (!write_and_close(open_to_write_into(given), content)) return unwritable();
    return {};
  }
  // Who is named by a link is written, and the link stays.
  const std::filesystem::path path =
      std::filesystem::is_symlink(given, error) ? std::filesystem::weakly_canonical(given, error) : given;
  std::filesystem::path temporary = path;
  temporary += "." + std::to_string(::getpid()) + ".part";
  if (!write_and_close(std::fopen(temporary.c_str(), "wb"), content)) {
    const int why = errno;
    std::remove(temporary.c_str());
    errno = why;
    return unwritable();
  }
  if (std::rename(temporary.c_str(), path.c_str()) != 0) {
    const int why = errno;
    std::remove(temporary.c_str());
    errno = why;
    return unwritable();
  }
  return {};
}

}  // namespace sentree::text
