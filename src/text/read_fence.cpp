#include "sentree/text/read_fence.h"

#include <algorithm>
#include <mutex>
#include <system_error>

namespace sentree::text {

namespace {

namespace fs = std::filesystem;

std::mutex sealed_mutex;
struct Sealed {
  fs::path folder;
  fs::path stands_for;
};
std::vector<Sealed>& sealed() {
  static std::vector<Sealed> folders;
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

SealedFolder::SealedFolder(const fs::path& folder, const fs::path& stands_for) : folder_(real(folder)) {
  const std::lock_guard lock(sealed_mutex);
  sealed().push_back({folder_, stands_for.lexically_normal()});
}

SealedFolder::~SealedFolder() {
  const std::lock_guard lock(sealed_mutex);
  auto& folders = sealed();
  folders.erase(
      std::find_if(folders.begin(), folders.end(), [&](const Sealed& known) { return known.folder == folder_; }));
}

ReadFence::ReadFence(const fs::path& project, const std::vector<fs::path>& also) : outer_(innermost) {
  innermost = this;
  const std::lock_guard lock(sealed_mutex);
  if (sealed().empty()) return;
  const fs::path below = real(project);
  const auto found = std::find_if(sealed().begin(), sealed().end(),
                                  [&](const Sealed& known) { return is_below(below, known.folder); });
  if (found == sealed().end()) return;
  inside_.push_back(found->folder);
  stands_for_ = found->stands_for;
  for (const fs::path& folder : also) {
    if (!folder.empty()) inside_.push_back(real(folder));
  }
}

ReadFence::~ReadFence() { innermost = outer_; }

std::optional<fs::path> ReadFence::place_of(const fs::path& file) {
  fs::path at = file;
  for (const ReadFence* fence = innermost; fence != nullptr; fence = fence->outer_) {
    const auto& inside = fence->inside_;
    if (inside.empty()) continue;
    const auto lets = [&](const fs::path& path) {
      return std::any_of(inside.begin(), inside.end(), [&](const fs::path& folder) { return is_below(path, folder); });
    };
    if (lets(real(at))) continue;
    const fs::path named = at.lexically_normal();
    if (fence->stands_for_.empty() || !is_below(named, fence->stands_for_)) return std::nullopt;
    at = inside.front() / named.lexically_relative(fence->stands_for_);
    if (!lets(real(at))) return std::nullopt;
  }
  return at;
}

}  // namespace sentree::text
