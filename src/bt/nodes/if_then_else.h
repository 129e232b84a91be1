#pragma once

#include <array>
#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// The condition is asked once; then its branch runs to the end.
struct IfThenElse : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kChild}};
  static Manifests manifests() { return {both(control("IfThenElse"))}; }
  static may::Mask may_return(const may::Asked& asked) { return may::branches(asked); }
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

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    branch(m, n) = 0;
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
