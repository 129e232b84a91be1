#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>

#include "sentree/mission/faults.h"

namespace sentree::runtime {

/// What faults spare: nothing, calls, or calls and every message that could be delayed.
enum class Spared : std::uint8_t { kNone, kCalls, kMessages };

/// The faults that stand in a run whose parts have threads of their own. From any thread. While none stands, a question
/// costs a load.
class StandingFaults {
  struct Count {
    explicit Count(StandingFaults& of) : owner(of) {}
    ~Count() { owner.any_.store(!owner.faults_.empty(), std::memory_order_release); }
    StandingFaults& owner;
  };

 public:
  /// Asks them, or changes them.
  template <class Work>
  auto with(const Work& work) {
    const std::lock_guard lock(mutex_);
    const Count count(*this);
    return work(faults_);
  }

  StandingFaults() = default;
  explicit StandingFaults(const std::vector<project::DelayFault>& delays) { set(mission::Faults(delays)); }

  [[nodiscard]] bool any() const { return any_.load(std::memory_order_acquire); }
  [[nodiscard]] mission::Faults get() const {
    const std::lock_guard lock(mutex_);
    return faults_;
  }
  void set(mission::Faults faults) {
    with([&](mission::Faults& mine) { mine = std::move(faults); });
  }

  /// In a replay services answer what they answered then, faults included: no call is delayed or falsified again.
  /// What a recording says of when leaves took what was held back is known as well: no message is delayed again. Those
  /// that are spared use up counted faults as others do.
  void spare(Spared what) { spared_ = what; }
  [[nodiscard]] bool spares_calls() const { return spared_ != Spared::kNone; }

  [[nodiscard]] Duration delay_of_call(std::string_view message) {
    const Duration delay = used_delay_of(message);
    return spares_calls() ? Duration(0) : delay;
  }
  /// Of what passes between the mission and its leaves, and of what reaches who subscribes to a topic.
  [[nodiscard]] Duration delay_of(std::string_view message) {
    const Duration delay = used_delay_of(message);
    return spared_ == Spared::kMessages ? Duration(0) : delay;
  }
  void falsify(std::string_view call, const idl::Method& method, Value& result) {
    if (any()) with([&](mission::Faults& faults) { faults.falsify(call, method, result); });
  }
  [[nodiscard]] bool fails(mission::Failing how, std::string_view call) {
    return any() && with([&](mission::Faults& faults) { return faults.fails(how, call); });
  }
  [[nodiscard]] std::optional<bt::Status> forced(std::string_view leaf) {
    return any() ? with([&](mission::Faults& faults) { return faults.forced(leaf); }) : std::nullopt;
  }

 private:
  Duration used_delay_of(std::string_view message) {
    return any() ? with([&](mission::Faults& faults) { return faults.delay_of(message); }) : Duration(0);
  }

  mutable std::mutex mutex_;
  mission::Faults faults_;
  std::atomic<bool> any_ = false;
  std::atomic<Spared> spared_ = Spared::kNone;
};

}  // namespace sentree::runtime
