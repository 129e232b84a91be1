#pragma once

#include <array>

#include "sentree/bt/nodes/leaf.h"

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

  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (m.status(id) == Status::kIdle) mem[kSkipped] = 0;
    m.set_status(id, Status::kRunning);
    return go_on(m, n, mem);
  }

  /// Ticks the child at `current`, or is done.
  [[gnu::always_inline]] static Next go_on(Machine& m, const Node& n, std::int32_t* mem) {
    const auto current = static_cast<std::uint32_t>(mem[kCurrent]);
    if (current < n.child_count && (kAsync || !m.answers_at_once(m.child(n, current)))) {
      if constexpr (kAsync) mem[kChildWasIdle] = m.status(m.child(n, current)) == Status::kIdle;
      return Next::tick(current);
    }
    return visit_leaves(m, n, mem);
  }

  /// Ticks the child at `current` and those after it, while they answer at once.
  [[gnu::noinline]] static Next visit_leaves(Machine& m, const Node& n, std::int32_t* mem) {
    const NodeId* const children = m.children(n);
    const std::uint32_t count = n.child_count;
    for (auto current = static_cast<std::uint32_t>(mem[kCurrent]); current < count; ++current) {
      const Status status = tick_leaf<kGoOn>(m, children[current]);
      if (status == kGoOn) [[likely]]
        continue;
      mem[kCurrent] = static_cast<std::int32_t>(current);
      if (status == Status::kIdle) return Next::tick(current);
      if (status == kStop) return stop(m, n, mem);
      if (status == Status::kRunning) return Next::done(status);
      ++mem[kSkipped];
    }
    const bool all_skipped = mem[kSkipped] == static_cast<std::int32_t>(n.child_count);
    m.reset_children(n);
    mem[kCurrent] = 0;
    mem[kSkipped] = 0;
    return Next::done(all_skipped ? Status::kSkipped : kGoOn);
  }

  [[gnu::noinline]] static Next stop(Machine& m, const Node& n, std::int32_t* mem) {
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
