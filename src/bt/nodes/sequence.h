#pragma once

#include "sentree/bt/machine.h"

// Sequence and Fallback, with memory of the running child. They mirror each other: `kStop` ends them at once.
// Async: yields after each child that completed within one tick, if there is more to do.

namespace sentree::bt::nodes {

struct SequenceMemory {
  std::int32_t current;
  std::int32_t skipped;
  std::int32_t child_was_idle;
};

template <Status kGoOn, Status kStop, bool kAsync>
struct Ordered {
  static SequenceMemory& memory(Machine& m, const Node& n) { return *reinterpret_cast<SequenceMemory*>(m.memory(n)); }

  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    SequenceMemory& mem = memory(m, n);
    if (m.status(id) == Status::kIdle) mem.skipped = 0;
    m.set_status(id, Status::kRunning);
    return go_on(m, n, mem);
  }

  /// Ticks the child at `current`, or is done.
  [[gnu::always_inline]] static Next go_on(Machine& m, const Node& n, SequenceMemory& mem) {
    const auto current = static_cast<std::uint32_t>(mem.current);
    if (current < n.child_count) {
      if constexpr (kAsync) mem.child_was_idle = m.status(m.child(n, current)) == Status::kIdle;
      return Next::tick(current);
    }
    const bool all_skipped = mem.skipped == static_cast<std::int32_t>(n.child_count);
    m.reset_children(n);
    mem.current = 0;
    mem.skipped = 0;
    return Next::done(all_skipped ? Status::kSkipped : kGoOn);
  }

  static Next stop(Machine& m, const Node& n, SequenceMemory& mem) {
    m.reset_children(n);
    mem.current = 0;
    return Next::done(kStop);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    SequenceMemory& mem = memory(m, n);
    if (status == kGoOn) {
      ++mem.current;
      if constexpr (kAsync) {
        if (mem.child_was_idle != 0 && static_cast<std::uint32_t>(mem.current) < n.child_count) {
          m.wake();
          return Next::done(Status::kRunning);
        }
      }
      return go_on(m, n, mem);
    }
    if (status == kStop) return stop(m, n, mem);
    if (status == Status::kSkipped) {
      ++mem.current;
      ++mem.skipped;
      return go_on(m, n, mem);
    }
    return Next::done(Status::kRunning);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n) = {};
    m.reset_children(n);
  }
};

using Sequence = Ordered<Status::kSuccess, Status::kFailure, false>;
using Fallback = Ordered<Status::kFailure, Status::kSuccess, false>;
using AsyncSequence = Ordered<Status::kSuccess, Status::kFailure, true>;
using AsyncFallback = Ordered<Status::kFailure, Status::kSuccess, true>;

/// Keeps its place when a child fails and when it is halted. Format 3 (SequenceStar): forgets it when halted, never
/// yields.
struct SequenceWithMemory {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    SequenceMemory& mem = AsyncSequence::memory(m, n);
    if (m.status(id) == Status::kIdle) mem.skipped = 0;
    m.set_status(id, Status::kRunning);
    return AsyncSequence::go_on(m, n, mem);
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    SequenceMemory& mem = AsyncSequence::memory(m, n);
    if (status == Status::kFailure) {
      m.reset_children(n, static_cast<std::uint32_t>(mem.current), n.child_count);
      return Next::done(Status::kFailure);
    }
    if (m.format3()) mem.child_was_idle = 0;
    return AsyncSequence::child_done(m, n, id, status);
  }

  static void halt(Machine& m, const Node& n) {
    if (m.format3()) AsyncSequence::memory(m, n) = {};
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
