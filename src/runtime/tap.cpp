#include "sentree/runtime/tap.h"

#include <algorithm>

#include "sentree/project/project.h"

namespace sentree::runtime {

void Tap::observe(const Message& message) {
  last_ = message.sequence;
  const SteadyClock::rep until = wanted_until_.load(std::memory_order_relaxed);
  if (until == 0) return;
  const std::lock_guard lock(mutex_);
  if (SteadyClock::now().time_since_epoch().count() > until) {
    wanted_until_ = 0;
    kept_.clear();
    return;
  }
  if (kept_.size() >= kKeptMax) kept_.pop_front();
  kept_.push_back(message);
  changed_.notify_all();
}

Tap::Batch Tap::take(std::int64_t after, std::string_view pattern, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  const auto now = SteadyClock::now();
  wanted_until_ = (now + kLease).time_since_epoch().count();
  const auto until = now + std::clamp(wait, std::chrono::milliseconds(0), kWaitMax);
  Batch batch;
  batch.next = after < 0 ? last_.load() : static_cast<std::uint64_t>(after);
  for (;;) {
    if (!kept_.empty() && kept_.front().sequence > batch.next + 1 && after >= 0) {
      batch.missed += kept_.front().sequence - batch.next - 1;
      batch.next = kept_.front().sequence - 1;
    }
    const auto from = std::upper_bound(kept_.begin(), kept_.end(), batch.next,
                                       [](std::uint64_t number, const Message& m) { return number < m.sequence; });
    for (auto message = from; message != kept_.end() && batch.messages.size() < kBatchMax; ++message) {
      batch.next = message->sequence;
      if (project::matches_pattern(pattern, message->name)) batch.messages.push_back(to_json(*message));
    }
    if (!batch.messages.empty() || changed_.wait_until(lock, until) == std::cv_status::timeout) return batch;
  }
}

}  // namespace sentree::runtime
