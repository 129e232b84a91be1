#pragma once

#include <array>
#include <string>

#include "sentree/bt/nodes/decorator.h"

namespace sentree::bt::nodes {

/// The script is not evaluated again once it let the child start, until the child completes; halting does not change
/// that.
struct Precondition : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kAlways}};
  static constexpr bool kStaysRunning = false;
  static may::Mask may_return(const may::Asked& asked) { return asked.child() | asked.status(1); }
  static Manifests manifests() {
    return {format4(decorator("Precondition", {input<std::string>("if"), input_default<Status>("else", "FAILURE")}))};
  }
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

}  // namespace sentree::bt::nodes
