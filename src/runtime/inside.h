#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/state.h"
#include "sentree/project/project.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/standing.h"

namespace sentree::runtime {

class Mission;
class Monitors;
class SkillActor;
class Steering;

/// What somebody who takes part in a run (a recorder, a replay) may reach. Lives as long as the run.
class RunInside {
 public:
  virtual ~RunInside() = default;
  [[nodiscard]] virtual Scheduler& scheduler() = 0;
  /// The actor of the timeline, for tasks that belong to nobody else.
  [[nodiscard]] virtual ActorId director() const = 0;
  /// The actor in which observations are handed on; `monitors` may be looked at there.
  [[nodiscard]] virtual ActorId observer() const = 0;
  virtual void publish(Message message) = 0;
  /// A new number for a call.
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// Observations published so far.
  [[nodiscard]] virtual std::uint64_t published() const = 0;
  /// The simulated robot, or null if none runs in this process.
  [[nodiscard]] virtual SimHost* sim() = 0;
  /// Its state belongs to its actor.
  [[nodiscard]] virtual const Mission& mission() const = 0;
  [[nodiscard]] virtual const Monitors& monitors() const = 0;
  /// The skill of a leaf, by index in the plan, or null if it runs in another process.
  [[nodiscard]] virtual SkillActor* skill(std::size_t leaf) = 0;
  /// For other threads; its answers come from the run.
  [[nodiscard]] virtual Steering& steering() = 0;
  /// In the director's actor: what an entry of a timeline does. Its names must be those of the run (see
  /// `check_intervention`).
  virtual void inject(const project::Injection& injection) = 0;
  /// In the director's actor, in virtual time: fails what a leaf was asked, as a skill that cannot be reached does.
  virtual void fail_leaf(std::size_t leaf, const std::string& reason) = 0;
  /// Calls are not delayed or falsified, because whoever makes their ports has seen to that; or no message is delayed,
  /// because `RunOptions::arrival` and the like see to that too.
  virtual void spare(Spared what) = 0;
  /// In the director's actor, before `capture`: in real time, while the scheduler is held, waits until nothing is half
  /// done, for `patience` at most. Errors: run.ended; run.cannot-carry (somebody is at work, or was left behind).
  [[nodiscard]] virtual Result<void> settle(std::chrono::milliseconds patience) = 0;
  /// In the director's actor, in real time once it has settled: the whole run as a value, from which
  /// `RunOptions::from` goes on. Skills elsewhere are in it as new ones. What somebody who takes part in the run has in
  /// mind (a recorder's samples, a person's `run_until`) is not in it.
  [[nodiscard]] virtual mission::State capture() = 0;
  struct Uncaptured {
    bool is_at_work = false;  ///< Something is, or was while parts elsewhere were asked.
    std::string why_never;    ///< Else: which part elsewhere does not say what it remembers, and why.
  };
  /// In the director's actor, in virtual time or while nobody else is at work: the same with what parts elsewhere
  /// remember. `told` is called in that actor, before this returns if all parts are here; never, if the run ends first.
  using CaptureTold = std::function<void(tl::expected<mission::State, Uncaptured>)>;
  virtual void capture_at_rest(CaptureTold told) = 0;
  /// Ends the run as it is, without halting anything.
  virtual void end() = 0;
};

}  // namespace sentree::runtime
