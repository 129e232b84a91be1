#pragma once

#include <chrono>

#include "sentree/bt/machine.h"

// Delay, Timeout, Sleep, and the delay of a TestNode, on the run's time. A timer that is due makes the tree ask for a
// tick.

namespace sentree::bt::nodes {

inline TimePoint after(TimePoint now, std::int64_t milliseconds) {
  return add_saturating(now, from_seconds(static_cast<double>(milliseconds) * 1e-3));
}

/// Ticks its child only after the delay.
struct Delay {
  enum : std::int32_t { kIdle, kWaiting, kElapsed };
  static std::int32_t& phase(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t& mem = phase(m, n);
    if (mem == kIdle) {
      const auto delay = m.read_integer(n, 0);
      if (!delay || *delay < 0)
        return m.fail(id, "bt.missing-port", "needs delay_msec as a whole number, not negative");
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

/// Halts its child when the time is over, at once and not at the next tick, which then returns FAILURE.
struct Timeout {
  enum : std::int32_t { kIdle, kRunning, kElapsed };
  static std::int32_t& phase(Machine& m, const Node& n) { return *m.memory(n); }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    std::int32_t& mem = phase(m, n);
    if (mem == kIdle) {
      const auto limit = m.read_integer(n, 0);
      if (!limit || *limit < 0) return m.fail(id, "bt.missing-port", "needs msec as a whole number, not negative");
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

/// RUNNING until the time is over, then SUCCESS.
struct Sleep {
  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (m.status(id) == Status::kIdle) {
      const auto time = m.read_integer(n, 0);
      if (!time) return m.fail(id, "bt.missing-port", "needs msec as a whole number");
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
