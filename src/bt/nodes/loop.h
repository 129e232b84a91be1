#pragma once

#include <string>
#include <utility>

#include "sentree/bt/machine.h"

// LoopInt, LoopDouble, LoopBool, LoopString: the child runs once per element of a queue. RUNNING between the cycles.

namespace sentree::bt::nodes {

struct Loop {
  static constexpr std::uint32_t kQueuePort = 0, kIfEmptyPort = 1, kValuePort = 2;
  struct Memory {
    std::int32_t child_running;
    std::int32_t position;  ///< In a literal queue.
  };
  static Memory& memory(Machine& m, const Node& n) { return *reinterpret_cast<Memory*>(m.memory(n)); }

  /// Takes the next element off the queue; false if there is none.
  static bool pop(Machine& m, const Node& n, Memory& mem, Value& element) {
    if (n.data != kNone) {
      const auto& queue = m.model().queues[n.data];
      if (static_cast<std::size_t>(mem.position) >= queue.size()) return false;
      element = queue[static_cast<std::size_t>(mem.position++)];
      return true;
    }
    const Binding* port = m.binding(n, kQueuePort);
    if (port == nullptr || port->kind != Binding::Kind::kEntry) return false;
    Blackboard::Entry* entry = m.blackboard().find(port->target);
    if (entry == nullptr) return false;
    List* list = entry->datum.value.as_list();
    if (list == nullptr || list->empty()) return false;
    element = std::move(list->front());
    list->erase(list->begin());
    return true;
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    Memory& mem = memory(m, n);
    if (m.status(id) == Status::kIdle) mem = {};
    if (mem.child_running == 0) {
      Value element;
      if (!pop(m, n, mem, element)) {
        const auto otherwise = m.read_status(n, kIfEmptyPort);
        if (!otherwise) return m.fail(id, "bt.missing-port", "needs \"if_empty\" as a status");
        return Next::done(*otherwise);
      }
      if (const Binding* port = m.binding(n, kValuePort)) {
        std::string error;
        if (!m.write(*port, Datum{std::move(element), nullptr}, port->type, error)) {
          return m.fail(id, "bt.entry-type", error);
        }
      }
    }
    if (m.status(id) == Status::kIdle) m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    memory(m, n).child_running = status == Status::kRunning;
    if (is_completed(status)) m.reset(m.child(n, 0));
    return Next::done(status == Status::kFailure ? Status::kFailure : Status::kRunning);
  }

  static void halt(Machine& m, const Node& n) { m.reset(m.child(n, 0)); }
};

}  // namespace sentree::bt::nodes
