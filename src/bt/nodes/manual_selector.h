#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// The child that a person chooses; RUNNING until somebody has. A child that runs is not chosen again.
struct ManualSelector : AnyNode {
  // The child that runs, from 1; 0: none. The one that is ticked. The last choice: child + 1, or a status negated;
  // 0: none yet.
  enum : std::size_t { kRunning, kCurrent, kLast };
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kCounted},
                                     Word{Word::Lives::kInTick, Word::Range::kChild},
                                     Word{Word::Lives::kAlways, Word::Range::kChosen}};
  static may::Mask may_return(const may::Asked& asked) { return asked.any | may::kRunning; }
  static Manifests manifests() {
    return {both(control("ManualSelector",
                         {input_default<bool>("repeat_last_selection", "false", "choose once only"),
                          input<std::int32_t>("selection", "index of the child, from 0; negative: none yet")}))};
  }
  static constexpr std::uint32_t kRepeatPort = 0, kSelectionPort = 1;

  static std::optional<may::Failing> always_fails(const may::Given& given) {
    return given.greater(kSelectionPort, std::int64_t{given.children} - 1, "bt.bad-selection", ", counted from 0");
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    m.set_status(id, Status::kRunning);
    if (mem[kRunning] != 0) return tick(mem, mem[kRunning] - 1);
    if (mem[kLast] == 0 || !m.read_bool(n, kRepeatPort, false)) {
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
        mem[kLast] = -static_cast<std::int32_t>(choice.status);
      } else if (choice.child >= n.child_count) {
        return m.fail(id, "bt.bad-selection",
                      "child " + std::to_string(choice.child) + " is chosen and there are " +
                          std::to_string(n.child_count) + "; they count from 0");
      } else {
        mem[kLast] = static_cast<std::int32_t>(choice.child) + 1;
      }
    }
    return mem[kLast] < 0 ? Next::done(static_cast<Status>(-mem[kLast])) : tick(mem, mem[kLast] - 1);
  }

  static Next tick(std::int32_t* mem, std::int32_t child) {
    mem[kCurrent] = child;
    return Next::tick(static_cast<std::uint32_t>(child));
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    mem[kRunning] = status == Status::kRunning ? mem[kCurrent] + 1 : 0;
    if (is_completed(status)) m.reset_children(n);
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    m.memory(n)[kRunning] = 0;
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
