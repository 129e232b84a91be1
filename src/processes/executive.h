#pragma once

#include <chrono>
#include <filesystem>
#include <optional>

#include "sentree/base/result.h"

namespace sentree::processes {

/// How long the processes of a durable run wait for one that goes on with it, if SENTREE_ORPHANS_WAIT says nothing else
/// [s].
inline constexpr std::chrono::seconds kOrphansWait{60};

/// Writes who executes a durable run: this process. Errors: file.*.
[[nodiscard]] Result<void> note_executive(const std::filesystem::path& file);

/// In a process of a durable run: whether somebody executes that run. A killed executive leaves its processes behind,
/// for who resumes the run; none of them stays for ever.
class ExecutiveWatch {
 public:
  /// @param file  Written by `note_executive`; empty: nobody is ever missed.
  explicit ExecutiveWatch(std::filesystem::path file) : file_(std::move(file)) {}
  /// Nobody has executed it for as long as orphans wait. Asked every now and then.
  [[nodiscard]] bool is_missed();

 private:
  const std::filesystem::path file_;
  std::optional<std::chrono::steady_clock::time_point> missed_since_;
  std::chrono::seconds wait_ = kOrphansWait;  // as the executive said last
};

}  // namespace sentree::processes
