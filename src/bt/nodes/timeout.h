#pragma once

#include <array>

#include "sentree/bt/nodes/timer.h"

namespace sentree::bt::nodes {

/// Halts its child when the time is over, at once and not at the next tick, which then returns FAILURE.
struct Timeout : AnyNode {
  static constexpr bool kStartsTimers = true;
  static constexpr std::array kWords{Word{Word::Lives::kAlways}};
  static constexpr std::uint32_t kHaltsFrom = 0;
  static may::Mask may_return(const may::Asked& asked) { return asked.child() | may::kFailure; }
  static Manifests manifests() {
    return {both(decorator("Timeout", {input<std::uint32_t>("msec", "milliseconds until the child is halted")}))};
  }
  static std::optional<may::Failing> always_fails(const may::Given& given) { return given.lacks({0}); }
  enum : std::int32_t { kIdle, kRunning, kElapsed };
  static std::int32_t& phase(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t& mem = phase(m, n);
    if (mem == kIdle) {
      const auto limit = m.read_integer(n, 0);
      if (!limit || *limit < 0) return lacks(m, n, id, 0, "needs msec as a whole number, not negative");
      m.set_status(id, Status::kRunning);
      if (*limit > 0) m.start_timer(id, after(m.now(), *limit));
      mem = kRunning;
    }
    if (mem == kElapsed) {
      mem = kIdle;
      return Next::done(Status::kFailure);
    }
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId id, Status status) {
    if (is_completed(status)) {
      m.stop_timer(id);
      phase(m, n) = kIdle;
      m.reset(m.child(n, 0));
    }
    return Next::done(status);
  }
  static void fire(Machine& m, const Node& n, NodeId id) {
    m.stop_timer(id);
    if (m.status(m.child(n, 0)) != Status::kRunning) return;
    phase(m, n) = kElapsed;
    m.reset(m.child(n, 0));
  }
  static void halt(Machine& m, const Node& n, NodeId id) {
    m.stop_timer(id);
    phase(m, n) = kIdle;
    m.reset(m.child(n, 0));
  }
};

}  // namespace sentree::bt::nodes
