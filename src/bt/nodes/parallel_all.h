#pragma once

#include <string>

#include "sentree/bt/nodes/parallel_node.h"

namespace sentree::bt::nodes {

struct ParallelAll : ParallelNode {
  static Manifests manifests() {
    return {format4(control("ParallelAll", {input_default<std::int32_t>("max_failures", "1")}))};
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    const auto failures = m.read_integer(n, 0);
    if (!failures) return m.fail(id, "bt.missing-port", "needs max_failures as a whole number");
    mem[kFailureThreshold] = threshold(*failures, n.child_count);
    if (mem[kFailureThreshold] > static_cast<std::int32_t>(n.child_count)) {
      return m.fail(id, "bt.threshold",
                    "max_failures is greater than the number of children, " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    mem[kCurrent] = -1;
    mem[kSkipped] = 0;
    return next_child(m, n, mem);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == Status::kSkipped) ++mem[kSkipped];
    if (is_completed(status)) count(mem, status);
    return next_child(m, n, mem);
  }

  static Next next_child(Machine& m, const Node& n, std::int32_t* mem) {
    const ParallelBits done(mem);
    for (++mem[kCurrent]; static_cast<std::uint32_t>(mem[kCurrent]) < n.child_count; ++mem[kCurrent]) {
      if (!done.get(static_cast<std::uint32_t>(mem[kCurrent]))) {
        return Next::tick(static_cast<std::uint32_t>(mem[kCurrent]));
      }
    }
    const auto children = static_cast<std::int32_t>(n.child_count);
    if (mem[kSkipped] == children) return Next::done(Status::kSkipped);
    if (mem[kSkipped] + mem[kSucceeded] + mem[kFailed] < children) return Next::done(Status::kRunning);
    const bool failure = mem[kFailed] >= mem[kFailureThreshold];
    clear(m, n);
    m.reset_children(n);
    return Next::done(failure ? Status::kFailure : Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
