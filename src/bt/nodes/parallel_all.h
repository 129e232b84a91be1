#pragma once

#include <bit>
#include <string>

#include "sentree/bt/nodes/parallel_node.h"

namespace sentree::bt::nodes {

struct ParallelAll : ParallelNode {
  static Manifests manifests() {
    return {format4(control("ParallelAll", {input_default<std::int32_t>("max_failures", "1")}))};
  }

  static std::optional<may::Failing> always_fails(const may::Given& given) { return too_many(given, 0); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    const auto failures = m.read_integer(n, 0);
    if (!failures) return lacks(m, n, id, 0, "needs max_failures as a whole number");
    mem[kFailureThreshold] = threshold(*failures, n.child_count);
    if (mem[kFailureThreshold] > static_cast<std::int32_t>(n.child_count)) {
      return m.fail(id, "bt.threshold",
                    "max_failures is greater than the number of children, " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    mem[kSkipped] = 0;
    return visit(m, n, mem, 0);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    note(mem, status);
    return visit(m, n, mem, static_cast<std::uint32_t>(mem[kCurrent]) + 1);
  }

  static void note(std::int32_t* mem, Status status) {
    if (status == Status::kSkipped) ++mem[kSkipped];
    if (is_completed(status)) count(mem, status);
  }

  /// Visits the children from `current` on, until one must be ticked by the machine.
  [[gnu::noinline]] static Next visit(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    const ParallelBits done(mem);
    const NodeId* const children = m.children(n);
    for (std::uint32_t first = current & ~31U; first < n.child_count; first += 32) {
      const NodeId* const those = children + first;
      for (std::uint32_t left = done.left(first, current, n.child_count); left != 0; left &= left - 1) {
        const NodeId* const child = those + std::countr_zero(left);
        const Status status = m.hooked() ? Status::kIdle : tick_child<Status::kRunning>(m, *child);
        if (status == Status::kRunning) [[likely]]
          continue;
        mem[kCurrent] = static_cast<std::int32_t>(child - children);
        if (status == Status::kIdle && (m.failed() || !m.answers_at_once(*child))) return Next::tick(child - children);
        note(mem, status);
      }
    }
    mem[kCurrent] = static_cast<std::int32_t>(n.child_count);
    const auto all = static_cast<std::int32_t>(n.child_count);
    if (mem[kSkipped] == all) return Next::done(Status::kSkipped);
    if (mem[kSkipped] + mem[kSucceeded] + mem[kFailed] < all) return Next::done(Status::kRunning);
    const bool failure = mem[kFailed] >= mem[kFailureThreshold];
    clear(m, n);
    m.reset_children(n);
    return Next::done(failure ? Status::kFailure : Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
