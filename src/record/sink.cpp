#include "sentree/record/sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace sentree::record {

namespace {

tl::unexpected<Diagnostic> unwritable(const std::string& name) {
  return fail("record.unwritable", "cannot be written: " + std::generic_category().message(errno), SourceSpan{name});
}

}  // namespace

Result<std::unique_ptr<FileSink>> FileSink::create(const std::filesystem::path& path) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return unwritable(path.string());
  (void)::flock(file, LOCK_EX | LOCK_NB);
  return std::unique_ptr<FileSink>(new FileSink(file, path.string()));
}

FileSink::~FileSink() { ::close(file_); }

Result<void> FileSink::write(std::string_view bytes) {
  const std::uint64_t end = size_ + bytes.size();
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      auto failure = unwritable(name_);
      // Half a record would be taken for damage.
      if (::ftruncate(file_, static_cast<off_t>(size_)) != 0) return failure;
      (void)::lseek(file_, static_cast<off_t>(size_), SEEK_SET);
      return failure;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  size_ = end;
  return {};
}

}  // namespace sentree::record
