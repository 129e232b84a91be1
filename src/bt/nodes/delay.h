#pragma once

#include <array>

#include "sentree/bt/nodes/timer.h"

namespace sentree::bt::nodes {

/// Ticks its child only after the delay.
struct Delay : AnyNode {
  static constexpr bool kStartsTimers = true;
  static constexpr std::array kWords{Word{Word::Lives::kAlways}};
  static may::Mask may_return(const may::Asked& asked) { return asked.child() | may::kRunning; }
  static Manifests manifests() {
    return {both(decorator("Delay", {input<std::uint32_t>("delay_msec", "milliseconds before the child")}))};
  }
  static std::optional<may::Failing> always_fails(const may::Given& given) { return given.lacks({0}); }
  enum : std::int32_t { kIdle, kWaiting, kElapsed };
  static std::int32_t& phase(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t& mem = phase(m, n);
    if (mem == kIdle) {
      const auto delay = m.read_integer(n, 0);
      if (!delay || *delay < 0) return lacks(m, n, id, 0, "needs delay_msec as a whole number, not negative");
      m.set_status(id, Status::kRunning);
      m.start_timer(id, after(m.now(), *delay));
      mem = kWaiting;
      if (*delay == 0) fire(m, n, id);
    }
    return mem == kElapsed ? Next::tick(0) : Next::done(Status::kRunning);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) {
      phase(m, n) = kIdle;
      m.reset(m.child(n, 0));
    }
    return Next::done(status);
  }
  static void fire(Machine& m, const Node& n, NodeId id) {
    m.stop_timer(id);
    phase(m, n) = kElapsed;
  }
  static void halt(Machine& m, const Node& n, NodeId id) {
    m.stop_timer(id);
    phase(m, n) = kIdle;
    m.reset(m.child(n, 0));
  }
};

}  // namespace sentree::bt::nodes
