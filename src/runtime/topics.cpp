#include "sentree/runtime/topics.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

bool TopicInbox::add(const Scheduler& scheduler, const ToldTopic& told) {
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

std::optional<ToldTopic> TopicInbox::taken(const mission::Publication& what, const std::string& subscriber,
                                           Publisher& publisher) {
  // Nothing waits in virtual time.
  if (waiting_.load() > 0) waiting_.fetch_sub(1);
  std::optional<ToldTopic> told;
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

std::vector<ToldTopic> TopicInbox::waiting() {
  const std::lock_guard lock(mutex_);
  return {told_.begin(), told_.end()};
}

}  // namespace sentree::runtime
