#include "sentree/record/source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace sentree::record {

namespace {

tl::unexpected<Diagnostic> unreadable(const std::string& name) {
  return fail("record.unreadable", "cannot be read: " + std::generic_category().message(errno), SourceSpan{name});
}

}  // namespace

Result<std::unique_ptr<Source>> FileSource::open(const std::filesystem::path& path) {
  const std::string name = path.string();
  // A FIFO would wait for somebody who writes.
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) {
    if (errno == ENOENT) return fail("file.not-found", "no such file", SourceSpan{name});
    return unreadable(name);
  }
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    return fail("file.not-a-file", "not a regular file", SourceSpan{name});
  }
  return std::unique_ptr<Source>(new FileSource(file, static_cast<std::uint64_t>(status.st_size), name));
}

FileSource::~FileSource() { ::close(file_); }

Result<std::string> FileSource::read(std::uint64_t offset, std::uint64_t length) {
  std::string bytes;
  if (offset >= size_) return bytes;
  bytes.resize(std::min(length, size_ - offset));
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t count = ::pread(file_, bytes.data() + got, bytes.size() - got, static_cast<off_t>(offset + got));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable(name_);
    if (count == 0) break;  // somebody shortened it
    got += static_cast<std::size_t>(count);
  }
  bytes.resize(got);
  return bytes;
}

}  // namespace sentree::record
