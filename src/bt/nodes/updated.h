#pragma once

#include <array>

#include "sentree/bt/nodes/decorator.h"

// What SkipUnlessUpdated and WaitValueUpdate share.

namespace sentree::bt::nodes {

/// SkipUnlessUpdated, WaitValueUpdate: run the child when the entry was written since it was last seen here.
template <Status kOtherwise>
struct Updated : AnyNode {
  // Sequence number, low and high, of the last write that was seen; an entry that was never written has 0.
  enum : std::size_t { kSeenLow, kSeenHigh, kExecuting };
  static constexpr std::array kWords{Word{Word::Lives::kAlways}, Word{Word::Lives::kAlways},
                                     Word{Word::Lives::kAlways}};
  static constexpr bool kWaitsForWrites = true;
  static constexpr bool kStaysRunning = false;
  static may::Mask may_return(const may::Asked& asked) { return asked.child() | may::mask_of(kOtherwise); }

  static Next enter(Machine& m, const Node& n, NodeId /*id*/) {
    if (m.memory(n)[kExecuting] != 0) return Next::tick(0);
    const Blackboard::Entry* entry = m.blackboard().find(n.data);
    if (entry == nullptr || entry->sequence == seen_of(m.memory(n))) return Next::done(kOtherwise);
    set_seen(m.memory(n), entry->sequence);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    m.memory(n)[kExecuting] = status == Status::kRunning;
    return Next::done(status);
  }
  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    // What was seen stays seen.
    m.memory(n)[kExecuting] = 0;
    m.reset(only_child(m, n));
  }
};

}  // namespace sentree::bt::nodes
