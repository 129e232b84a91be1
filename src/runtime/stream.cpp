#include "sentree/runtime/stream.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace sentree::runtime {

Stream::Stream(Scheduler& scheduler)
    : scheduler_(scheduler), actor_(scheduler.add_actor("observer", Urgency::kBackground)) {}

void Stream::publish(Message message) {
  bool start_draining = false;
  {
    std::unique_lock lock(mutex_);
    // A listener that publishes is the one who would make room; it says little.
    const bool may_wait = !scheduler_.is_virtual() && listener_thread_ != std::this_thread::get_id();
    const auto has_room = [&] { return pending_.size() < kPendingMax; };
    if (may_wait && !has_room()) {
      ++waiting_for_room_;
      const bool found = room_.wait_for(lock, kRoomPatience, has_room);
      --waiting_for_room_;
      if (!found) {
        stamp(message);
        ++lost_;
        ++untold_;
        return;
      }
    }
    if (untold_ > 0) {
      Message lost;
      lost.source = "run";
      lost.name = "observer.lost";
      lost.data = Map{{"count", static_cast<std::int64_t>(std::exchange(untold_, 0))}};
      stamp(lost);
      pending_.push_back(std::move(lost));
    }
    stamp(message);
    start_draining = !std::exchange(draining_, true);
    // Who drains at once takes the message with it.
    if (start_draining && scheduler_.is_virtual() && pending_.empty() && batch_.empty() && !delivering_) {
      delivering_ = std::move(message);
      listener_ = 0;
    } else {
      pending_.push_back(std::move(message));
    }
  }
  if (start_draining) {
    if (scheduler_.is_virtual())
      drain();
    else
      scheduler_.post(actor_, [this] { drain(); });
  }
}

void Stream::stamp(Message& message) {
  message.sequence = ++sequence_;
  message.stamp = stamp_ = std::max(stamp_, message.stamp) + 1;
  message.time = scheduler_.now();
  message.tick = tick_;
}

bool Stream::is_heard(mission::ObservationName& name) const {
  using Heard = mission::ObservationName::Heard;
  if (hears_all_ || !scheduler_.is_virtual() || (hears_all_while_ && hears_all_while_())) return true;
  if (name.heard == Heard::kUnknown) {
    const bool heard = std::any_of(wants_.begin(), wants_.end(), [&](const Wants& wants) { return wants(name.text); });
    name.heard = heard ? Heard::kYes : Heard::kNo;
  }
  return name.heard == Heard::kYes;
}

void Stream::pass() {
  {
    const std::lock_guard lock(mutex_);
    ++sequence_;
    ++stamp_;
    if (draining_) return;
  }
  if (passed_) passed_(scheduler_.now());
}

std::optional<mission::Admission> Stream::publish_if(Message message, const Judge& judge, TimePoint deadline,
                                                     Decided decided) {
  if (scheduler_.is_virtual()) {
    message.time = scheduler_.now();
    message.tick = tick_;
    if (auto veto = judge(message)) return mission::Admission{std::move(veto)};
    publish(std::move(message));
    return mission::Admission{};
  }
  std::call_once(has_deadlines_, [this] { deadlines_ = scheduler_.add_actor("gate deadlines"); });
  // Whoever takes it decides.
  const auto open = std::make_shared<std::atomic<bool>>(true);
  const auto first = [open](const Decided& told, mission::Admission admission) {
    if (open->exchange(false)) told(std::move(admission));
  };
  scheduler_.at(deadlines_, deadline, mission::Rank::kTimer, [first, decided] {
    first(decided, {mission::Veto{"", "no gate decided in time"}});
  });
  scheduler_.post(actor_, [this, message = std::move(message), judge, decided = std::move(decided), open, first] {
    {
      const std::lock_guard lock(mutex_);
      undecided_ = [first, decided] { first(decided, {mission::Veto{"", "a gate was given up while it decided"}}); };
    }
    for (int attempt = 0; attempt < kJudgementsMax; ++attempt) {
      drain();
      Message candidate = message;
      {
        const std::lock_guard lock(mutex_);
        if (!pending_.empty()) continue;
        candidate.sequence = sequence_;
        candidate.time = scheduler_.now();
        candidate.tick = tick_;
      }
      const std::uint64_t seen = std::exchange(candidate.sequence, 0);
      auto veto = judge(candidate);
      {
        const std::lock_guard lock(mutex_);
        if (sequence_ != seen) continue;
        if (!veto) {
          if (!open->exchange(false)) return;
          stamp(candidate);
          pending_.push_back(std::move(candidate));
          draining_ = true;
        }
      }
      if (veto) {
        first(decided, {std::move(veto)});
        return;
      }
      decided({});
      drain();
      return;
    }
    first(decided, {mission::Veto{"", "observations come in faster than a gate can decide"}});
  });
  return std::nullopt;
}

void Stream::drain() {
  for (;;) {
    if (!delivering_) {
      if (batch_.empty()) {
        const std::lock_guard lock(mutex_);
        listener_thread_ = std::this_thread::get_id();
        if (pending_.empty()) {
          draining_ = false;
          listener_thread_ = {};
          return;
        }
        const auto count = static_cast<std::ptrdiff_t>(std::min(pending_.size(), kBatchMax));
        std::move(pending_.begin(), pending_.begin() + count, std::back_inserter(batch_));
        pending_.erase(pending_.begin(), pending_.begin() + count);
        if (waiting_for_room_ > 0) room_.notify_all();
      }
      delivering_ = std::move(batch_.front());
      batch_.pop_front();
      listener_ = 0;
    }
    for (; listener_ < listeners_.size(); ++listener_) listeners_[listener_](*delivering_);
    delivering_.reset();
  }
}

void Stream::resume() {
  std::function<void()> undecided;
  {
    const std::lock_guard lock(mutex_);
    undecided.swap(undecided_);
  }
  if (undecided) undecided();
  scheduler_.post(actor_, [this] { drain(); });
}

void Stream::flush() { drain(); }

void Stream::save(mission::State& state) const {
  state.published = sequence_;
  state.stamp = stamp_;
  state.calls = calls_;
  state.tick = tick_;
}

void Stream::load(const mission::State& state) {
  sequence_ = state.published;
  stamp_ = state.stamp;
  calls_ = state.calls;
  tick_ = state.tick;
}

}  // namespace sentree::runtime
