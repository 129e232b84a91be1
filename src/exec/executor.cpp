#include "sentree/exec/executor.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "sentree/base/assert.h"

namespace sentree::exec {

/// Time since the executor was made.
class Executor::SteadyClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return TimePoint(std::chrono::steady_clock::now() - start_); }
  [[nodiscard]] std::chrono::steady_clock::time_point wall(TimePoint when) const {
    return start_ + when.time_since_epoch();
  }

 private:
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct Executor::Signals {
  std::mutex mutex;
  std::condition_variable changed;
  bool woken = false;
  bool halted = false;

  void set(bool Signals::*which) {
    {
      const std::lock_guard lock(mutex);
      this->*which = true;
    }
    changed.notify_all();
  }
};

Executor::Executor(bt::Tree tree, ExecutorOptions options)
    : clock_(std::make_unique<SteadyClock>()),
      runner_(std::move(tree), clock_.get()),
      options_(options),
      signals_(std::make_shared<Signals>()) {
  SENTREE_ASSERT(options.period > Duration(0));
  runner_.effects().waker = [signals = signals_] { signals->set(&Signals::woken); };
}

Executor::~Executor() = default;

void Executor::halt() { signals_->set(&Signals::halted); }
void Executor::wake() { signals_->set(&Signals::woken); }

std::optional<Executor::Call> Executor::pending() const {
  const auto call = calls_.pending();
  if (!call) return std::nullopt;
  const bt::Tree& tree = runner_.tree();
  return Call{tree.path(call->node), std::string(tree.registration(call->node)), call->lasted};
}

bt::Status Executor::run() {
  const bt::WatchCalls watched(calls_);
  TimePoint planned = clock_->now();
  for (;;) {
    {
      const std::lock_guard lock(signals_->mutex);
      signals_->woken = false;
      if (std::exchange(signals_->halted, false)) break;
    }
    const bt::Status status = runner_.tick();
    ++ticks_;
    if (status != bt::Status::kRunning) return status;
    if (runner_.effects().wake) continue;  // a node yielded

    TimePoint next = planned + options_.period;
    const TimePoint now = clock_->now();
    if (now > next) {
      const auto over = (now - next + options_.period - Duration(1)) / options_.period;
      missed_ += static_cast<std::uint64_t>(over);
      next += over * options_.period;
    }
    const TimePoint until = std::min(next, runner_.state().next_timer());
    std::unique_lock lock(signals_->mutex);
    signals_->changed.wait_until(lock, clock_->wall(until), [this] { return signals_->woken || signals_->halted; });
    if (clock_->now() >= next) planned = next;
  }
  runner_.halt();
  return bt::Status::kIdle;
}

}  // namespace sentree::exec
