#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sentree/base/time.h"

namespace sentree::runtime {

/// One part of a run that handles its messages one at a time: the mission, a skill, the simulator, the observer.
using ActorId = std::size_t;

/// What comes first at one instant of virtual time.
enum class Rank : std::uint8_t { kInjection, kSimulator, kMessage, kTimer, kTick };

/// Hands tasks to actors, now or later; is the run's clock.
///
/// Two kinds with one contract: tasks of one actor never overlap, and tasks posted from one actor to another arrive in
/// the order sent. In virtual time everything runs on the caller's thread in one order fixed by (time, rank,
/// order of posting); in real time each actor has a thread.
class Scheduler : public Clock {
 public:
  using Task = std::function<void()>;

  /// Tasks waiting in one actor's queue (real time) or in all (virtual time); one more ends the run with an error.
  static constexpr std::size_t kQueueMax = 1U << 17U;
  /// Tasks at one instant of virtual time: beyond that, parts answer each other for ever without time passing.
  static constexpr std::size_t kTasksPerInstantMax = 200'000;

  /// A new actor; `name` is used in messages only.
  virtual ActorId add_actor(std::string name) = 0;

  /// Runs `task` in `to` as soon as possible. From any thread.
  virtual void post(ActorId to, Task task) = 0;

  /// Runs `task` in `to` at `when` (at once if that has passed). From any thread. There is no cancelling: a task
  /// that may be overtaken checks whether it still applies.
  virtual void at(ActorId to, TimePoint when, Rank rank, Task task) = 0;

  /// Runs tasks until `stop()`. Returns an error if a bound was reached or, in virtual time, if nothing is left to do.
  virtual std::optional<std::string> run() = 0;

  /// Ends `run()`; tasks that have not begun are dropped. From any thread, and from a signal-safe wrapper.
  virtual void stop() = 0;

  /// The task that `actor` executes never ends: its thread is left behind (see watchdog.h). In real time the actor goes
  /// on with its next task in a new thread; in virtual time `run()` returns `why`. From any other thread.
  virtual void abandon(ActorId actor, std::string why) = 0;

  [[nodiscard]] virtual bool is_virtual() const = 0;
};

/// Virtual time: as fast as the machine allows, the same every time.
[[nodiscard]] std::unique_ptr<Scheduler> make_virtual_scheduler();

/// The steady clock, run time passing `factor` times as fast as wall time (> 0). It stands at 0 until `run()`.
[[nodiscard]] std::unique_ptr<Scheduler> make_real_scheduler(double factor = 1.0);

/// A clock that runs from now on, `factor` times as fast as wall time; for what needs no tasks.
[[nodiscard]] std::unique_ptr<Clock> make_real_clock(double factor = 1.0);

}  // namespace sentree::runtime
