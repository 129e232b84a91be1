#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "sentree/runtime/caller.h"
#include "sentree/runtime/mission.h"
#include "sentree/runtime/skill.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

/// A skill with its calls in an actor of its own. One whose script does not end is given up: its thread is left behind,
/// its leaf fails, and everything else goes on.
class SkillActor final : private SkillPort {
 public:
  struct Options {
    std::string name;
    bool condition = false;
    Duration halt_deadline{};
    std::uint64_t seed = 1;
    Watchdog* watchdog = nullptr;  ///< Outlives the actor.
    /// Told, in the actor, after each step of the chart; may be empty.
    std::function<void(const Skill&)> on_step = {};
  };
  /// Where answers go; called in the skill's actor.
  struct Replies {
    std::function<void(std::uint64_t tick, bt::Status status, Map outputs)> answered;
    std::function<void()> halted;
    std::function<void(const std::string&)> problem;
    std::function<void(const scxml::LogLine&)> log;
    /// Its script does not end: from now on the skill fails each tick. In the watchdog's thread.
    std::function<void(const std::string& why)> given_up;
  };

  SkillActor(scxml::Chart chart, Options options, const std::map<std::string, project::ServicePlan>& services,
             Caller::MakePort make_port, Publisher& publisher, Scheduler& scheduler, StandingInterventions& standing,
             Replies replies);

  // From any thread.
  void tick(std::uint64_t tick, bool started, Map inputs);
  void halt();
  void cancel();
  /// Ends it as if its process had been killed: nothing of its chart runs any more, what is asked of it fails.
  void kill();
  /// It can be ticked again; what it did before is lost.
  void restart();
  /// Shows the skill in its actor; null if it has been given up.
  void inspect(std::function<void(const Skill*)> look);

 private:
  void call(SkillCall call) override { caller_.call(std::move(call)); }
  void answer(bt::Status status, Map outputs) override;
  void halted() override;
  void wake_at(TimePoint when) override;
  void log(const scxml::LogLine& line) override { replies_.log(line); }
  void problem(const std::string& what) override { replies_.problem(what); }
  void deliver_after_delay(const std::string& message, Scheduler::Task task);
  /// With the lock held. True: it comes later, and the task has been taken.
  [[nodiscard]] bool deliver_delayed(const std::string& message, Scheduler::Task& task);
  /// `task` in the actor, unless the skill has been given up by then.
  Scheduler::Task unless_given_up(Scheduler::Task task);
  void give_up(const SourceSpan& script, const Watchdog& watchdog);
  // What is owed to the mission, by a skill that will not answer any more.
  void fail_outstanding(const std::string& why);
  void stepped() const {
    if (on_step_) on_step_(skill_);
  }

  std::string name_;
  Publisher& publisher_;
  Scheduler& scheduler_;
  StandingInterventions& standing_;
  ActorId actor_;
  Replies replies_;
  std::function<void(const Skill&)> on_step_;
  std::shared_ptr<Watched> watched_;
  std::atomic<bool> given_up_ = false;
  std::string why_;      // it was given up; written before given_up_
  bool killed_ = false;  // the actor's
  Caller caller_;
  Skill skill_;
  std::uint64_t tick_ = 0;      // the latest
  std::uint64_t answered_ = 0;  // the latest that was answered
  bool halting_ = false;
  TimePoint wake_ = kNever;
  std::mutex order_mutex_;
  TimePoint not_before_{};  // a delayed tick or halt holds back the later ones
};

}  // namespace sentree::runtime
