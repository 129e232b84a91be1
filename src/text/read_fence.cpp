#include "sentree/text/read_fence.h"

#include <algorithm>
#include <mutex>
#include <system_error>

namespace sentree::text {

namespace {

namespace fs = std::filesystem;

std::mutex sealed_mutex;
std::vector<fs::path>& sealed() {
  static std::vector<fs::path> folders;
  return folders;
}
thread_local const ReadFence* innermost = nullptr;

// As it is on disk, links followed as far as there is something.
fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path found = fs::weakly_canonical(path, error);
  return error ? fs::absolute(path, error).lexically_normal() : found;
}

bool is_below(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

}  // namespace

SealedFolder::SealedFolder(fs::path folder) : folder_(real(folder)) {
  const std::lock_guard lock(sealed_mutex);
  sealed().push_back(folder_);
}

SealedFolder::~SealedFolder() {
  const std::lock_guard lock(sealed_mutex);
  auto& folders = sealed();
  folders.erase(std::find(folders.begin(), folders.end(), folder_));
}

ReadFence::ReadFence(const fs::path& project, const std::vector<fs::path>& also) : outer_(innermost) {
  innermost = this;
  const std::lock_guard lock(sealed_mutex);
  if (sealed().empty()) return;
  const fs::path below = real(project);
  const auto found =
      std::find_if(sealed().begin(), sealed().end(), [&](const fs::path& folder) { return is_below(below, folder); });
  if (found == sealed().end()) return;
  inside_.push_back(*found);
  for (const fs::path& folder : also) {
    if (!folder.empty()) inside_.push_back(real(folder));
  }
}

ReadFence::~ReadFence() { innermost = outer_; }

bool ReadFence::lets(const fs::path& file) {
  for (const ReadFence* fence = innermost; fence != nullptr; fence = fence->outer_) {
    if (fence->inside_.empty()) continue;
    const fs::path path = real(file);
    const auto& inside = fence->inside_;
    if (std::none_of(inside.begin(), inside.end(), [&](const fs::path& folder) { return is_below(path, folder); }))
      return false;
  }
  return true;
}

}  // namespace sentree::text
