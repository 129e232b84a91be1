#pragma once

#include "sentree/bt/nodes/ordered.h"

namespace sentree::bt::nodes {

/// Keeps its place when a child fails and when it is halted. Format 3 (SequenceStar): forgets it when halted, never
/// yields.
struct SequenceWithMemory : Ordered<Status::kSuccess, Status::kFailure, true> {
  static Manifests manifests() { return {format4(control("SequenceWithMemory")), format3(control("SequenceStar"))}; }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (m.status(id) == Status::kIdle) mem[kSkipped] = 0;
    m.set_status(id, Status::kRunning);
    return Ordered::go_on(m, n, mem);
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == Status::kFailure) {
      m.reset_children(n, static_cast<std::uint32_t>(mem[kCurrent]), n.child_count);
      return Next::done(Status::kFailure);
    }
    if (m.format3()) mem[kChildWasIdle] = 0;
    return Ordered::child_done(m, n, id, status);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    if (m.format3()) clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
