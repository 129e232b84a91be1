#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/base/message.h"

namespace sentree::replay {

/// What a leaf, the mission or a monitor did, told once when it changes.
struct Deed {
  TimePoint time{};
  std::uint64_t tick = 0;
  std::uint64_t sequence = 0;
  std::string what;
};

/// Picks the behaviour out of a run's observations: repeated answers and requests count once.
class Behaviour {
 public:
  void observe(const Message& message);
  /// By leaf, "mission" or monitor, in the order in which they happened.
  [[nodiscard]] const std::map<std::string, std::vector<Deed>>& deeds() const { return deeds_; }

 private:
  void did(const Message& message, const std::string& who, const std::string& kind, std::string what);

  std::map<std::string, std::vector<Deed>> deeds_;
  std::map<std::string, std::map<std::string, std::string>> last_;  // by who, by kind
};

}  // namespace sentree::replay
