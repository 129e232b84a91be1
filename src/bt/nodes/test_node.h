#pragma once

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// Stands in for another node: a given status, after a delay, with scripts.
struct TestNode : AnyNode {
  static constexpr bool kStartsTimers = true;
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kLeaf | may::kRunning; }
  static void halt(Machine& m, const Node& /*n*/, NodeId id) { m.stop_timer(id); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const TestNodeData& test = m.model().tests[n.data];
    if (m.status(id) == Status::kIdle && test.delay > Duration(0)) {
      m.start_timer(id, add_saturating(m.now(), test.delay));
      return Next::done(Status::kRunning);
    }
    if (is_completed(m.status(id))) return Next::done(m.status(id));
    if (m.has_timer(id)) return Next::done(Status::kRunning);
    return complete(m, test, id);
  }

  static Next complete(Machine& m, const TestNodeData& test, NodeId id) {
    Status status = test.complete ? test.complete() : test.status;
    ScriptValue result;
    if (test.status_use != kNone) {
      if (!m.run(id, test.status_use, result)) return Next::done(Status::kIdle);
      const double value = result.is_number() ? result.number() : 0;
      if (!(value >= 1 && value <= 4)) return m.fail(id, "bt.script", "return_status_script gives no status");
      status = static_cast<Status>(static_cast<int>(value));
    }
    if (status == Status::kSuccess && test.success_use != kNone && !m.run(id, test.success_use, result)) {
      return Next::done(Status::kIdle);
    }
    if (status == Status::kFailure && test.failure_use != kNone && !m.run(id, test.failure_use, result)) {
      return Next::done(Status::kIdle);
    }
    if (test.post_use != kNone && !m.run(id, test.post_use, result)) return Next::done(Status::kIdle);
    return Next::done(status);
  }
};

}  // namespace sentree::bt::nodes
