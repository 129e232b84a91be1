#include "sentree/runtime/stream.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

Stream::Stream(Scheduler& scheduler) : scheduler_(scheduler), actor_(scheduler.add_actor("observer")) {}

Message Stream::publish(Message message) {
  bool start_draining = false;
  {
    std::unique_lock lock(mutex_);
    // A listener that publishes is the one who would make room.
    if (!scheduler_.is_virtual()) {
      room_.wait_for(lock, std::chrono::seconds(1), [&] { return pending_.size() < kPendingMax; });
    }
    message.sequence = ++sequence_;
    message.stamp = stamp_ = std::max(stamp_, message.stamp) + 1;
    message.time = scheduler_.now();
    message.tick = tick_;
    pending_.push_back(message);
    start_draining = !std::exchange(draining_, true);
  }
  if (start_draining) {
    if (scheduler_.is_virtual())
      drain();
    else
      scheduler_.post(actor_, [this] { drain(); });
  }
  return message;
}

void Stream::drain() {
  for (;;) {
    Message message;
    {
      const std::lock_guard lock(mutex_);
      if (pending_.empty()) {
        draining_ = false;
        return;
      }
      message = std::move(pending_.front());
      pending_.pop_front();
    }
    room_.notify_all();
    for (const Listener& listener : listeners_) listener(message);
  }
}

void Stream::flush() { drain(); }

}  // namespace sentree::runtime
