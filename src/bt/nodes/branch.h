#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "sentree/bt/machine.h"

// IfThenElse, WhileDoElse, Switch, ManualSelector, TryCatch: which child is ticked depends on another one, on a value
// or on somebody's choice.

namespace sentree::bt::nodes {

/// The condition is asked once; then its branch runs to the end.
struct IfThenElse {
  static std::int32_t& branch(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (n.child_count < 2 || n.child_count > 3) {
      return m.fail(id, "bt.child-count", "must have 2 or 3 children and has " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    return Next::tick(static_cast<std::size_t>(branch(m, n)));
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    std::int32_t& current = branch(m, n);
    if (current == 0) {
      if (status == Status::kRunning) return Next::done(status);
      if (status == Status::kSkipped) return m.fail(id, "bt.skipped-condition", "its condition was skipped");
      if (status == Status::kSuccess) {
        current = 1;
      } else if (n.child_count == 3) {
        current = 2;
      } else {
        return Next::done(status);
      }
      return Next::tick(static_cast<std::size_t>(current));
    }
    if (status == Status::kRunning) return Next::done(status);
    m.reset_children(n);
    current = 0;
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n) {
    branch(m, n) = 0;
    m.reset_children(n);
  }
};

/// The condition is asked at every tick; the other branch is halted.
struct WhileDoElse {
  static std::int32_t& current(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const std::uint32_t least = m.format3() ? 3 : 2;
    if (n.child_count < least || n.child_count > 3) {
      return m.fail(id, "bt.child-count",
                    std::string(m.format3() ? "must have 3 children" : "must have 2 or 3 children") + " and has " +
                        std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    current(m, n) = 0;
    return Next::tick(0);
  }

  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    std::int32_t& mem = current(m, n);
    if (mem == 0) {
      if (status == Status::kRunning) return Next::done(status);
      if (status == Status::kSkipped) {
        m.reset_children(n);
        return m.fail(id, "bt.skipped-condition", "its condition was skipped");
      }
      if (status == Status::kSuccess) {
        if (n.child_count == 3) m.reset(m.child(n, 2));
        mem = 1;
        return Next::tick(1);
      }
      m.reset(m.child(n, 1));
      if (n.child_count == 3) {
        mem = 2;
        return Next::tick(2);
      }
    }
    mem = 0;
    if (status != Status::kRunning) m.reset_children(n);
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n) {
    current(m, n) = 0;
    m.reset_children(n);
  }
};

/// The child of the first case that equals the variable; the last child is the default.
struct Switch {
  struct Memory {
    std::int32_t running;  ///< Child + 1; 0: none.
    std::int32_t current;
  };
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  /// As text, then as whole numbers or enums, then as reals within the precision of float. Format 3: as text only.
  static bool equal(const Machine& m, const std::string& a, const std::string& b) {
    if (a == b) return true;
    if (m.format3()) return false;
    const auto integer = [&m](const std::string& text) -> std::optional<std::int64_t> {
      if (const auto value = m.model().enum_value(text)) return value;
      return detail::parse_integer(text);
    };
    if (const auto i = integer(a)) {
      if (const auto j = integer(b); j && *i == *j) return true;
    }
    const auto real = [&m](const std::string& text) -> std::optional<double> {
      if (const auto value = m.model().enum_value(text)) return static_cast<double>(*value);
      return detail::parse_real(text);
    };
    const auto x = real(a);
    const auto y = real(b);
    return x && y && std::abs(*x - *y) <= static_cast<double>(std::numeric_limits<float>::epsilon());
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const std::uint32_t cases = n.port_count - 1U;  // The ports are `variable` and the cases.
    if (n.child_count != cases + 1) {
      return m.fail(id, "bt.child-count",
                    "must have " + std::to_string(cases + 1) + " children (one per case, and the default) and has " +
                        std::to_string(n.child_count));
    }
    std::uint32_t match = cases;
    if (const auto variable = m.read_text(n, 0)) {
      for (std::uint32_t i = 0; i < cases; ++i) {
        const auto value = m.read_text(n, i + 1);
        if (value && equal(m, *variable, *value)) {
          match = i;
          break;
        }
      }
    }
    Memory& mem = memory(m, n);
    if (mem.running != 0 && static_cast<std::uint32_t>(mem.running - 1) != match) {
      m.reset(m.child(n, static_cast<std::uint32_t>(mem.running - 1)));
    }
    mem.current = static_cast<std::int32_t>(match);
    return Next::tick(match);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    Memory& mem = memory(m, n);
    if (status == Status::kSkipped) {
      mem.running = 0;
    } else if (status == Status::kRunning) {
      mem.running = mem.current + 1;
    } else {
      m.reset_children(n);
      mem.running = 0;
    }
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n) = {};
    m.reset_children(n);
  }
};

/// The child that a person chooses; RUNNING until somebody has. A child that runs is not chosen again.
struct ManualSelector {
  static constexpr std::uint32_t kRepeatPort = 0, kSelectionPort = 1;
  struct Memory {
    std::int32_t running;  ///< Child + 1; 0: none.
    std::int32_t current;
    std::int32_t last;  ///< The last choice: child + 1, or a status negated; 0: none yet.
  };
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    Memory& mem = memory(m, n);
    m.set_status(id, Status::kRunning);
    if (mem.running != 0) return tick(mem, mem.running - 1);
    if (mem.last == 0 || !m.read_bool(n, kRepeatPort, false)) {
      Choice choice;
      if (m.binding(n, kSelectionPort) != nullptr) {
        const auto selection = m.read_integer(n, kSelectionPort);
        if (selection && *selection >= 0) {
          choice.child = static_cast<std::uint32_t>(std::min<std::int64_t>(*selection, kNoNode - 1));
        }
      } else if (m.effects().choose) {
        choice = m.effects().choose(id);
      }
      if (choice.child == kNoNode) {
        if (choice.status == Status::kIdle || choice.status == Status::kRunning) return Next::done(Status::kRunning);
        mem.last = -static_cast<std::int32_t>(choice.status);
      } else if (choice.child >= n.child_count) {
        return m.fail(id, "bt.bad-selection",
                      "child " + std::to_string(choice.child) + " is chosen and there are " +
                          std::to_string(n.child_count) + "; they count from 0");
      } else {
        mem.last = static_cast<std::int32_t>(choice.child) + 1;
      }
    }
    return mem.last < 0 ? Next::done(static_cast<Status>(-mem.last)) : tick(mem, mem.last - 1);
  }

  static Next tick(Memory& mem, std::int32_t child) {
    mem.current = child;
    return Next::tick(static_cast<std::uint32_t>(child));
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    Memory& mem = memory(m, n);
    mem.running = status == Status::kRunning ? mem.current + 1 : 0;
    if (is_completed(status)) m.reset_children(n);
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n) {
    memory(m, n).running = 0;
    m.reset_children(n);
  }
};

/// All children but the last as a Sequence; when one fails, the last cleans up and the result is FAILURE.
struct TryCatch {
  static constexpr std::uint32_t kCatchOnHaltPort = 0;
  struct Memory {
    std::int32_t current;
    std::int32_t skipped;
    std::int32_t in_catch;
  };
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (n.child_count < 2) {
      return m.fail(id, "bt.child-count", "must have at least 2 children and has " + std::to_string(n.child_count));
    }
    Memory& mem = memory(m, n);
    if (m.status(id) == Status::kIdle) mem.skipped = mem.in_catch = 0;
    m.set_status(id, Status::kRunning);
    return Next::tick(mem.in_catch != 0 ? n.child_count - 1 : static_cast<std::uint32_t>(mem.current));
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    Memory& mem = memory(m, n);
    const std::uint32_t tries = n.child_count - 1;
    if (status == Status::kRunning) return Next::done(status);
    if (mem.in_catch != 0) {
      m.reset_children(n);
      mem = {};
      return Next::done(Status::kFailure);
    }
    if (status == Status::kFailure) {
      m.reset_children(n, 0, tries);
      mem.current = 0;
      mem.in_catch = 1;
      return Next::tick(tries);
    }
    if (status == Status::kSkipped) ++mem.skipped;
    if (static_cast<std::uint32_t>(++mem.current) < tries) return Next::tick(static_cast<std::uint32_t>(mem.current));
    const bool all_skipped = mem.skipped == static_cast<std::int32_t>(tries);
    m.reset_children(n);
    mem = {};
    return Next::done(all_skipped ? Status::kSkipped : Status::kSuccess);
  }

  static void halt(Machine& m, const Node& n, NodeId id) {
    Memory& mem = memory(m, n);
    if (mem.in_catch == 0 && m.status(id) == Status::kRunning && m.read_bool(n, kCatchOnHaltPort, false)) {
      m.reset_children(n, 0, n.child_count - 1);
      if (!m.failed()) m.tick_now(m.child(n, n.child_count - 1));
    }
    mem = {};
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
