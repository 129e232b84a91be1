#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/message.h"

namespace sentree::replay {

/// What a leaf, the mission or a monitor did, told once when it changes.
struct BehaviourEvent {
  TimePoint time{};
  std::uint64_t tick = 0;
  std::uint64_t sequence = 0;
  std::string what;
};

/// Where two runs part ways, for one leaf, the mission or a monitor.
struct Difference {
  TimePoint time{};
  std::uint64_t tick = 0;
  std::uint64_t sequence = 0;  ///< Of the observation that shows it, in the run that did it first.
  std::string who;
  std::string recorded;  ///< What it did then: this, or still the same as before.
  std::string replayed;  ///< What it did now.
};

/// Picks the behaviour out of a run's observations: repeated answers and requests count once.
class Behaviour {
 public:
  /// @param nodes  Paths of nodes whose statuses count too.
  explicit Behaviour(std::set<std::string> nodes = {}) : nodes_(std::move(nodes)) {}
  void observe(const Message& message);
  /// By leaf, "mission" or monitor, in the order in which they happened.
  [[nodiscard]] const std::map<std::string, std::vector<BehaviourEvent>>& events() const { return events_; }

 private:
  void did(const Message& message, const std::string& who, const std::string& kind, std::string what);

  std::set<std::string> nodes_;
  std::map<std::string, std::vector<BehaviourEvent>> events_;
  std::map<std::string, std::map<std::string, std::string>> last_;  // by who, by kind
};

/// What of two behaviours has to be alike.
enum class Compared : std::uint8_t { kOrder, kOrderAndTick };

/// The first difference of each, by time; none later than `until`.
[[nodiscard]] std::vector<Difference> differences(const Behaviour& then, const Behaviour& now, Compared compared,
                                                  TimePoint until);

}  // namespace sentree::replay
