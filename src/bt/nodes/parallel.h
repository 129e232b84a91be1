#pragma once

#include <algorithm>

#include "sentree/bt/machine.h"

// Parallel and ParallelAll. A negative threshold t means children + 1 + t.

namespace sentree::bt::nodes {

struct ParallelMemory {
  std::int32_t current;
  std::int32_t succeeded;
  std::int32_t failed;
  std::int32_t skipped;            ///< In this tick.
  std::int32_t success_threshold;  ///< In children; read anew at each tick.
  std::int32_t failure_threshold;
  std::int32_t skipped_succeeds;  ///< The success threshold was written negative.
  // Then one bit per child: it has completed.
};
inline constexpr std::uint32_t kParallelWords = sizeof(ParallelMemory) / sizeof(std::int32_t);

inline std::int32_t threshold(std::int64_t written, std::uint32_t children) {
  const std::int64_t wanted = written < 0 ? std::max<std::int64_t>(written, INT32_MIN) + children + 1 : written;
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(wanted, 0, INT32_MAX));
}

/// Behind the memory of a Parallel.
struct ParallelBits {
  std::uint32_t* words;
  explicit ParallelBits(ParallelMemory& mem) : words(reinterpret_cast<std::uint32_t*>(&mem + 1)) {}
  [[nodiscard]] bool get(std::uint32_t i) const { return (words[i / 32] >> (i % 32) & 1U) != 0; }
  void set(std::uint32_t i) { words[i / 32] |= 1U << (i % 32); }
  void clear(std::uint32_t children) {
    words[0] = 0;  // The usual case, without a call.
    if (children > 32) std::fill_n(words, (children + 31) / 32, 0U);
  }
};

struct Parallel {
  static constexpr std::uint32_t kSuccessPort = 0;
  static constexpr std::uint32_t kFailurePort = 1;
  static ParallelMemory& memory(Machine& m, const Node& n) { return *reinterpret_cast<ParallelMemory*>(m.memory(n)); }

  static void clear(Machine& m, const Node& n) {
    ParallelMemory& mem = memory(m, n);
    mem = {};
    ParallelBits(mem).clear(n.child_count);
  }

  [[gnu::always_inline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    ParallelMemory& mem = memory(m, n);
    if (n.data != kNone) [[likely]] {
      const ParallelLimits& limits = m.model().parallels[n.data];
      mem.success_threshold = limits.success;
      mem.failure_threshold = limits.failure;
      mem.skipped_succeeds = limits.skipped_succeeds;
    } else if (!read_thresholds(m, n, id, mem)) {
      return Next::done(Status::kIdle);
    }
    m.set_status(id, Status::kRunning);
    mem.skipped = 0;
    if (m.format3()) [[unlikely]] {
      // Format 3 counts anew at each tick, in the order of the children.
      mem.succeeded = mem.failed = 0;
      return visit_format3(m, n, mem);
    }
    return visit<false>(m, n, mem, 0);
  }

  /// False: they cannot be, and the tick is given up.
  [[gnu::noinline]] static bool read_thresholds(Machine& m, const Node& n, NodeId id, ParallelMemory& mem) {
    const auto success = m.read_integer(n, kSuccessPort);
    const auto failure = m.read_integer(n, kFailurePort);
    if (!success || !failure) {
      m.fail(id, "bt.missing-port", "needs its thresholds as whole numbers");
      return false;
    }
    mem.success_threshold = threshold(*success, n.child_count);
    mem.failure_threshold = threshold(*failure, n.child_count);
    mem.skipped_succeeds = *success < 0;
    if (possible(mem.success_threshold, mem.failure_threshold, n.child_count)) return true;
    m.fail(id, "bt.threshold", "a threshold is greater than the number of children, " + std::to_string(n.child_count));
    return false;
  }

  static bool possible(std::int32_t success, std::int32_t failure, std::uint32_t children) {
    return success <= static_cast<std::int32_t>(children) && failure <= static_cast<std::int32_t>(children);
  }

  [[gnu::always_inline]] static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    ParallelMemory& mem = memory(m, n);
    if (status == Status::kSkipped) ++mem.skipped;
    if (is_completed(status)) count(mem, status);
    if (m.format3()) [[unlikely]]
      return after_format3(m, n, mem, status);
    return after<false>(m, n, mem, status);
  }

  static void count(ParallelMemory& mem, Status status) {
    ParallelBits(mem).set(static_cast<std::uint32_t>(mem.current));
    ++(status == Status::kSuccess ? mem.succeeded : mem.failed);
  }

  /// What the counts say after a child; kIdle: nothing yet.
  template <bool kFormat3>
  static Status verdict(const Node& n, const ParallelMemory& mem, Status last) {
    const std::int32_t success = mem.success_threshold;
    const bool too_many_failed = mem.failed > static_cast<std::int32_t>(n.child_count) - success;
    if constexpr (kFormat3) {
      // Format 3 compares each count when it grows, for equality: a threshold of 0 is never met.
      if (last == Status::kSuccess && mem.succeeded == success) return last;
      if (last == Status::kFailure && (too_many_failed || mem.failed == mem.failure_threshold)) return last;
      return Status::kIdle;
    }
    if (mem.succeeded >= success || (mem.skipped_succeeds != 0 && mem.succeeded + mem.skipped >= success)) {
      return Status::kSuccess;
    }
    // Equality: with a threshold of 0, a first child that fails goes beyond it, one that does not meets it.
    return too_many_failed || mem.failed == mem.failure_threshold ? Status::kFailure : Status::kIdle;
  }

  /// Visits the children from `current` on, until one must be ticked by the machine or the verdict is clear.
  template <bool kFormat3>
  [[gnu::always_inline]] static Next visit(Machine& m, const Node& n, ParallelMemory& mem, std::uint32_t current) {
    const ParallelBits done(mem);
    for (; current < n.child_count; ++current) {
      if (!done.get(current)) {
        mem.current = static_cast<std::int32_t>(current);
        return Next::tick(current);
      }
      const Status last = m.status(m.child(n, current));
      if constexpr (kFormat3) ++(last == Status::kSuccess ? mem.succeeded : mem.failed);
      const Status clear = verdict<kFormat3>(n, mem, last);
      if (clear != Status::kIdle) return end(m, n, clear);
    }
    const bool all_skipped = mem.skipped == static_cast<std::int32_t>(n.child_count);
    return Next::done(all_skipped ? Status::kSkipped : Status::kRunning);
  }

  /// Goes on after the child that was just ticked and counted.
  template <bool kFormat3>
  [[gnu::always_inline]] static Next after(Machine& m, const Node& n, ParallelMemory& mem, Status last) {
    const Status clear = verdict<kFormat3>(n, mem, last);
    if (clear != Status::kIdle) return end(m, n, clear);
    return visit<kFormat3>(m, n, mem, static_cast<std::uint32_t>(mem.current) + 1);
  }
  [[gnu::noinline]] static Next visit_format3(Machine& m, const Node& n, ParallelMemory& mem) {
    return visit<true>(m, n, mem, 0);
  }
  [[gnu::noinline]] static Next after_format3(Machine& m, const Node& n, ParallelMemory& mem, Status last) {
    return after<true>(m, n, mem, last);
  }

  static Next end(Machine& m, const Node& n, Status verdict) {
    clear(m, n);
    m.reset_children(n);
    return Next::done(verdict);
  }

  static void halt(Machine& m, const Node& n) {
    clear(m, n);
    m.reset_children(n);
  }
};

struct ParallelAll {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    ParallelMemory& mem = Parallel::memory(m, n);
    const auto failures = m.read_integer(n, 0);
    if (!failures) return m.fail(id, "bt.missing-port", "needs max_failures as a whole number");
    mem.failure_threshold = threshold(*failures, n.child_count);
    if (mem.failure_threshold > static_cast<std::int32_t>(n.child_count)) {
      return m.fail(id, "bt.threshold",
                    "max_failures is greater than the number of children, " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    mem.current = -1;
    mem.skipped = 0;
    return next_child(m, n, mem);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    ParallelMemory& mem = Parallel::memory(m, n);
    if (status == Status::kSkipped) ++mem.skipped;
    if (is_completed(status)) Parallel::count(mem, status);
    return next_child(m, n, mem);
  }

  static Next next_child(Machine& m, const Node& n, ParallelMemory& mem) {
    const ParallelBits done(mem);
    for (++mem.current; static_cast<std::uint32_t>(mem.current) < n.child_count; ++mem.current) {
      if (!done.get(static_cast<std::uint32_t>(mem.current))) {
        return Next::tick(static_cast<std::uint32_t>(mem.current));
      }
    }
    const auto children = static_cast<std::int32_t>(n.child_count);
    if (mem.skipped == children) return Next::done(Status::kSkipped);
    if (mem.skipped + mem.succeeded + mem.failed < children) return Next::done(Status::kRunning);
    const bool failure = mem.failed >= mem.failure_threshold;
    Parallel::clear(m, n);
    m.reset_children(n);
    return Next::done(failure ? Status::kFailure : Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
