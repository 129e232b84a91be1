#pragma once

#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/mission/state.h"

namespace sentree::runtime {

/// One part of a run that handles its messages one at a time: the mission, a skill, the simulator, the observer.
using ActorId = std::size_t;

/// How run time passes, as a person who steers the run wants it.
struct Pace {
  bool paused = false;  ///< Time stands still.
  /// Run seconds per wall second while it does not; 0: as fast as the machine allows (virtual time only).
  double factor = 0.0;
};
inline constexpr double kFactorMin = 0.001;
inline constexpr double kFactorMax = 1000.0;

enum class Urgency : std::uint8_t { kForeground, kBackground };

/// Where something stands among all that a run in virtual time does: several things may come from outside at one
/// instant.
struct Place {
  TimePoint when{};
  std::uint64_t order = 0;  ///< At that instant; grows over the whole run.
  friend auto operator<=>(const Place&, const Place&) = default;
};

/// Writes down what a run in virtual time needs to be executed again, before anything follows from it. Called in the
/// thread of the run.
class Chronicle {
 public:
  virtual ~Chronicle() = default;
  /// Time has come to a later instant, at which nothing has happened yet.
  virtual void instant(TimePoint now) = 0;
  /// Something came from outside and happens there.
  virtual void entered(const Place& where, const mission::Delivery& what) = 0;
};

/// Hands tasks to actors, now or later; is the run's clock.
///
/// Two kinds with one contract: tasks of one actor never overlap, and tasks posted from one actor to another arrive in
/// the order sent. In virtual time everything runs on the caller's thread in one order fixed by (time, rank,
/// order of posting); in real time different actors run side by side, and one that does not come back holds up no
/// other.
class Scheduler : public Clock {
 public:
  using Task = std::function<void()>;

  /// Tasks waiting in one actor's queue (real time) or in all (virtual time); one more ends the run with an error.
  static constexpr std::size_t kQueueMax = 1U << 17U;
  /// Tasks at one instant of virtual time: beyond that, parts answer each other for ever without time passing.
  static constexpr std::size_t kTasksPerInstantMax = 200'000;

  /// A new actor; `name` is used in messages only. One in the background waits, in real time and for a few milliseconds
  /// at most, while others that were told something have not finished with it.
  virtual ActorId add_actor(std::string name, Urgency urgency = Urgency::kForeground) = 0;

  // `now()` may be asked from any thread.

  /// Runs `task` in `to` as soon as possible. From any thread.
  virtual void post(ActorId to, Task task) = 0;

  /// As `post`, from a thread that has nothing else to do: in real time it may execute the task, and what else `to` has
  /// to do, before this returns. Not with a lock held that a task could want.
  virtual void hand_over(ActorId to, Task task) { post(to, std::move(task)); }

  /// Runs `task` in `to` at `when` (at once if that has passed). From any thread. There is no cancelling: a task
  /// that may be overtaken checks whether it still applies.
  virtual void at(ActorId to, TimePoint when, mission::Rank rank, Task task) = 0;

  // The same for what is on its way between parts of the run, which is data: it is given to who takes the deliveries of
  // that actor.
  virtual void post(ActorId to, mission::Delivery delivery) { post(to, task_of(to, std::move(delivery))); }
  void hand_over(ActorId to, mission::Delivery delivery) {
    if (is_virtual())
      post(to, std::move(delivery));
    else
      hand_over(to, task_of(to, std::move(delivery)));
  }
  virtual void at(ActorId to, TimePoint when, mission::Rank rank, mission::Delivery delivery) {
    at(to, when, rank, task_of(to, std::move(delivery)));
  }
  /// Before the run.
  void on_delivery(ActorId actor, std::function<void(mission::Delivery)> take) {
    if (recipients_.size() <= actor) recipients_.resize(actor + 1);
    recipients_[actor] = std::move(take);
  }

  /// Which of several deliveries to different parts, due at one instant, comes first: by the number of that instant,
  /// from 1, and in the order of virtual time. Those without an effect (`mission::has_effect`) are not asked about.
  /// Nothing of it in real time. Before the run.
  virtual void on_order(
      std::function<std::size_t(std::uint64_t number, std::span<const mission::Delivery* const> due)> decide,
      std::function<bool(const mission::Delivery&)> has_effect) = 0;

  /// Between two tasks, in real time while it is held and nobody else is at work: its part of the state of a run. Tasks
  /// that are no deliveries belong to who posted them and are left out.
  virtual void save(mission::State& state) const = 0;
  /// Before `run()`: goes on from there. `actor_of` names who takes a delivery.
  virtual void load(const mission::State& state, const std::function<ActorId(const mission::Delivery&)>& actor_of) = 0;

  /// Runs tasks until `stop()`. Returns an error if a bound was reached or, in virtual time, if nothing is left to do.
  virtual std::optional<std::string> run() = 0;

  /// From any thread, before the run too. In virtual time it is observed between two instants: the one that goes on is
  /// finished first, so that a run that was held is the same run. In real time timers stop at once; messages that are
  /// on their way still arrive.
  virtual void set_pace(Pace pace) = 0;
  [[nodiscard]] virtual Pace pace() const = 0;
  /// In real time: whatever the pace is, time stands until `go_on`; for a moment that nobody should notice. From any
  /// thread. Virtual time stands between two tasks anyway.
  virtual void hold() {}
  virtual void go_on() {}
  /// While it is held, in a task of `actor`: waits until nobody else has anything left to do, for `patience` at most.
  /// Errors: run.cannot-carry (names who has), run.ended (it was stopped meanwhile).
  [[nodiscard]] virtual Result<void> settle(ActorId /*actor*/, std::chrono::milliseconds /*patience*/) { return {}; }
  /// In a task of `actor`, in real time if nobody else is at work or has anything due: looks, while nothing else is
  /// executed and time stands, which it makes up for afterwards. False: somebody is at work; it has not looked.
  [[nodiscard]] virtual bool look_at_rest(ActorId /*actor*/, const std::function<void()>& look) {
    look();
    return true;
  }
  /// Whether time stands still: paused, and in virtual time nothing is left to do at this instant.
  [[nodiscard]] virtual bool standing() const = 0;
  /// Told, in any thread, when time begins to stand still. Before `run()`.
  virtual void on_standing(std::function<void()> told) = 0;
  /// Commands from outside that wait to be taken in.
  static constexpr std::size_t kInboxMax = 1024;
  /// Runs `task` in `to` as something that comes from outside the run, also while it is paused. From any thread. False:
  /// too many wait already.
  ///
  /// In virtual time it becomes an injection at a time at which nothing but injections has happened: now, or the next
  /// nanosecond. So the same injection, scheduled at that time, gives the same run.
  [[nodiscard]] virtual bool inject(ActorId to, Task task) = 0;
  /// The same for what is on its way to a part of the run from outside it, as the outcome of a call is. In real time
  /// as `post`.
  virtual void enter(ActorId to, mission::Delivery delivery) { post(to, std::move(delivery)); }

  // Virtual time only, before `run()` where nothing else is said.

  /// Of the task that is executed. In the thread of the run.
  [[nodiscard]] virtual Place place() const { return {now(), 0}; }
  /// Borrowed.
  virtual void keep(Chronicle* /*chronicle*/) {}
  /// Told, in the thread of the run, when that was held up and goes on later than its pace wants: how much wall time it
  /// has lost so far.
  virtual void on_behind(const std::function<void(Duration)>& /*told*/) {}
  /// What is due until then is executed as fast as the machine allows, and unwritten; nothing enters meanwhile. Then
  /// `reached` is called, once, in the thread of the run, and time passes as the pace says.
  virtual void catch_up(TimePoint /*until*/, const std::function<void()>& /*reached*/) {}
  /// In `reached`: it is `to` now. What was due before is due now, in its order. `put_off` sees each delivery first,
  /// and may set its time.
  virtual void leap(TimePoint /*to*/, const std::function<void(TimePoint& when, mission::Delivery& what)>&) {}

  /// The time that a view shows: `now()`, but in virtual time that follows the wall clock it also passes between
  /// events. From any thread.
  [[nodiscard]] virtual TimePoint view_time() const = 0;

  /// Ends `run()`; tasks that have not begun are dropped. From any thread, and from a signal-safe wrapper.
  virtual void stop() = 0;

  /// The task that `actor` executes never ends: its thread is left behind (see watchdog.h). In real time the actor goes
  /// on with its next task in another thread; in virtual time `run()` returns `why`. From any other thread.
  virtual void abandon(ActorId actor, std::string why) = 0;

  [[nodiscard]] virtual bool is_virtual() const = 0;
  /// Whether the calling thread executes one of its tasks: then it must not wait for another.
  [[nodiscard]] virtual bool is_inside() const = 0;

 protected:
  void give(ActorId to, mission::Delivery&& delivery) { recipients_[to](std::move(delivery)); }
  Task task_of(ActorId to, mission::Delivery delivery) {
    return [this, to, delivery = std::move(delivery)]() mutable { give(to, std::move(delivery)); };
  }

 private:
  std::deque<std::function<void(mission::Delivery)>> recipients_;  // by actor; never moved
};

/// Virtual time: as fast as the machine allows or as fast as its pace says, the same every time.
[[nodiscard]] std::unique_ptr<Scheduler> make_virtual_scheduler();

/// The steady clock, run time passing `factor` times as fast as wall time (> 0). It stands at 0 until `run()`.
[[nodiscard]] std::unique_ptr<Scheduler> make_real_scheduler(double factor = 1.0);

/// A clock that runs from now on, `factor` times as fast as wall time; for what needs no tasks.
[[nodiscard]] std::unique_ptr<Clock> make_real_clock(double factor = 1.0);

}  // namespace sentree::runtime
