#pragma once

#include "sentree/bt/machine.h"

// ReactiveSequence and ReactiveFallback: every tick starts at the first child; a running child halts all others,
// after it was ticked.

namespace sentree::bt::nodes {

struct ReactiveMemory {
  std::int32_t current;
  std::int32_t all_skipped;
};

template <Status kGoOn, Status kStop>
struct Reactive {
  static ReactiveMemory& memory(Machine& m, const Node& n) { return *reinterpret_cast<ReactiveMemory*>(m.memory(n)); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    m.set_status(id, Status::kRunning);
    ReactiveMemory& mem = memory(m, n);
    mem.all_skipped = 1;
    return go_on(m, n, mem, 0);
  }

  /// Ticks the child at `current`, or is done.
  static Next go_on(Machine& m, const Node& n, ReactiveMemory& mem, std::uint32_t current) {
    if (current < n.child_count) {
      mem.current = static_cast<std::int32_t>(current);
      return Next::tick(current);
    }
    return end(m, n, mem, mem.all_skipped != 0 ? Status::kSkipped : kGoOn);
  }

  static Next end(Machine& m, const Node& n, ReactiveMemory& mem, Status status) {
    m.reset_children(n);
    mem = {};
    return Next::done(status);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    ReactiveMemory& mem = memory(m, n);
    const auto current = static_cast<std::uint32_t>(mem.current);
    if (status == Status::kSkipped) {
      // Ready to be skipped again.
      m.reset(m.child(n, current));
    } else {
      mem.all_skipped = 0;
    }
    if (status == Status::kRunning) {
      m.reset_children(n, 0, current);
      m.reset_children(n, current + 1, n.child_count);
      mem.current = 0;
      return Next::done(Status::kRunning);
    }
    if (status == kStop) return end(m, n, mem, kStop);
    return go_on(m, n, mem, current + 1);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n) = {};
    m.reset_children(n);
  }
};

using ReactiveSequence = Reactive<Status::kSuccess, Status::kFailure>;
using ReactiveFallback = Reactive<Status::kFailure, Status::kSuccess>;

}  // namespace sentree::bt::nodes
