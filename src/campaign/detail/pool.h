#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "sentree/base/result.h"

namespace sentree::campaign {

/// Work that processes of their own do, so that what breaks one of them breaks nothing else.
struct PoolTask {
  std::size_t jobs = 1;  ///< Processes at a time, at least 1.
  /// The next piece of work; nothing: none at present. Asked again after each that is done or lost.
  std::function<std::optional<std::uint64_t>()> next;
  /// In a child of this process, which is as this one was when the pool began.
  std::function<std::string(std::uint64_t)> work;
  /// There, after each piece: true if another child had better do the rest.
  std::function<bool()> spoilt;
  std::function<void(std::uint64_t, std::string)> done;
  /// A child that is stopped for so long (SIGSTOP) is ended: nobody may ever let it go on.
  std::chrono::milliseconds stopped_max{10'000};
  /// The child that did it died, or was ended; what it was given besides is given to another.
  std::function<void(std::uint64_t, std::string why)> lost;
  /// Asked several times a second; false: the children are killed, and what they have not done is not done.
  std::function<bool()> goes_on;
};

/// Returns when nothing is left to do, in the thread of the caller, in which all but `work` and `spoilt` are called.
/// The process should have no other threads that hold locks. Error: campaign.process.
[[nodiscard]] Result<void> run_pool(const PoolTask& task);

}  // namespace sentree::campaign
