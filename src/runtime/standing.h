#pragma once

#include <atomic>
#include <mutex>
#include <utility>

#include "sentree/mission/faults.h"

namespace sentree::runtime {

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
  void spare_calls(bool spared) { calls_spared_ = spared; }
  [[nodiscard]] bool calls_spared() const { return calls_spared_; }

  [[nodiscard]] Duration delay_of(std::string_view message) {
    return any() ? with([&](mission::Faults& faults) { return faults.delay_of(message); }) : Duration(0);
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
  mutable std::mutex mutex_;
  mission::Faults faults_;
  std::atomic<bool> any_ = false;
  std::atomic<bool> calls_spared_ = false;
};

}  // namespace sentree::runtime
