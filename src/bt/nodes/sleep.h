#pragma once

#include "sentree/bt/nodes/timer.h"

namespace sentree::bt::nodes {

/// RUNNING until the time is over, then SUCCESS.
struct Sleep : AnyNode {
  static constexpr bool kStartsTimers = true;
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess | may::kRunning; }
  static Manifests manifests() { return {format4(leaf("Sleep", Category::kAction, {input<std::uint32_t>("msec")}))}; }
  static std::optional<may::Failing> always_fails(const may::Given& given) { return given.lacks({0}); }
  static void halt(Machine& m, const Node& /*n*/, NodeId id) { m.stop_timer(id); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (m.status(id) == Status::kIdle) {
      const auto time = m.read_integer(n, 0);
      if (!time) return lacks(m, n, id, 0, "needs msec as a whole number");
      if (*time <= 0) return Next::done(Status::kSuccess);
      m.start_timer(id, after(m.now(), *time));
      return Next::done(Status::kRunning);
    }
    // A completed leaf keeps its status until its parent resets it.
    if (m.status(id) != Status::kRunning) return Next::done(m.status(id));
    return Next::done(m.has_timer(id) ? Status::kRunning : Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
