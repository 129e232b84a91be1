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
    mem.current = 0;
    mem.all_skipped = 1;
    return Next::tick(0);
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
    if (status == kStop) {
      m.reset_children(n);
      mem = {};
      return Next::done(kStop);
    }
    if (current + 1 < n.child_count) {
      ++mem.current;
      return Next::tick(current + 1);
    }
    const bool all_skipped = mem.all_skipped != 0;
    m.reset_children(n);
    mem = {};
    return Next::done(all_skipped ? Status::kSkipped : kGoOn);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n) = {};
    m.reset_children(n);
  }
};

using ReactiveSequence = Reactive<Status::kSuccess, Status::kFailure>;
using ReactiveFallback = Reactive<Status::kFailure, Status::kSuccess>;

}  // namespace sentree::bt::nodes
