#pragma once

#include <array>

#include "sentree/bt/nodes/child.h"

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
  /// `enter` of one whose children answer at once: nothing has to be remembered in between.
  [[gnu::always_inline]] static Next tick(Machine& m, const Node& n, NodeId id) {
    m.set_status(id, Status::kRunning);
    bool all_skipped = true;
    return visit(m, n, 0, all_skipped);
  }

  /// Ticks the child at `current`, or is done.
  [[gnu::always_inline]] static Next go_on(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    if (current < n.child_count && !m.answers_at_once(m.child(n, current))) {
      mem[kCurrent] = static_cast<std::int32_t>(current);
      return Next::tick(current);
    }
    return visit_some(m, n, mem, current);
  }
  [[gnu::noinline]] static Next visit_some(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    bool all_skipped = mem[kAllSkipped] != 0;
    const Next next = visit(m, n, current, all_skipped);
    if (next.child == kNoNode) {
      clear(mem, kWords);
    } else {
      mem[kCurrent] = static_cast<std::int32_t>(next.child);
      mem[kAllSkipped] = all_skipped;
    }
    return next;
  }

  /// Ticks the child at `from` and those after it, while they answer at once.
  [[gnu::always_inline]] static Next visit(Machine& m, const Node& n, std::uint32_t from, bool& all_skipped) {
    const NodeId* const children = m.children(n);
    const NodeId* const end = children + n.child_count;
    for (const NodeId* child = children + from; child != end; ++child) {
      const Status status = tick_child<kGoOn>(m, *child);
      if (status == kGoOn) [[likely]] {
        all_skipped = false;
        continue;
      }
      if (status == Status::kRunning) {
        reset_others(m, n, static_cast<std::uint32_t>(child - children));
        return Next::done(status);
      }
      if (status == kStop) {
        m.reset_children(n);
        return Next::done(status);
      }
      if (status == Status::kSkipped) m.reset(*child);  // Ready to be skipped again.
      if (m.failed()) return Next::done(Status::kIdle);
      if (status == Status::kSkipped) continue;
      return m.answers_at_once(*child) ? Next::done(Status::kRunning) : Next::tick(child - children);
    }
    m.reset_children(n);
    return Next::done(all_skipped ? Status::kSkipped : kGoOn);
  }

  [[gnu::always_inline]] static void reset_others(Machine& m, const Node& n, std::uint32_t current) {
    if (current > 0) m.reset_children(n, 0, current);
    if (current + 1 < n.child_count) m.reset_children(n, current + 1, n.child_count);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    const auto current = static_cast<std::uint32_t>(mem[kCurrent]);
    if (status == kGoOn) {
      mem[kAllSkipped] = 0;
    } else if (status == Status::kSkipped) {
      m.reset(m.child(n, current));
    } else {
      if (status == Status::kRunning) reset_others(m, n, current);
      if (status == kStop) m.reset_children(n);
      clear(mem, kWords);
      return Next::done(status == kStop ? kStop : Status::kRunning);
    }
    return m.failed() ? Next::done(Status::kIdle) : go_on(m, n, mem, current + 1);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
