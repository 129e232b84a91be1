#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sentree/mission/part_memory.h"

namespace sentree::verify {

/// A decision of a period, and which of its alternatives are to be tried.
struct OpenDecision {
  std::uint32_t taken = 0;
  std::uint32_t count = 1;
  bool all = true;           ///< Each is to be tried; else those that are `wanted`.
  std::vector<bool> wanted;  ///< By alternative, where not all are.
  std::vector<bool> done;    ///< Likewise.
};

/// Where it was decided which of several parts comes first.
struct OrderDecision {
  std::uint32_t step = 0;      ///< That followed: index in the trace.
  std::uint32_t decision = 0;  ///< Index in what the period decided.
  std::uint32_t due = 0;       ///< Where its alternatives, parts, begin in a list of those of all.
};

/// A period, as far as it tells which orders matter.
struct OrderedPeriod {
  const mission::PartMemory::Trace& trace;
  std::span<const OrderDecision> decisions;
  std::span<const std::uint32_t> due;
  bool ended = false;  ///< The mission, so that what was due did not come any more.
};

/// Finds the orders of steps at one instant that somebody can tell apart, in what was executed.
///
/// Two steps of different parts do the same in either order, unless both put something on the same way to one part, one
/// monitor hears of both, both ask for faults that stand, or one puts what the other's part takes first. A run stands
/// for all that differ from it only by exchanging such steps; for each pair that cannot be exchanged the other order is
/// wanted as well (Flanagan, Godefroid 2005; source sets: Abdulla, Aronis, Jonsson, Sagonas 2014). Choices are
/// independent of each other as long as nothing has a probability.
class Orders {
 public:
  explicit Orders(std::size_t monitors) : words_((monitors + 63) / 64) {}
  [[nodiscard]] std::size_t words() const { return words_; }

  /// @param hearers  The monitors that hear of it, bit by bit: `words` words for each number of an observation.
  /// @param open     By decision.
  void want(const OrderedPeriod& period, std::span<const std::uint64_t> hearers, std::vector<OpenDecision>& open);

 private:
  struct Group;
  [[nodiscard]] static bool overtakes(const Group& group, std::size_t a, std::size_t b);
  [[nodiscard]] bool depends(const Group& group, std::size_t a, std::size_t b) const;
  void want_in(const Group& group, std::vector<OpenDecision>& open);
  void want_for(const Group& group, std::size_t first, std::size_t second, std::vector<OpenDecision>& open);
  [[nodiscard]] bool is_before(std::size_t a, std::size_t b) const {
    return (before_[b * row_ + a / 64] >> (a % 64) & 1U) != 0;
  }

  std::size_t words_;
  std::vector<std::uint64_t> heard_by_;  // by step of the group
  std::size_t row_ = 0;
  std::vector<std::uint64_t> before_;  // by step: those that come before it in every order that is alike
  std::vector<std::size_t> races_;
};

}  // namespace sentree::verify
