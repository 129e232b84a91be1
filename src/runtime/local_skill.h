#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "sentree/runtime/caller.h"
#include "sentree/runtime/mission.h"
#include "sentree/runtime/skill.h"

namespace sentree::runtime {

/// A skill with its calls in an actor of its own.
class SkillActor final : private SkillPort {
 public:
  struct Options {
    std::string name;
    bool condition = false;
    Duration halt_deadline{};
    std::uint64_t seed = 1;
  };
  /// Where answers go; called in the skill's actor.
  struct Replies {
    std::function<void(std::uint64_t tick, bt::Status status, Map outputs)> answered;
    std::function<void()> halted;
    std::function<void(const std::string&)> problem;
    std::function<void(const scxml::LogLine&)> log;
  };

  SkillActor(scxml::Chart chart, Options options, const std::map<std::string, ServicePlan>& services,
             Caller::MakePort make_port, Publisher& publisher, Scheduler& scheduler, const Delays& delays,
             Replies replies);

  // From any thread.
  void tick(std::uint64_t tick, bool started, Map inputs);
  void halt();
  void cancel();

 private:
  void call(SkillCall call) override { caller_.call(std::move(call)); }
  void answer(bt::Status status, Map outputs) override;
  void halted() override;
  void wake_at(TimePoint when) override;
  void log(const scxml::LogLine& line) override { replies_.log(line); }
  void problem(const std::string& what) override { replies_.problem(what); }
  void deliver_after_delay(const std::string& message, Scheduler::Task task);

  std::string name_;
  Scheduler& scheduler_;
  const Delays& delays_;
  ActorId actor_;
  Replies replies_;
  Caller caller_;
  Skill skill_;
  std::uint64_t tick_ = 0;  // the outstanding one
  TimePoint wake_ = kNever;
  std::mutex order_mutex_;
  TimePoint not_before_{};  // a delayed tick or halt holds back the later ones
};

}  // namespace sentree::runtime
