#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"

namespace sentree::runtime {

/// Keeps the newest messages of the stream for those who ask for them now and then. A listener of the stream.
/// Cost of a message while nobody has asked for `kLease`: a load.
class Tap {
 public:
  /// Messages kept; who asks too late has missed the older ones.
  static constexpr std::size_t kKeptMax = 1U << 14U;
  /// Messages in one answer.
  static constexpr std::size_t kBatchMax = 1000;
  static constexpr std::chrono::seconds kLease{10};
  static constexpr std::chrono::milliseconds kWaitMax{2000};

  void observe(const Message& message);
  /// Whether somebody has asked lately: else a message need not be made for it. A load.
  [[nodiscard]] bool is_wanted() const { return wanted_until_.load(std::memory_order_relaxed) != 0; }

  struct Batch {
    std::uint64_t next = 0;             ///< To be given as `after` next time.
    std::uint64_t missed = 0;           ///< Messages after `after` that are not kept any more, or never were.
    std::vector<std::string> messages;  ///< As JSON.
  };
  /// Messages after number `after` whose names match `pattern`; waits for one up to `wait`. Negative: from now on.
  [[nodiscard]] Batch take(std::int64_t after, std::string_view pattern, std::chrono::milliseconds wait);

 private:
  using SteadyClock = std::chrono::steady_clock;
  std::atomic<SteadyClock::rep> wanted_until_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> kept_;
  std::atomic<std::uint64_t> last_ = 0;  // number of the newest message, kept or not
};

}  // namespace sentree::runtime
