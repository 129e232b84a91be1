#pragma once

#include <array>

#include "sentree/bt/nodes/leaf.h"

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
    if (current < n.child_count && !m.answers_at_once(m.child(n, current))) {
      mem[kCurrent] = static_cast<std::int32_t>(current);
      return Next::tick(current);
    }
    return visit_leaves(m, n, mem, current);
  }

  /// Ticks the child at `current` and those after it, while they answer at once.
  [[gnu::noinline]] static Next visit_leaves(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    const NodeId* const children = m.children(n);
    const std::uint32_t count = n.child_count;
    for (; current < count; ++current) {
      const Status status = tick_leaf<kGoOn>(m, children[current]);
      if (status == kGoOn) [[likely]] {
        mem[kAllSkipped] = 0;
        continue;
      }
      mem[kCurrent] = static_cast<std::int32_t>(current);
      if (status == Status::kIdle) return Next::tick(current);
      if (after(m, n, mem, current, status)) {
        return status == kStop ? end(m, n, mem, kStop) : Next::done(Status::kRunning);
      }
      if (m.failed()) return Next::done(Status::kIdle);
    }
    return end(m, n, mem, mem[kAllSkipped] != 0 ? Status::kSkipped : kGoOn);
  }

  /// What the child's status means for the others; true where it is the node's too.
  [[gnu::noinline]] static bool after(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current,
                                      Status status) {
    if (status == Status::kSkipped) {
      // Ready to be skipped again.
      m.reset(m.child(n, current));
      return false;
    }
    mem[kAllSkipped] = 0;
    if (status == Status::kRunning) {
      if (current > 0) m.reset_children(n, 0, current);
      if (current + 1 < n.child_count) m.reset_children(n, current + 1, n.child_count);
      mem[kCurrent] = 0;
    }
    return status != kGoOn;
  }

  [[gnu::noinline]] static Next end(Machine& m, const Node& n, std::int32_t* mem, Status status) {
    m.reset_children(n);
    clear(mem, kWords);
    return Next::done(status);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    const auto current = static_cast<std::uint32_t>(mem[kCurrent]);
    if (!after(m, n, mem, current, status)) {
      return m.failed() ? Next::done(Status::kIdle) : go_on(m, n, mem, current + 1);
    }
    return status == kStop ? end(m, n, mem, kStop) : Next::done(Status::kRunning);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
