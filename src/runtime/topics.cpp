#include "sentree/runtime/topics.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

void Topics::deliver(const Told& what) const {
  const auto takers = takers_.find(what.what->topic);
  if (takers == takers_.end()) return;
  for (const Take& take : takers->second) take(what);
}

bool TopicInbox::add(const Scheduler& scheduler, const Topics::Told& told) {
  if (scheduler.is_virtual() && !told.delayed) return true;
  const bool has_room = scheduler.is_virtual() || waiting_.fetch_add(1) < static_cast<std::int64_t>(kWaitingMax);
  const std::lock_guard lock(mutex_);
  if (has_room) {
    told_.push_back(told);
    if (told_.size() > kWaitingMax) told_.pop_front();
    return true;
  }
  waiting_.fetch_sub(1);
  if (lost_++ == 0) first_lost_ = told.what->topic;
  return false;
}

std::optional<Topics::Told> TopicInbox::taken(const mission::Publication& what, const std::string& subscriber,
                                              Publisher& publisher) {
  // Nothing waits in virtual time.
  if (waiting_.load() > 0) waiting_.fetch_sub(1);
  std::optional<Topics::Told> told;
  Message message;
  {
    const std::lock_guard lock(mutex_);
    // What a durable run found in its journal is not there.
    const auto found = std::find_if(told_.begin(), told_.end(), [&](const auto& each) { return &*each.what == &what; });
    if (found != told_.end()) {
      told = std::move(*found);
      told_.erase(told_.begin(), found + 1);
    }
    if (lost_ == 0) return told;
    message.data = Map{{"count", std::exchange(lost_, 0)}, {"first", first_lost_}};
  }
  message.source = subscriber;
  message.name = "observer.lost";
  publisher.publish(std::move(message));
  return told;
}

std::vector<Topics::Told> TopicInbox::waiting() {
  const std::lock_guard lock(mutex_);
  return {told_.begin(), told_.end()};
}

TimePoint TopicInbox::time_of(TimePoint& not_before, TimePoint now, Duration delay) {
  not_before = std::max(not_before, add_saturating(now, delay));
  return not_before;
}

}  // namespace sentree::runtime
