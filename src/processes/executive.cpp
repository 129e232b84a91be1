#include "sentree/processes/executive.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include <fmt/format.h>

#include "sentree/processes/supervisor.h"
#include "sentree/text/file.h"

namespace sentree::processes {

namespace {

constexpr long kOrphansWaitMax = 7 * 24 * 3600;

std::chrono::seconds orphans_wait() {
  const char* text = std::getenv("SENTREE_ORPHANS_WAIT");
  char* end = nullptr;
  const long seconds = text != nullptr ? std::strtol(text, &end, 10) : 0;
  if (text == nullptr || end == text || *end != '\0' || seconds < 0) return kOrphansWait;
  return std::chrono::seconds(std::min(seconds, kOrphansWaitMax));
}

}  // namespace

Result<void> note_executive(const std::filesystem::path& file) {
  const pid_t self = getpid();
  return text::write_file(file, fmt::format("{} {} {}\n", self, process_begun(self), orphans_wait().count()));
}

bool ExecutiveWatch::is_missed() {
  if (file_.empty()) return false;
  pid_t pid = 0;
  std::uint64_t begun = 0;
  long wait = 0;
  std::istringstream words(text::read_file(file_).value_or(""));
  if (words >> pid >> begun >> wait) {
    wait_ = std::chrono::seconds(std::clamp(wait, 0L, kOrphansWaitMax));
    if (begun != 0 && process_begun(pid) == begun) {
      missed_since_.reset();
      return false;
    }
  }
  const auto now = std::chrono::steady_clock::now();
  if (!missed_since_) missed_since_ = now;
  return now - *missed_since_ >= wait_;
}

}  // namespace sentree::processes
