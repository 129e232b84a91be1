#include "sentree/verify/at_least.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace sentree::verify {

AtLeast::AtLeast(double share, double confidence)
    : holds_(ratio((1 - share) / 2, 1 - share)),
      refuted_(ratio(std::min(2 * (1 - share), 1 - share / 2), 1 - share)),
      bound_(-std::log(1 - confidence)) {}

AtLeast::Ratio AtLeast::ratio(double rate, double against) {
  return {.violated = std::log(rate / against), .kept = std::log((1 - rate) / (1 - against)), .sum = 0};
}

void AtLeast::add(Run run) {
  if (state_ != State::kOpen) return;
  if (holds_.add(run != Run::kKept, bound_))
    state_ = State::kHolds;
  else if (refuted_.add(run == Run::kViolated, bound_))
    state_ = State::kRefuted;
}

std::string_view to_string(AtLeast::State state) {
  constexpr std::array<std::string_view, 3> kNames{"undecided", "holds", "REFUTED"};
  return kNames[static_cast<std::size_t>(state)];
}

}  // namespace sentree::verify
