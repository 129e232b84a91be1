#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sentree/bt/nodes/decorator.h"

namespace sentree::bt::nodes {

/// LoopInt, LoopDouble, LoopBool, LoopString: the child runs once per element of a queue. RUNNING between the cycles.
struct Loop : AnyNode {
  // `kPosition`: in a literal queue.
  enum : std::size_t { kChildRunning, kPosition };
  static constexpr std::array kWords{Word{Word::Lives::kUnlessIdle},
                                     Word{Word::Lives::kUnlessIdle, Word::Range::kPosition}};
  static constexpr bool kRepeats = true;
  static may::Mask may_return(const may::Asked& asked) {
    return (asked.child() & may::kFailure) | may::kRunning | asked.status(1);
  }
  template <class T>
  static BuiltIn of(std::string id) {
    return format4(decorator(
        std::move(id), {inout<std::vector<T>>("queue", "elements separated by ';', or an entry that holds a list"),
                        input_default<Status>("if_empty", "SUCCESS", "status when there is no element"),
                        output<T>("value", "the present element")}));
  }
  static Manifests manifests() {
    return {of<std::int32_t>("LoopInt"), of<double>("LoopDouble"), of<bool>("LoopBool"), of<std::string>("LoopString")};
  }
  static constexpr std::uint32_t kQueuePort = 0, kIfEmptyPort = 1, kValuePort = 2;

  /// Takes the next element off the queue; false if there is none.
  static bool pop(Machine& m, const Node& n, std::int32_t* mem, Value& element) {
    if (n.data != kNone) {
      const auto& queue = m.model().queues[n.data];
      if (static_cast<std::size_t>(mem[kPosition]) >= queue.size()) return false;
      element = queue[static_cast<std::size_t>(mem[kPosition]++)];
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
    std::int32_t* const mem = m.memory(n);
    if (m.status(id) == Status::kIdle) clear(mem, kWords);
    if (mem[kChildRunning] == 0) {
      Value element;
      if (!pop(m, n, mem, element)) {
        const auto otherwise = m.read_status(n, kIfEmptyPort);
        if (!otherwise) return lacks(m, n, id, kIfEmptyPort, "needs \"if_empty\" as a status");
        return Next::done(*otherwise);
      }
      if (const Binding* port = m.binding(n, kValuePort)) {
        std::string error;
        if (!m.write(*port, Datum{std::move(element), nullptr}, nullptr, error)) {
          return m.fail(id, "bt.entry-type", error);
        }
      }
    }
    if (m.status(id) == Status::kIdle) m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    m.memory(n)[kChildRunning] = status == Status::kRunning;
    if (is_completed(status)) m.reset(m.child(n, 0));
    return Next::done(status == Status::kFailure ? Status::kFailure : Status::kRunning);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) { m.reset(m.child(n, 0)); }
};

}  // namespace sentree::bt::nodes
