#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "sentree/bt/nodes/decorator.h"

// What Repeat and RetryUntilSuccessful share.

namespace sentree::bt::nodes {

/// Repeat while the child succeeds, RetryUntilSuccessful while it fails; -1 is for ever.
/// Yields between cycles of a child that completed within one tick; not in format 3.
template <Status kAgain>
struct Repeated : AnyNode {
  enum : std::size_t { kCount, kLimit, kChildWasIdle };
  static constexpr std::array kWords{Word{Word::Lives::kAlways}, Word{Word::Lives::kInTick},
                                     Word{Word::Lives::kInTick}};
  static constexpr bool kRepeats = true;
  static may::Mask may_return(const may::Asked& asked) {
    return asked.child() | may::kRunning | may::kSuccess | may::kFailure;
  }
  static constexpr bool kIsRetry = kAgain == Status::kFailure;

  static std::optional<may::Failing> always_fails(const may::Given& given) { return given.lacks({0}); }
  static bool read_limit(Machine& m, const Node& n, std::int32_t* mem) {
    const auto limit = m.read_integer(n, 0);
    if (limit) mem[kLimit] = static_cast<std::int32_t>(std::clamp<std::int64_t>(*limit, -INT32_MAX, INT32_MAX));
    return limit.has_value();
  }
  static bool more(const std::int32_t* mem) { return mem[kLimit] == -1 || mem[kCount] < mem[kLimit]; }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (!read_limit(m, n, mem)) {
      return lacks(m, n, id, 0,
                   std::string("needs ") + (kIsRetry ? "num_attempts" : "num_cycles") + " as a whole number");
    }
    m.set_status(id, Status::kRunning);
    return cycle(m, n, mem);
  }

  static Next cycle(Machine& m, const Node& n, std::int32_t* mem) {
    if (more(mem)) {
      mem[kChildWasIdle] = m.status(only_child(m, n)) == Status::kIdle;
      return Next::tick(0);
    }
    mem[kCount] = 0;
    return Next::done(kAgain);
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == Status::kRunning) return Next::done(status);
    if (status == kAgain) {
      // What goes on for ever is not counted: so a mission comes back to a state that it has been in.
      if (mem[kLimit] != -1 && mem[kCount] < INT32_MAX) ++mem[kCount];
      // A child may have changed the number of attempts.
      if (kIsRetry) read_limit(m, n, mem);
      m.reset(only_child(m, n));
      if (!m.format3() && mem[kChildWasIdle] != 0 && more(mem)) {
        m.wake();
        return Next::done(Status::kRunning);
      }
      return m.count_cycle(id) ? cycle(m, n, mem) : Next::done(Status::kIdle);
    }
    // A skipped child does not end the count.
    if (status != Status::kSkipped) mem[kCount] = 0;
    m.reset(only_child(m, n));
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    m.memory(n)[kCount] = 0;
    m.reset(only_child(m, n));
  }
};

}  // namespace sentree::bt::nodes
