#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sentree/mission/delivery.h"

namespace sentree::mission {

/// What is delivered at one instant of virtual time, counted. Parts that answer each other without time passing do so
/// for ever: beyond a bound that no mission comes to, it is said which parts and what they tell each other.
class Instant {
 public:
  /// @param parts  Of the run: each may have some messages waiting.
  explicit Instant(std::size_t parts) : waiting_max_(10'000 + 16 * parts) {}

  /// Time has come to another instant.
  void begin() {
    delivered_ = 0;
    last_.clear();
  }
  /// One more is to be delivered. False: too many have been, or wait.
  /// @param waiting  All that are on their way. More than one for each that is delivered pile up.
  [[nodiscard]] bool admits(std::size_t waiting) {
    waiting_ = waiting;
    return ++delivered_ <= kDeliveredMax && waiting <= waiting_max_;
  }
  /// `tell` wants to know what is delivered now.
  [[nodiscard]] bool listens() const {
    return delivered_ + kToldOf > kDeliveredMax || waiting_ + kToldOf > waiting_max_;
  }
  /// @param who   Gets it: "robot (models/robot.scxml)".
  void tell(std::string who, const Delivery& what);
  /// Why there is no end: who gets what again and again, and a way out. Behind `admits` that was false.
  [[nodiscard]] std::string why() const;

 private:
  static constexpr std::size_t kDeliveredMax = 200'000;
  static constexpr std::size_t kToldOf = 64;

  struct Told {
    std::string who;
    std::string what;
    friend bool operator==(const Told&, const Told&) = default;
  };
  std::size_t waiting_max_;
  std::size_t delivered_ = 0;
  std::size_t waiting_ = 0;
  std::vector<Told> last_;
};

}  // namespace sentree::mission
