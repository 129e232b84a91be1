#pragma once

#include <string>

#include "sentree/bt/nodes/parallel_node.h"

namespace sentree::bt::nodes {

struct Parallel : ParallelNode {
  static constexpr std::uint32_t kHaltsFrom = 0;
  static Manifests manifests() {
    return {format4(control("Parallel", {input_default<std::int32_t>("success_count", "-1"),
                                         input_default<std::int32_t>("failure_count", "1")})),
            format3(control("Parallel", {input_default<std::int32_t>("success_threshold", "-1"),
                                         input_default<std::int32_t>("failure_threshold", "1")}))};
  }

  static constexpr std::uint32_t kSuccessPort = 0;
  static constexpr std::uint32_t kFailurePort = 1;

  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (n.data != kNone) [[likely]] {
      const ParallelLimits& limits = m.model().parallels[n.data];
      mem[kSuccessThreshold] = limits.success;
      mem[kFailureThreshold] = limits.failure;
      mem[kSkippedSucceeds] = limits.skipped_succeeds;
    } else if (!read_thresholds(m, n, id, mem)) {
      return Next::done(Status::kIdle);
    }
    m.set_status(id, Status::kRunning);
    mem[kSkipped] = 0;
    if (m.format3()) [[unlikely]] {
      // Format 3 counts anew at each tick, in the order of the children.
      mem[kSucceeded] = mem[kFailed] = 0;
      return visit_format3(m, n, mem);
    }
    return visit<false>(m, n, mem, 0);
  }

  /// False: they cannot be, and the tick is given up.
  [[gnu::noinline]] static bool read_thresholds(Machine& m, const Node& n, NodeId id, std::int32_t* mem) {
    const auto success = m.read_integer(n, kSuccessPort);
    const auto failure = m.read_integer(n, kFailurePort);
    if (!success || !failure) {
      m.fail(id, "bt.missing-port", "needs its thresholds as whole numbers");
      return false;
    }
    mem[kSuccessThreshold] = threshold(*success, n.child_count);
    mem[kFailureThreshold] = threshold(*failure, n.child_count);
    mem[kSkippedSucceeds] = *success < 0;
    if (possible(mem[kSuccessThreshold], mem[kFailureThreshold], n.child_count)) return true;
    m.fail(id, "bt.threshold", "a threshold is greater than the number of children, " + std::to_string(n.child_count));
    return false;
  }

  static bool possible(std::int32_t success, std::int32_t failure, std::uint32_t children) {
    return success <= static_cast<std::int32_t>(children) && failure <= static_cast<std::int32_t>(children);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == Status::kSkipped) ++mem[kSkipped];
    if (is_completed(status)) count(mem, status);
    if (m.format3()) [[unlikely]]
      return after_format3(m, n, mem, status);
    // The counts are as they were after the child before.
    if (status == Status::kRunning && mem[kCurrent] > 0) {
      return visit<false>(m, n, mem, static_cast<std::uint32_t>(mem[kCurrent]) + 1);
    }
    return after<false>(m, n, mem, status);
  }

  /// What the counts say after a child; kIdle: nothing yet.
  template <bool kFormat3>
  static Status verdict(const Node& n, const std::int32_t* mem, Status last) {
    const std::int32_t success = mem[kSuccessThreshold];
    const bool too_many_failed = mem[kFailed] > static_cast<std::int32_t>(n.child_count) - success;
    if constexpr (kFormat3) {
      // Format 3 compares each count when it grows, for equality: a threshold of 0 is never met.
      if (last == Status::kSuccess && mem[kSucceeded] == success) return last;
      if (last == Status::kFailure && (too_many_failed || mem[kFailed] == mem[kFailureThreshold])) return last;
      return Status::kIdle;
    }
    if (mem[kSucceeded] >= success || (mem[kSkippedSucceeds] != 0 && mem[kSucceeded] + mem[kSkipped] >= success)) {
      return Status::kSuccess;
    }
    // Equality: with a threshold of 0, a first child that fails goes beyond it, one that does not meets it.
    return too_many_failed || mem[kFailed] == mem[kFailureThreshold] ? Status::kFailure : Status::kIdle;
  }

  /// Visits the children from `current` on, until one must be ticked by the machine or the verdict is clear.
  template <bool kFormat3>
  [[gnu::always_inline]] static Next visit(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    const ParallelBits done(mem);
    for (; current < n.child_count; ++current) {
      if (!done.get(current)) {
        mem[kCurrent] = static_cast<std::int32_t>(current);
        return Next::tick(current);
      }
      const Status last = m.status(m.child(n, current));
      if constexpr (kFormat3) ++mem[last == Status::kSuccess ? kSucceeded : kFailed];
      const Status clear = verdict<kFormat3>(n, mem, last);
      if (clear != Status::kIdle) return end(m, n, clear);
    }
    const bool all_skipped = mem[kSkipped] == static_cast<std::int32_t>(n.child_count);
    return Next::done(all_skipped ? Status::kSkipped : Status::kRunning);
  }

  /// Goes on after the child that was just ticked and counted.
  template <bool kFormat3>
  [[gnu::always_inline]] static Next after(Machine& m, const Node& n, std::int32_t* mem, Status last) {
    const Status clear = verdict<kFormat3>(n, mem, last);
    if (clear != Status::kIdle) return end(m, n, clear);
    return visit<kFormat3>(m, n, mem, static_cast<std::uint32_t>(mem[kCurrent]) + 1);
  }
  [[gnu::noinline]] static Next visit_format3(Machine& m, const Node& n, std::int32_t* mem) {
    return visit<true>(m, n, mem, 0);
  }
  [[gnu::noinline]] static Next after_format3(Machine& m, const Node& n, std::int32_t* mem, Status last) {
    return after<true>(m, n, mem, last);
  }

  static Next end(Machine& m, const Node& n, Status verdict) {
    clear(m, n);
    m.reset_children(n);
    return Next::done(verdict);
  }
};

}  // namespace sentree::bt::nodes
