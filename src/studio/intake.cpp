#include "sentree/studio/intake.h"

#include <pthread.h>
#include <signal.h>

#include <cstring>

#include "sentree/record/packed_json.h"

namespace sentree::studio {

Intake::Intake(History& history) : history_(history) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Intake::~Intake() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

bool Intake::is_wanted(const record::Channel& channel) {
  if (channel.id >= known_.size()) {
    known_.resize(channel.id + 1U);
    topics_.resize(channel.id + 1U);
  }
  if (!known_[channel.id]) {
    known_[channel.id] = true;
    if (history_.wants(channel.topic)) topics_[channel.id] = channel.topic;
  }
  return !topics_[channel.id].empty();
}

void Intake::take(const record::Channel& channel, TimePoint time, std::string_view packed) {
  std::unique_lock lock(mutex_);
  if (!is_wanted(channel)) return;
  changed_.wait(lock, [&] { return waiting_.size() < (held_ ? kHeldMax : kWaitingMax) || stopping_; });
  const Head head{time.time_since_epoch().count(), static_cast<std::uint32_t>(packed.size()), channel.id};
  const bool was_enough = waiting_.size() >= kEnough;
  waiting_.append(reinterpret_cast<const char*>(&head), sizeof head);
  waiting_.append(packed);
  if (!was_enough && waiting_.size() >= kEnough) changed_.notify_all();
}

void Intake::drain() {
  const std::lock_guard one_at_a_time(draining_);
  std::string bytes;
  std::vector<std::string> topics;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) return;
    bytes.swap(waiting_);
    topics = topics_;
    changed_.notify_all();
  }
  std::string_view rest = bytes;
  while (!rest.empty()) {
    Head head;
    std::memcpy(&head, rest.data(), sizeof head);
    json_.clear();
    record::PackedJson::unpack(json_, rest.substr(sizeof head, head.size));
    history_.take(topics[head.channel], TimePoint(Duration(head.time)), json_);
    rest.remove_prefix(sizeof head + head.size);
  }
}

Intake::Hold::Hold(Intake& intake) : intake_(intake), lock_(intake.draining_) {
  const std::lock_guard lock(intake_.mutex_);
  intake_.held_ = true;
}

Intake::Hold::~Hold() {
  const std::lock_guard lock(intake_.mutex_);
  intake_.held_ = false;
  intake_.changed_.notify_all();
}

void Intake::work() {
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
