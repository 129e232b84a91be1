#pragma once

#include "sentree/bt/nodes/decorator.h"

namespace sentree::bt::nodes {

struct KeepRunningUntilFailure : AnyNode {
  static constexpr bool kRepeats = true;
  static may::Mask may_return(const may::Asked& asked) { return (asked.child() & may::kFailure) | may::kRunning; }
  static Manifests manifests() { return {both(decorator("KeepRunningUntilFailure"))}; }

  static Next enter(Machine& m, const Node& /*n*/, NodeId id) {
    m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) m.reset(only_child(m, n));
    return Next::done(status == Status::kFailure ? Status::kFailure : Status::kRunning);
  }
};

}  // namespace sentree::bt::nodes
