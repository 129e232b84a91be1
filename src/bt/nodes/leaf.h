#pragma once

#include <algorithm>
#include <exception>
#include <string>
#include <utility>

#include "sentree/bt/machine.h"
#include "sentree/bt/nodes/timing.h"

// The built-in leaves, the substitute for tests, and nodes written in C++.

namespace sentree::bt::nodes {

/// A script's text may come from an entry; then it is compiled when it runs.
inline bool run_code(Machine& m, const Node& n, NodeId id, ScriptValue& result) {
  if (n.data != kNone) return m.run(id, n.data, result);
  const auto text = m.read_text(n, 0);
  if (!text) {
    m.fail(id, "bt.missing-port", "needs \"code\"");
    return false;
  }
  return m.run_text(id, *text, result);
}

struct Script {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    ScriptValue result;
    if (!run_code(m, n, id, result)) return Next::done(Status::kIdle);
    return Next::done(Status::kSuccess);
  }
};

struct ScriptCondition {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    ScriptValue result;
    if (!run_code(m, n, id, result)) return Next::done(Status::kIdle);
    bool holds = false;
    std::string error;
    if (!truth(result, holds, error)) return m.fail(id, "bt.script", error);
    return Next::done(holds ? Status::kSuccess : Status::kFailure);
  }
};

/// Copies an entry with its type, or writes a literal as text.
struct SetBlackboard {
  static constexpr std::uint32_t kValuePort = 0, kKeyPort = 1;

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto key = m.read_text(n, kKeyPort);
    if (!key) return m.fail(id, "bt.missing-port", "needs \"output_key\", the name of an entry");
    const Binding* value = m.binding(n, kValuePort);
    if (value == nullptr) return m.fail(id, "bt.missing-port", "needs \"value\"");
    const std::uint32_t target = m.blackboard().cell(m.model().scope(id), *key);
    if (target == kNone) return m.fail(id, "bt.too-many-entries", Blackboard::too_many(*key));
    std::string error;
    if (value->kind == Binding::Kind::kLiteral) {
      const std::string& text = m.model().strings[value->text];
      // Format 3's entries take the text and become strings, whatever they were.
      if (!m.blackboard().set(target, Datum{Value(text), nullptr}, &type_of<std::string>(), error)) {
        return m.fail(id, "bt.entry-type", error);
      }
      return Next::done(Status::kSuccess);
    }
    const Blackboard::Entry* source = m.blackboard().find(value->target);
    if (source == nullptr) {
      return m.fail(id, "bt.no-entry", "no entry " + m.model().strings[value->text] + " to copy");
    }
    const Datum copy = source->datum;
    const PortType* type = source->type;
    Blackboard::Entry* entry = m.blackboard().find(target);
    const bool text = copy.value.as_string() != nullptr;
    if (entry == nullptr) {
      // The new entry gets the type of the source; a number in an entry declared as text does not fit its own type.
      if (type != nullptr && type->kind == PortType::Class::kString && copy.value.is_number() && !m.format3()) {
        return m.fail(id, "bt.entry-type",
                      "entry \"" + *key + "\" would be text and cannot take the number " + to_json(copy.value));
      }
      m.blackboard().create(target, type, error);
      entry = m.blackboard().find(target);
      if (entry == nullptr) return m.fail(id, "bt.entry-type", error);
      // As recorded from BehaviorTree.CPP: text copied to an entry that did not exist leaves it empty.
      if (!text || m.format3()) entry->datum = copy;
    } else if ((text && !m.format3() && entry->datum.empty()) || !copy_into(copy, entry->datum)) {
      return m.fail(id, "bt.entry-type", "entry \"" + *key + "\" cannot take the value " + to_json(copy.value));
    }
    m.blackboard().written(*entry);
    return Next::done(Status::kSuccess);
  }
};

struct UnsetBlackboard {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto key = m.read_text(n, 0);
    if (!key) return m.fail(id, "bt.missing-port", "needs \"key\", the name of an entry");
    const std::uint32_t cell = m.blackboard().find_cell(m.model().scope(id), *key);
    if (cell != kNone) m.blackboard().unset(cell);
    return Next::done(Status::kSuccess);
  }
};

/// SUCCESS if the entry was written since this node last looked.
struct WasEntryUpdated {
  static Next enter(Machine& m, const Node& n, NodeId /*id*/) {
    const Blackboard::Entry* entry = m.blackboard().find(n.data);
    if (entry == nullptr) return Next::done(Status::kFailure);
    std::int32_t* seen = m.memory(n);
    const bool updated = seen_of(seen) != entry->sequence;
    set_seen(seen, entry->sequence);
    return Next::done(updated ? Status::kSuccess : Status::kFailure);
  }
};

/// Stands in for another node: a given status, after a delay, with scripts.
struct TestNode {
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

/// A node written in C++.
struct User {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    const UserNode& user = m.model().users[n.data];
    Context self(m, id);
    return checked(m, n, id, guarded(m, id, [&] { return user.behaviour->tick(self, memory(m, user)); }));
  }
  [[gnu::noinline]] static Next child_done(Machine& m, const Node& n, NodeId id, NodeId child, Status status) {
    const UserNode& user = m.model().users[n.data];
    // Children are in ascending order of their ids.
    const NodeId* const first = m.model().children.data() + n.first_child;
    const auto index = static_cast<std::size_t>(std::lower_bound(first, first + n.child_count, child) - first);
    Context self(m, id);
    return checked(m, n, id,
                   guarded(m, id, [&] { return user.behaviour->child_done(self, memory(m, user), index, status); }));
  }
  static void halt(Machine& m, const Node& n, NodeId id) {
    if (m.status(id) == Status::kRunning) {
      const UserNode& user = m.model().users[n.data];
      Context self(m, id);
      guarded(m, id, [&] {
        user.behaviour->halted(self, memory(m, user));
        return Next::done(Status::kIdle);
      });
    }
    m.reset_children(n);
  }

 private:
  /// Somebody else's code may throw; that gives the tick up, as `Context::fail` does.
  template <class Call>
  [[gnu::always_inline]] static Next guarded(Machine& m, NodeId id, const Call& call) {
    try {
      return call();
    } catch (const std::exception& thrown) {
      return m.fail(id, "bt.node-threw", std::string("threw ") + thrown.what());
    } catch (...) {
      return m.fail(id, "bt.node-threw", "threw something that is no std::exception");
    }
  }
  static NodeMemory* memory(Machine& m, const UserNode& user) {
    return user.object == kNone ? nullptr : m.object(user.object);
  }
  [[gnu::always_inline]] static Next checked(Machine& m, const Node& n, NodeId id, Next next) {
    if (m.failed()) return Next::done(Status::kIdle);
    if (next.child == kNoNode) {
      if (next.status == Status::kIdle) return m.fail(id, "bt.idle-returned", "returned IDLE, which no tick may");
      if (next.status == Status::kRunning && (n.flags & Node::kSynchronous) != 0) {
        return m.fail(id, "bt.running-returned", "is synchronous and returned RUNNING");
      }
      return next;
    }
    if (next.child >= n.child_count) {
      return m.fail(id, "bt.child-count",
                    "ticks child " + std::to_string(next.child) + " and has " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    return m.count_cycle(id) ? next : Next::done(Status::kIdle);
  }
};

}  // namespace sentree::bt::nodes
