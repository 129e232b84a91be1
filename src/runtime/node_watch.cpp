#include "sentree/runtime/detail/node_watch.h"

#include <sys/prctl.h>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/diagnostic.h"

namespace sentree::runtime {

namespace {

// With a node that has been asked to stop, before a person is told for whom he waits.
constexpr Duration kTellAtStop = std::chrono::milliseconds(200);

}  // namespace

NodeWatch::NodeWatch(const bt::Tree& tree, double factor, Patience patience, Replies replies)
    : tree_(tree), factor_(factor), patience_(patience), replies_(std::move(replies)), thread_([this] {
        prctl(PR_SET_NAME, "node watch");
        look();
      }) {}

NodeWatch::~NodeWatch() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void NodeWatch::stop_asked() {
  {
    const std::lock_guard lock(mutex_);
    if (!asked_) asked_ = std::chrono::steady_clock::now();
  }
  wake_.notify_all();
}

void NodeWatch::look() {
  const Duration period = std::clamp<Duration>(std::min({patience_.told, patience_.halt, patience_.limit}) / 4,
                                               std::chrono::milliseconds(5), std::chrono::milliseconds(100));
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, period, [this] { return stopping_; })) {
    const auto asked = asked_;
    lock.unlock();
    const auto call = calls_.pending();
    const bool given_up =
        call && look_at(*call, asked ? std::optional(std::chrono::steady_clock::now() - *asked) : std::nullopt);
    lock.lock();
    if (given_up) return;
  }
}

bool NodeWatch::look_at(const bt::CallWatch::Call& call, std::optional<Duration> since_asked) {
  // What it was called for after it was asked to stop has the same time as what it does already.
  const Duration asked_for = since_asked ? std::min(*since_asked, call.lasted) : Duration(0);
  if (asked_for >= patience_.halt || call.lasted >= patience_.limit) {
    if (!calls_.give_up(call)) return false;
    has_given_up_ = true;
    replies_.given_up(describe(call) + "; the run ends without it");
    return true;
  }
  if (asked_for >= kTellAtStop) {
    if (std::exchange(told_at_stop_, call.which) == call.which) return false;
    replies_.told(fmt::format("{}; the run is to end and waits for it for {:.1f} s more", describe(call),
                              seconds(patience_.halt - asked_for)));
  } else if (call.lasted >= patience_.told && std::exchange(told_, call.which) != call.which) {
    replies_.told(describe(call) + "; the mission stands until it does");
  }
  return false;
}

std::string NodeWatch::describe(const bt::CallWatch::Call& call) const {
  const Duration passed = from_seconds(seconds(call.lasted) * factor_);
  const TimePoint began = std::max(TimePoint{}, replies_.now() - passed);
  return fmt::format("{}: {} \"{}\", a node in C++, was called at {:.3f} s and has not come back for {:.1f} s",
                     to_string(tree_.span(call.node)), tree_.registration(call.node), tree_.path(call.node),
                     seconds(began), seconds(call.lasted));
}

}  // namespace sentree::runtime
