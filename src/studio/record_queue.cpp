#include "sentree/studio/detail/record_queue.h"

#include <pthread.h>
#include <signal.h>

namespace sentree::studio {

RecordQueue::RecordQueue(History& history) : history_(history) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

RecordQueue::~RecordQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void RecordQueue::put(TimePoint time, record::RunRecord record) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_.size() < (held_ ? kHeldMax : kWaitingMax) || stopping_; });
  waiting_.emplace_back(time, std::move(record));
  if (waiting_.size() == kEnough) changed_.notify_all();
}

void RecordQueue::drain() {
  const std::lock_guard one_at_a_time(draining_);
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) return;
    taken_.swap(waiting_);
    changed_.notify_all();
  }
  for (const auto& [time, record] : taken_) history_.take(time, record);
  taken_.clear();
}

RecordQueue::Hold::Hold(RecordQueue& queue) : queue_(queue), lock_(queue.draining_) {
  const std::lock_guard lock(queue_.mutex_);
  queue_.held_ = true;
}

RecordQueue::Hold::~Hold() {
  const std::lock_guard lock(queue_.mutex_);
  queue_.held_ = false;
  queue_.changed_.notify_all();
}

void RecordQueue::work() {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stopping_ || waiting_.size() >= kEnough; });
      if (stopping_) return;
    }
    drain();
  }
}

}  // namespace sentree::studio
