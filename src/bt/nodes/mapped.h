#pragma once

#include "sentree/bt/nodes/decorator.h"

// What Inverter, ForceSuccess, ForceFailure and SubTree share.

namespace sentree::bt::nodes {

/// Inverter, ForceSuccess, ForceFailure, SubTree: the child's completed status is mapped.
template <Status kOnSuccess, Status kOnFailure>
struct Mapped : AnyNode {
  static may::Mask may_return(const may::Asked& asked) {
    may::Mask out = asked.passed();
    if ((asked.child() & may::kSuccess) != 0) out |= may::mask_of(kOnSuccess);
    if ((asked.child() & may::kFailure) != 0) out |= may::mask_of(kOnFailure);
    return out;
  }

  static Next enter(Machine& m, const Node& /*n*/, NodeId id) {
    m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (!is_completed(status)) return Next::done(status);
    m.reset(only_child(m, n));
    return Next::done(status == Status::kSuccess ? kOnSuccess : kOnFailure);
  }
};

}  // namespace sentree::bt::nodes
