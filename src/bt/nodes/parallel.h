#pragma once

#include <bit>
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

  static std::optional<may::Failing> always_fails(const may::Given& given) {
    const auto success = too_many(given, kSuccessPort);
    return success ? success : too_many(given, kFailurePort);
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = begin(m, n, id);
    return mem != nullptr ? visit(m, n, mem, 0) : Next::done(Status::kIdle);
  }
  /// `enter` of one whose children answer at once.
  [[gnu::always_inline]] static Next tick(Machine& m, const Node& n, NodeId id) {
    if (m.format3()) [[unlikely]]
      return enter(m, n, id);
    std::int32_t* const mem = begin(m, n, id);
    return mem != nullptr ? visit_called(m, n, mem, 0) : Next::done(Status::kIdle);
  }

  /// Null: the tick is given up.
  [[gnu::always_inline]] static std::int32_t* begin(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (n.data != kNone) [[likely]] {
      const ParallelLimits& limits = m.model().parallels[n.data];
      mem[kSuccessThreshold] = limits.success;
      mem[kFailureThreshold] = limits.failure;
      mem[kSkippedSucceeds] = limits.skipped_succeeds;
    } else if (!read_thresholds(m, n, id, mem)) {
      return nullptr;
    }
    m.set_status(id, Status::kRunning);
    mem[kSkipped] = 0;
    if (m.format3()) [[unlikely]] {
      // Format 3 counts anew at each tick, in the order of the children.
      mem[kSucceeded] = mem[kFailed] = 0;
    }
    return mem;
  }

  /// False: they cannot be, and the tick is given up.
  [[gnu::noinline]] static bool read_thresholds(Machine& m, const Node& n, NodeId id, std::int32_t* mem) {
    const auto success = m.read_integer(n, kSuccessPort);
    const auto failure = m.read_integer(n, kFailurePort);
    if (!success || !failure) {
      lacks(m, n, id, success ? kFailurePort : kSuccessPort, "needs its thresholds as whole numbers");
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

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    const Status clear = m.format3() ? after<true>(n, mem, status) : after<false>(n, mem, status);
    if (clear != Status::kIdle) return end(m, n, clear);
    return visit(m, n, mem, static_cast<std::uint32_t>(mem[kCurrent]) + 1);
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

  /// Counts the child at `current`, which was just ticked, and says what follows from it; kIdle: nothing yet.
  template <bool kFormat3>
  static Status after(const Node& n, std::int32_t* mem, Status last) {
    if (last == Status::kSkipped) ++mem[kSkipped];
    if (is_completed(last)) count(mem, last);
    // After the first child the thresholds, which may be others now, are compared with what was counted before.
    const bool as_before = last == Status::kRunning && mem[kCurrent] > 0;
    return !kFormat3 && as_before ? Status::kIdle : verdict<kFormat3>(n, mem, last);
  }

  /// Visits the children from `current` on, until one must be ticked by the machine or the verdict is clear.
  [[gnu::always_inline]] static Next visit(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    if (m.format3()) [[unlikely]]
      return visit_each<true>(m, n, mem, current);
    if (current < n.child_count && !ParallelBits(mem).get(current) && !m.answers_at_once(m.child(n, current))) {
      mem[kCurrent] = static_cast<std::int32_t>(current);
      return Next::tick(current);
    }
    return m.hooked() ? visit_each<false>(m, n, mem, current) : visit_some(m, n, mem, current);
  }
  [[gnu::noinline]] static Next visit_some(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    return visit_called(m, n, mem, current);
  }
  /// The same where the child at `current` answers at once.
  [[gnu::always_inline]] static Next visit_called(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    const ParallelBits done(mem);
    if (current == 0 && done.get(0)) {
      if (const Status clear = verdict<false>(n, mem, Status::kIdle); clear != Status::kIdle) return end(m, n, clear);
    }
    const NodeId* const children = m.children(n);
    for (std::uint32_t first = current & ~31U; first < n.child_count; first += 32) {
      const NodeId* const those = children + first;
      for (std::uint32_t left = done.left(first, current, n.child_count); left != 0; left &= left - 1) {
        const NodeId* const child = those + std::countr_zero(left);
        const Status status = tick_child<Status::kRunning>(m, *child);
        if (status == Status::kRunning && child != children) [[likely]]
          continue;
        mem[kCurrent] = static_cast<std::int32_t>(child - children);
        if (status == Status::kIdle && (m.failed() || !m.answers_at_once(*child))) return Next::tick(child - children);
        if (const Status clear = after<false>(n, mem, status); clear != Status::kIdle) return end(m, n, clear);
      }
    }
    return none_clear(n, mem);
  }
  /// The same, one by one. Format 3 counts anew those that have completed, each at its place.
  template <bool kFormat3>
  [[gnu::noinline]] static Next visit_each(Machine& m, const Node& n, std::int32_t* mem, std::uint32_t current) {
    const ParallelBits done(mem);
    for (; current < n.child_count; ++current) {
      if (!done.get(current)) {
        mem[kCurrent] = static_cast<std::int32_t>(current);
        return Next::tick(current);
      }
      const Status last = m.status(m.child(n, current));
      if constexpr (kFormat3) ++mem[last == Status::kSuccess ? kSucceeded : kFailed];
      if (const Status clear = verdict<kFormat3>(n, mem, last); clear != Status::kIdle) return end(m, n, clear);
    }
    return none_clear(n, mem);
  }
  static Next none_clear(const Node& n, const std::int32_t* mem) {
    const bool all_skipped = mem[kSkipped] == static_cast<std::int32_t>(n.child_count);
    return Next::done(all_skipped ? Status::kSkipped : Status::kRunning);
  }

  static Next end(Machine& m, const Node& n, Status verdict) {
    clear(m, n);
    m.reset_children(n);
    return Next::done(verdict);
  }
};

}  // namespace sentree::bt::nodes
