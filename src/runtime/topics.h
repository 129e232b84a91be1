#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sentree/mission/delivery.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/scheduler.h"

namespace sentree::runtime {

/// Something that was published, as a subscriber is told.
struct ToldTopic {
  mission::Shared<mission::Publication> what;
  Duration delay{};            ///< By faults.
  TimePoint published{};       ///< When.
  std::uint64_t sequence = 0;  ///< Its number among the observations.
  bool delayed = false;        ///< A fault holds it back, or something before it, and that is told.
};

/// What is on its way to one subscriber. In virtual time the scheduler's queue bounds it; in real time at most
/// `kWaitingMax` wait for one that does not keep up: what comes then is lost, and told as "observer.lost".
class TopicInbox {
 public:
  static constexpr std::size_t kWaitingMax = 1024;

  /// False: it is full, and this is lost. In the actor of the stream.
  [[nodiscard]] bool add(const Scheduler& scheduler, const ToldTopic& told);
  /// One has reached the subscriber; in its actor. What `add` was told in real time, or of one that is delayed, if it
  /// knows.
  std::optional<ToldTopic> taken(const mission::Publication& what, const std::string& subscriber, Publisher& publisher);
  /// What `add` was told and nobody has taken yet; from any thread.
  [[nodiscard]] std::vector<ToldTopic> waiting();

 private:
  std::atomic<std::int64_t> waiting_ = 0;  // in real time
  std::mutex mutex_;
  std::deque<ToldTopic> told_;  // in real time, and those that are delayed
  std::int64_t lost_ = 0;
  std::string first_lost_;
};

}  // namespace sentree::runtime
