#pragma once

#include <array>

#include "sentree/bt/nodes/child.h"

// What sequences and fallbacks share, with memory of the running child. They mirror each other: `kStop` ends them at
// once. Async: yields after each child that completed within one tick, if there is more to do.

namespace sentree::bt::nodes {

template <Status kGoOn, Status kStop, bool kAsync>
struct Ordered : AnyNode {
  // The child that is ticked, how many were skipped, and whether it was idle before.
  enum : std::size_t { kCurrent, kSkipped, kChildWasIdle };
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kChildOrEnd},
                                     Word{Word::Lives::kUnlessIdle}, Word{Word::Lives::kInTick}};
  static may::Mask may_return(const may::Asked& asked) {
    const may::Mask yields = kAsync && asked.children.size() > 1 ? may::kRunning : may::Mask{0};
    return may::ordered(asked, may::mask_of(kGoOn)) | yields;
  }

  [[gnu::always_inline]] static std::int32_t* begin(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (m.status(id) == Status::kIdle) mem[kSkipped] = 0;
    m.set_status(id, Status::kRunning);
    return mem;
  }
  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    return go_on(m, n, begin(m, n, id));
  }
  /// `enter` of one whose children answer at once.
  [[gnu::always_inline]] static Next tick(Machine& m, const Node& n, NodeId id) requires(!kAsync) {
    return visit(m, n, begin(m, n, id));
  }

  /// Ticks the child at `current`, or is done.
  [[gnu::always_inline]] static Next go_on(Machine& m, const Node& n, std::int32_t* mem) {
    const auto current = static_cast<std::uint32_t>(mem[kCurrent]);
    if (current < n.child_count && (kAsync || !m.answers_at_once(m.child(n, current)))) {
      if constexpr (kAsync) mem[kChildWasIdle] = m.status(m.child(n, current)) == Status::kIdle;
      return Next::tick(current);
    }
    return visit_some(m, n, mem);
  }
  [[gnu::noinline]] static Next visit_some(Machine& m, const Node& n, std::int32_t* mem) { return visit(m, n, mem); }

  /// Ticks the child at `current` and those after it, while they answer at once.
  [[gnu::always_inline]] static Next visit(Machine& m, const Node& n, std::int32_t* mem) {
    const NodeId* const children = m.children(n);
    const NodeId* const end = children + n.child_count;
    for (const NodeId* child = children + mem[kCurrent]; child != end; ++child) {
      const Status status = tick_child<kGoOn>(m, *child);
      if (status == kGoOn) [[likely]]
        continue;
      if (status == Status::kSkipped) {
        ++mem[kSkipped];
        continue;
      }
      mem[kCurrent] = static_cast<std::int32_t>(child - children);
      if (status == kStop) return stop(m, n, mem);
      if (status == Status::kIdle && !m.answers_at_once(*child)) return Next::tick(child - children);
      return Next::done(m.failed() ? Status::kIdle : Status::kRunning);
    }
    const bool all_skipped = mem[kSkipped] == static_cast<std::int32_t>(n.child_count);
    m.reset_children(n);
    mem[kCurrent] = 0;
    mem[kSkipped] = 0;
    return Next::done(all_skipped ? Status::kSkipped : kGoOn);
  }

  [[gnu::always_inline]] static Next stop(Machine& m, const Node& n, std::int32_t* mem) {
    m.reset_children(n);
    mem[kCurrent] = 0;
    return Next::done(kStop);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == kGoOn) {
      ++mem[kCurrent];
      if constexpr (kAsync) {
        if (mem[kChildWasIdle] != 0 && static_cast<std::uint32_t>(mem[kCurrent]) < n.child_count) {
          m.wake();
          return Next::done(Status::kRunning);
        }
      }
      return go_on(m, n, mem);
    }
    if (status == kStop) return stop(m, n, mem);
    if (status == Status::kSkipped) {
      ++mem[kCurrent];
      ++mem[kSkipped];
      return go_on(m, n, mem);
    }
    return Next::done(Status::kRunning);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
