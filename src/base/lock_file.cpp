#include "sentree/base/lock_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

namespace sentree {

LockFile LockFile::take(const std::filesystem::path& path) {
  constexpr mode_t kAnybody = 0666;  // less the umask
  LockFile lock;
  int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kAnybody);
  // Another user's can be locked all the same.
  if (descriptor < 0 && errno == EACCES) descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) {
    lock.why_ = errno;
    return lock;
  }
  std::shared_ptr<const int> held(new int(descriptor), [](const int* file) {
    ::close(*file);
    delete file;
  });
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
    lock.state_ = State::kHeld;
    lock.descriptor_ = std::move(held);
    return lock;
  }
  if (errno != EWOULDBLOCK) {
    lock.why_ = errno;
    return lock;
  }
  lock.state_ = State::kTaken;
  char line[512];
  const ssize_t size = ::pread(descriptor, line, sizeof line, 0);
  lock.other_.assign(line, size > 0 ? static_cast<std::size_t>(size) : 0);
  lock.other_ = lock.other_.substr(0, lock.other_.find('\n'));
  if (lock.other_.empty()) lock.other_ = "another program";
  return lock;
}

void tell_holder(int descriptor, std::string_view line) {
  const std::string whole = std::string(line) + "\n";
  if (::ftruncate(descriptor, 0) == 0) (void)!::pwrite(descriptor, whole.data(), whole.size(), 0);
}

}  // namespace sentree
