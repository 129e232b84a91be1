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

struct ParallelBits {
  std::uint32_t* words;
  ParallelBits(Machine& m, const Node& n) : words(reinterpret_cast<std::uint32_t*>(m.memory(n) + kParallelWords)) {}
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
    memory(m, n) = {};
    ParallelBits(m, n).clear(n.child_count);
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    ParallelMemory& mem = memory(m, n);
    if (n.data != kNone) {
      const ParallelLimits& limits = m.model().parallels[n.data];
      mem.success_threshold = limits.success;
      mem.failure_threshold = limits.failure;
      mem.skipped_succeeds = limits.skipped_succeeds;
    } else {
      const auto success = m.read_integer(n, kSuccessPort);
      const auto failure = m.read_integer(n, kFailurePort);
      if (!success || !failure) return m.fail(id, "bt.missing-port", "needs its thresholds as whole numbers");
      mem.success_threshold = threshold(*success, n.child_count);
      mem.failure_threshold = threshold(*failure, n.child_count);
      mem.skipped_succeeds = *success < 0;
    }
    const auto children = static_cast<std::int32_t>(n.child_count);
    if (mem.success_threshold > children || mem.failure_threshold > children) {
      return m.fail(id, "bt.threshold",
                    "a threshold is greater than the number of children, " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    mem.current = -1;
    mem.skipped = 0;
    // Format 3 counts anew at each tick, in the order of the children.
    if (m.format3()) mem.succeeded = mem.failed = 0;
    return next_child(m, n, mem);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    ParallelMemory& mem = memory(m, n);
    if (status == Status::kSkipped) ++mem.skipped;
    if (is_completed(status)) count(m, n, mem, status);
    return next_child(m, n, mem, status);
  }

  static void count(Machine& m, const Node& n, ParallelMemory& mem, Status status) {
    ParallelBits(m, n).set(static_cast<std::uint32_t>(mem.current));
    ++(status == Status::kSuccess ? mem.succeeded : mem.failed);
  }

  /// Checks the thresholds for the child that was just visited, then goes to the next unfinished one.
  static Next next_child(Machine& m, const Node& n, ParallelMemory& mem, Status last = Status::kIdle) {
    const ParallelBits done(m, n);
    for (;;) {
      if (mem.current >= 0) {
        if (const Status verdict = decided(m, n, mem, last); verdict != Status::kIdle) {
          clear(m, n);
          m.reset_children(n);
          return Next::done(verdict);
        }
      }
      ++mem.current;
      const auto current = static_cast<std::uint32_t>(mem.current);
      if (current == n.child_count) break;
      const NodeId child = m.child(n, current);
      if (!done.get(current)) {
        last = m.known_result(child);
        if (last == Status::kIdle) return Next::tick(current);
        m.set_status(child, last);
        count(m, n, mem, last);
        continue;
      }
      last = m.status(child);
      if (m.format3()) ++(last == Status::kSuccess ? mem.succeeded : mem.failed);
    }
    const bool all_skipped = mem.skipped == static_cast<std::int32_t>(n.child_count);
    return Next::done(all_skipped ? Status::kSkipped : Status::kRunning);
  }

  static Status decided(const Machine& m, const Node& n, const ParallelMemory& mem, Status last) {
    const std::int32_t success = mem.success_threshold;
    const std::int32_t failure = mem.failure_threshold;
    const auto children = static_cast<std::int32_t>(n.child_count);
    if (m.format3()) {
      // Format 3 compares each count when it grows, for equality: a threshold of 0 is never met.
      if (last == Status::kSuccess && mem.succeeded == success) return last;
      if (last == Status::kFailure && (mem.failed > children - success || mem.failed == failure)) return last;
      return Status::kIdle;
    }
    if (mem.succeeded >= success || (mem.skipped_succeeds != 0 && mem.succeeded + mem.skipped >= success)) {
      return Status::kSuccess;
    }
    // Equality: with a threshold of 0, a first child that fails goes beyond it, one that does not meets it.
    if (children - mem.failed < success || mem.failed == failure) return Status::kFailure;
    return Status::kIdle;
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
    if (is_completed(status)) Parallel::count(m, n, mem, status);
    return next_child(m, n, mem);
  }

  static Next next_child(Machine& m, const Node& n, ParallelMemory& mem) {
    const ParallelBits done(m, n);
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
