#include "sentree/base/temporary_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <mutex>
#include <set>
#include <string>
#include <system_error>

namespace sentree {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "sentree-";
constexpr std::size_t kEndingSize = 7;  // "-8fK2aQ"
// Others name folders like this too, and make them with 0700. The sticky bit says nothing else about a folder of one
// owner.
constexpr mode_t kOurs = S_ISVTX | S_IRWXU;
constexpr std::chrono::seconds kAge = std::chrono::minutes(1);

bool is_ours(const std::string& name) {
  return name.starts_with(kPrefix) && name.size() > kPrefix.size() + kEndingSize &&
         name[name.size() - kEndingSize] == '-';
}

int open_folder(const fs::path& folder) {
  return open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

}  // namespace

void clean_temporary_folders(const fs::path& place, std::chrono::seconds age) {
  constexpr std::size_t kLookedAtMax = 10'000;
  std::error_code error;
  std::size_t looked_at = 0;
  for (fs::directory_iterator it(place, error), end; !error && it != end && ++looked_at < kLookedAtMax;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!is_ours(name)) continue;
    const int folder = open_folder(it->path());
    if (folder < 0) continue;
    struct stat facts {};
    const bool is_old = fstat(folder, &facts) == 0 && facts.st_uid == geteuid() &&
                        (facts.st_mode & ALLPERMS) == kOurs && std::time(nullptr) - facts.st_ctime >= age.count();
    if (is_old && flock(folder, LOCK_EX | LOCK_NB) == 0) {
      std::error_code ignored;
      fs::remove_all(it->path(), ignored);
    }
    close(folder);
  }
}

void clean_temporary_folders() {
  static std::once_flag cleaned;
  std::call_once(cleaned, [] {
    std::error_code error;
    const fs::path place = fs::temp_directory_path(error);
    if (!error) clean_temporary_folders(place, kAge);
    // Where sockets go if that one's path is too long.
    if (place != "/tmp") clean_temporary_folders("/tmp", kAge);
  });
}

TemporaryFolder::TemporaryFolder(std::string_view purpose, std::size_t path_max) {
  std::error_code error;
  fs::path place = fs::temp_directory_path(error);
  if (error) return;
  if (place.native().size() + 1 + kPrefix.size() + purpose.size() + kEndingSize > path_max) place = "/tmp";
  clean_temporary_folders();
  std::string name = (place / (std::string(kPrefix) + std::string(purpose) + "-XXXXXX")).string();
  if (mkdtemp(name.data()) == nullptr) return;
  path_ = name;
  (void)chmod(name.c_str(), kOurs);
  lock_ = open_folder(path_);
  if (lock_ >= 0) flock(lock_, LOCK_SH | LOCK_NB);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  if (!path_.empty()) fs::remove_all(path_, error);
  if (lock_ >= 0) close(lock_);
}

void keep_temporary_folder(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<fs::path> kept;
  const std::lock_guard lock(mutex);
  if (!is_ours(folder.filename().string()) || !kept.insert(folder).second) return;
  // Held until the process ends.
  if (const int held = open_folder(folder); held >= 0) flock(held, LOCK_SH | LOCK_NB);
}

}  // namespace sentree
