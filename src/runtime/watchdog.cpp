#include "sentree/runtime/watchdog.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

namespace sentree::runtime {

namespace {

std::atomic<std::size_t> left_behind{0};

std::int64_t used_ns(clockid_t clock) {
  timespec time{};
  // A thread that has ended has no clock, and nothing to answer for.
  if (clock_gettime(clock, &time) != 0) return -1;
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

void Watched::in_this_thread() {
  thread_local const clockid_t clock = [] {
    clockid_t id{};
    pthread_getcpuclockid(pthread_self(), &id);
    return id;
  }();
  clock_.store(clock, std::memory_order_relaxed);
}

Watchdog::Watchdog(Duration script_max) : script_max_(script_max) {}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Watchdog::watch(std::shared_ptr<Watched> watched) {
  const std::lock_guard lock(mutex_);
  watched_.push_back(std::move(watched));
  if (!thread_.joinable()) thread_ = std::thread([this] { look(); });
}

std::string Watchdog::reason(const SourceSpan& script, const std::string& who) const {
  return fmt::format("{}: this script does not end (more than {} ms of processor time in one step); {} is given up",
                     to_string(script), script_max_ / std::chrono::milliseconds(1), who);
}

void Watchdog::look() {
  const auto period =
      std::clamp<Duration>(script_max_ / 4, std::chrono::milliseconds(5), std::chrono::milliseconds(250));
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, period, [this] { return stopping_; })) {
    std::erase_if(watched_, [](const auto& watched) { return watched.use_count() == 1; });
    // Without the lock, since who is told may want to watch something else.
    const auto all = watched_;
    lock.unlock();
    for (const auto& watched : all) look_at(*watched);
    lock.lock();
  }
}

void Watchdog::look_at(Watched& watched) {
  scxml::ExecutionWatch& execution = watched.execution_;
  const std::uint64_t step = execution.step();
  if (step == 0 || execution.given_up()) return;
  const std::int64_t used = used_ns(watched.clock_.load(std::memory_order_relaxed));
  if (step != watched.step_) {
    watched.step_ = step;
    watched.used_ns_ = used;
  } else if (used - watched.used_ns_ > script_max_.count()) {
    if (const auto script = execution.give_up(step)) watched.hung_(*script);
  }
}

bool LeavableThread::run(std::function<void()> task) {
  std::thread thread([shared = shared_, task = std::move(task)] {
    task();
    const std::lock_guard lock(shared->mutex);
    shared->ended = true;
    shared->changed.notify_all();
  });
  std::unique_lock lock(shared_->mutex);
  shared_->changed.wait(lock, [this] { return shared_->ended || shared_->left; });
  if (shared_->ended) {
    lock.unlock();
    thread.join();
    return true;
  }
  leave_behind(thread);
  return false;
}

void LeavableThread::leave() {
  const std::lock_guard lock(shared_->mutex);
  shared_->left = true;
  shared_->changed.notify_all();
}

void leave_behind(std::thread& thread) {
  leave_behind(thread.native_handle());
  thread.detach();
}

void leave_behind(pthread_t thread) {
  const sched_param lowest{};
  pthread_setschedparam(thread, SCHED_IDLE, &lowest);
  ++left_behind;
}

std::size_t threads_left_behind() { return left_behind; }

void keep_for_ever(std::shared_ptr<void> what) {
  static std::mutex mutex;
  // Never destroyed: static destructors run while those threads do.
  static auto* const kept = new std::vector<std::shared_ptr<void>>();
  const std::lock_guard lock(mutex);
  kept->push_back(std::move(what));
}

}  // namespace sentree::runtime
