#pragma once

#include <array>
#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// The condition is asked at every tick; the other branch is halted.
struct WhileDoElse : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kInTick, Word::Range::kChild}};
  static constexpr std::uint32_t kHaltsFrom = 1;
  static Manifests manifests() { return {both(control("WhileDoElse"))}; }
  static may::Mask may_return(const may::Asked& asked) { return may::branches(asked); }
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

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    current(m, n) = 0;
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
