#pragma once

#include <array>

#include "sentree/bt/nodes/node.h"

// What ReactiveSequence and ReactiveFallback share: every tick starts at the first child; a running child halts all
// others, after it was ticked.

namespace sentree::bt::nodes {

template <Status kGoOn, Status kStop>
struct Reactive : AnyNode {
  enum : std::size_t { kCurrent, kAllSkipped };
  static constexpr std::array kWords{Word{Word::Lives::kInTick, Word::Range::kChild}, Word{Word::Lives::kInTick}};
  static constexpr std::uint32_t kHaltsFrom = 1;
  static may::Mask may_return(const may::Asked& asked) { return may::ordered(asked, may::mask_of(kGoOn)); }

  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    m.set_status(id, Status::kRunning);
    std::int32_t* const mem = m.memory(n);
    mem[kAllSkipped] = 1;
    return go_on(m, n, mem, 0);
  }

  /// Ticks the child at `current`, or is done.
  [[gnu::always_inline]] static Next go_on(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    if (current < n.child_count) {
      mem[kCurrent] = static_cast<std::int32_t>(current);
      return Next::tick(current);
    }
    return end(m, n, mem, mem[kAllSkipped] != 0 ? Status::kSkipped : kGoOn);
  }

  [[gnu::noinline]] static Next end(Machine& m, const Node& n, std::int32_t* mem, Status status) {
    m.reset_children(n);
    clear(mem, kWords);
    return Next::done(status);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    const auto current = static_cast<std::uint32_t>(mem[kCurrent]);
    if (status == Status::kSkipped) {
      // Ready to be skipped again.
      m.reset(m.child(n, current));
    } else {
      mem[kAllSkipped] = 0;
    }
    if (status == Status::kRunning) {
      m.reset_children(n, 0, current);
      m.reset_children(n, current + 1, n.child_count);
      mem[kCurrent] = 0;
      return Next::done(Status::kRunning);
    }
    if (status == kStop) return end(m, n, mem, kStop);
    return go_on(m, n, mem, current + 1);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
