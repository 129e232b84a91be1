#include "sentree/record/sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "sentree/base/write_all.h"

namespace sentree::record {

namespace {

tl::unexpected<Diagnostic> unwritable(const std::string& name) {
  return fail("record.unwritable", "cannot be written: " + std::generic_category().message(errno), SourceSpan{name});
}

}  // namespace

Result<std::unique_ptr<FileSink>> FileSink::create(const std::filesystem::path& path) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  // Nobody waits for whom might read a pipe.
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0644);
  if (file < 0) return unwritable(path.string());
  (void)::fcntl(file, F_SETFL, 0);
  (void)::flock(file, LOCK_EX | LOCK_NB);
  return std::unique_ptr<FileSink>(new FileSink(file, path.string()));
}

FileSink::~FileSink() { ::close(file_); }

Result<void> FileSink::write(std::string_view bytes) {
  if (!write_all(file_, bytes)) {
    auto failure = unwritable(name_);
    // Half a record would be taken for damage.
    if (::ftruncate(file_, static_cast<off_t>(size_)) != 0) return failure;
    (void)::lseek(file_, static_cast<off_t>(size_), SEEK_SET);
    return failure;
  }
  size_ += bytes.size();
  return {};
}

}  // namespace sentree::record
