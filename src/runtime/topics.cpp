#include "sentree/runtime/topics.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

void Topics::deliver(mission::Publication what, Duration delay) const {
  const auto takers = takers_.find(what.topic);
  if (takers == takers_.end()) return;
  const mission::Shared<mission::Publication> shared(std::move(what));
  for (const Take& take : takers->second) take(shared, delay);
}

bool TopicInbox::has_room(const Scheduler& scheduler, const std::string& topic) {
  if (scheduler.is_virtual()) return true;
  if (waiting_.fetch_add(1) < static_cast<std::int64_t>(kWaitingMax)) return true;
  waiting_.fetch_sub(1);
  const std::lock_guard lock(mutex_);
  if (lost_++ == 0) first_lost_ = topic;
  return false;
}

void TopicInbox::taken(const std::string& subscriber, Publisher& publisher) {
  // Nothing waits in virtual time.
  if (waiting_.load() > 0) waiting_.fetch_sub(1);
  Message message;
  {
    const std::lock_guard lock(mutex_);
    if (lost_ == 0) return;
    message.data = Map{{"count", std::exchange(lost_, 0)}, {"first", first_lost_}};
  }
  message.source = subscriber;
  message.name = "observer.lost";
  publisher.publish(std::move(message));
}

TimePoint TopicInbox::time_of(TimePoint& not_before, TimePoint now, Duration delay) {
  not_before = std::max(not_before, add_saturating(now, delay));
  return not_before;
}

}  // namespace sentree::runtime
