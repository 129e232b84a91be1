#pragma once

#include <algorithm>

#include "sentree/bt/machine.h"

// Decorators that map, repeat or guard their child. The machine resets a completed child after each of their ticks.

namespace sentree::bt::nodes {

inline NodeId only_child(const Machine& m, const Node& n) { return m.child(n, 0); }

/// Inverter, ForceSuccess, ForceFailure, SubTree: the child's completed status is mapped.
template <Status kOnSuccess, Status kOnFailure>
struct Mapped {
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
using Inverter = Mapped<Status::kFailure, Status::kSuccess>;
using ForceSuccess = Mapped<Status::kSuccess, Status::kSuccess>;
using ForceFailure = Mapped<Status::kFailure, Status::kFailure>;
using SubTree = Mapped<Status::kSuccess, Status::kFailure>;

struct KeepRunningUntilFailure {
  static Next enter(Machine& m, const Node& /*n*/, NodeId id) {
    m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) m.reset(only_child(m, n));
    return Next::done(status == Status::kFailure ? Status::kFailure : Status::kRunning);
  }
};

/// Repeat while the child succeeds, RetryUntilSuccessful while it fails; -1 is for ever.
/// Yields between cycles of a child that completed within one tick; not in format 3.
template <Status kAgain>
struct Repeated {
  struct Memory {
    std::int32_t count;
    std::int32_t limit;
    std::int32_t child_was_idle;
  };
  static constexpr bool kIsRetry = kAgain == Status::kFailure;
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  static bool read_limit(Machine& m, const Node& n, Memory& mem) {
    const auto limit = m.read_integer(n, 0);
    if (limit) mem.limit = static_cast<std::int32_t>(std::clamp<std::int64_t>(*limit, -INT32_MAX, INT32_MAX));
    return limit.has_value();
  }
  static bool more(const Memory& mem) { return mem.limit == -1 || mem.count < mem.limit; }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    Memory& mem = memory(m, n);
    if (!read_limit(m, n, mem)) {
      return m.fail(id, "bt.missing-port",
                    std::string("needs ") + (kIsRetry ? "num_attempts" : "num_cycles") + " as a whole number");
    }
    m.set_status(id, Status::kRunning);
    return cycle(m, n, mem);
  }

  static Next cycle(Machine& m, const Node& n, Memory& mem) {
    if (more(mem)) {
      mem.child_was_idle = m.status(only_child(m, n)) == Status::kIdle;
      return Next::tick(0);
    }
    mem.count = 0;
    return Next::done(kAgain);
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    Memory& mem = memory(m, n);
    if (status == Status::kRunning) return Next::done(status);
    if (status == kAgain) {
      // What goes on for ever is not counted: so a mission comes back to a state that it has been in.
      if (mem.limit != -1 && mem.count < INT32_MAX) ++mem.count;
      // A child may have changed the number of attempts.
      if (kIsRetry) read_limit(m, n, mem);
      m.reset(only_child(m, n));
      if (!m.format3() && mem.child_was_idle != 0 && more(mem)) {
        m.wake();
        return Next::done(Status::kRunning);
      }
      return m.count_cycle(id) ? cycle(m, n, mem) : Next::done(Status::kIdle);
    }
    // A skipped child does not end the count.
    if (status != Status::kSkipped) mem.count = 0;
    m.reset(only_child(m, n));
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n).count = 0;
    m.reset(only_child(m, n));
  }
};
using Repeat = Repeated<Status::kSuccess>;
using Retry = Repeated<Status::kFailure>;

/// Never armed again, not even by halting the tree.
struct RunOnce {
  static constexpr std::uint32_t kThenSkipPort = 0;
  static std::int32_t& result(Machine& m, const Node& n) { return *m.memory(n); }  ///< A Status; 0: not run yet.

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (const std::int32_t kept = result(m, n); kept != 0) {
      return Next::done(m.read_bool(n, kThenSkipPort, true) ? Status::kSkipped : static_cast<Status>(kept));
    }
    m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) {
      result(m, n) = static_cast<std::int32_t>(status);
      m.reset(only_child(m, n));
    }
    return Next::done(status);
  }
};

/// The script is not evaluated again once it let the child start, until the child completes; halting does not change
/// that.
struct Precondition {
  static constexpr std::uint32_t kElsePort = 1;
  static std::int32_t& started(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto otherwise = m.read_status(n, kElsePort);
    if (!otherwise) return m.fail(id, "bt.missing-port", "needs \"else\" as a status");
    if (started(m, n) == 0) {
      bool holds = false;
      if (!m.run_condition(id, n.data, holds)) return Next::done(Status::kIdle);
      if (!holds) return Next::done(*otherwise);
      started(m, n) = 1;
    }
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) {
      started(m, n) = 0;
      m.reset(only_child(m, n));
    }
    return Next::done(status);
  }
};

/// SkipUnlessUpdated, WaitValueUpdate: run the child when the entry was written since it was last seen here.
template <Status kOtherwise>
struct Updated {
  struct Memory {
    std::int32_t seen_low, seen_high;  ///< Sequence number; an entry that was never written has 0.
    std::int32_t executing;
  };
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  static Next enter(Machine& m, const Node& n, NodeId /*id*/) {
    Memory& mem = memory(m, n);
    if (mem.executing != 0) return Next::tick(0);
    const Blackboard::Entry* entry = m.blackboard().find(n.data);
    if (entry == nullptr || entry->sequence == seen_of(m.memory(n))) return Next::done(kOtherwise);
    set_seen(m.memory(n), entry->sequence);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    memory(m, n).executing = status == Status::kRunning;
    return Next::done(status);
  }
  static void halt(Machine& m, const Node& n) {
    // What was seen stays seen.
    memory(m, n).executing = 0;
    m.reset(only_child(m, n));
  }
};
using SkipUnlessUpdated = Updated<Status::kSkipped>;
using WaitValueUpdate = Updated<Status::kRunning>;

/// Format 3's BlackboardCheckInt, …Double, …String, …Bool: run the child if two values are equal.
struct BlackboardCheck {
  static constexpr std::uint32_t kValueAPort = 0, kValueBPort = 1, kReturnPort = 2;

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const Binding* a = m.binding(n, kValueAPort);
    const Binding* b = m.binding(n, kValueBPort);
    Datum x, y;
    const Datum* left = a != nullptr ? m.read(*a, a->type, x) : nullptr;
    const Datum* right = b != nullptr ? m.read(*b, b->type, y) : nullptr;
    if (left != nullptr && right != nullptr && left->value == right->value) {
      m.set_status(id, Status::kRunning);
      return Next::tick(0);
    }
    if (m.status(only_child(m, n)) == Status::kRunning) m.reset(only_child(m, n));
    const auto otherwise = m.read_status(n, kReturnPort);
    if (!otherwise) return m.fail(id, "bt.missing-port", "needs \"return_on_mismatch\" as a status");
    return Next::done(*otherwise);
  }
  static Next child_done(Machine& /*m*/, const Node& /*n*/, NodeId /*id*/, Status status) { return Next::done(status); }
};

}  // namespace sentree::bt::nodes
