#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sentree/mission/skill.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/skill.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/topics.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/scxml/guards.h"

namespace sentree::runtime {

/// A skill with its calls in an actor of its own. One whose script does not end is given up: its thread is left behind,
/// its leaf fails, and everything else goes on.
class SkillActor final : private mission::SkillHost, private scxml::GuardObserver {
 public:
  using MakePort = std::function<std::unique_ptr<ServicePort>(const project::ServicePlan&)>;
  /// Where answers go; called in the skill's actor.
  struct Replies {
    std::function<void(std::uint64_t tick, bt::Status status, Map outputs)> answered;
    std::function<void()> halted;
    std::function<void(const std::string&)> problem;
    std::function<void(const scxml::LogLine&)> log;
    /// Its script does not end: from now on the skill fails each tick. In the watchdog's thread.
    std::function<void(const std::string& why)> given_up;
    /// Told after each step of the chart; may be empty.
    std::function<void(const Skill&)> stepped = {};
  };
  /// What it uses of the run; all of it outlives the actor.
  struct Surroundings {
    Publisher& publisher;
    Scheduler& scheduler;
    StandingFaults& faults;
    Watchdog* watchdog = nullptr;
    MakePort make_port;
    /// When it takes its chart's timer number `number`, from 1, if that is later than it is due; may be empty.
    std::function<TimePoint(std::uint64_t number)> timer_arrival = {};
    /// When a call of it that is vetoed is refused, likewise.
    std::function<TimePoint(const std::string& call)> veto_arrival = {};
    /// Executes its chart; null: the actor does.
    mission::ChartElsewhere* chart_elsewhere = nullptr;
    /// It publishes what a fault holds back, and when it takes that: a replay cannot know which of several parts used
    /// up a fault that is counted.
    bool tells_delays = false;
  };

  /// @param leaf  Its number in what is on its way to it.
  SkillActor(mission::SkillModel model, std::size_t leaf, Surroundings surroundings, Replies replies);

  // From any thread.
  /// @param asked  When the request was published.
  void tick(mission::TickSkill tick, TimePoint asked);
  void halt(TimePoint asked);
  void cancel(TimePoint asked);
  /// Ends it as if its process had been killed: nothing of its chart runs any more, what is asked of it fails.
  void kill(TimePoint asked);
  /// What is published on a topic that it subscribes to, held back by its `delay` and by what was held back before. In
  /// the actor of the stream.
  void take_topic(ToldTopic told);
  /// When nothing is executed any more: publishes which publications it has not taken.
  void tell_untaken();
  /// The outcome of one of its calls.
  void take_outcome(mission::Outcome outcome) { post(std::move(outcome)); }
  /// Makes a call once more whose outcome got lost, or that never left.
  void send_again(const mission::Shared<mission::Call>& call, const idl::Method& method) { send(call, method); }
  /// It can be ticked again; what it did before is lost.
  void restart(TimePoint asked);
  /// Before anything has happened: makes the ports of the services outside the run that its chart names. Borrowed.
  [[nodiscard]] std::vector<ServicePort*> make_ports();
  /// Likewise: who is told, in its actor, of each transition that its chart takes, and of each
  /// condition that it evaluates.
  void watch_transitions(std::function<void(scxml::TransitionIndex)> taken,
                         std::function<void(scxml::TransitionIndex, bool holds)> tried) {
    taken_ = std::move(taken);
    tried_ = std::move(tried);
  }
  /// Shows the skill in its actor; null if it has been given up.
  void inspect(std::function<void(const Skill*)> look);
  /// What it remembers: of its actor, and of anybody while nothing is executed.
  [[nodiscard]] mission::SkillState& state() { return state_; }
  [[nodiscard]] ActorId actor() const { return actor_; }

 private:
  TimePoint now() const override { return scheduler_.now(); }
  void publish(Message message) override { publisher_.publish(std::move(message)); }
  bool is_heard(mission::ObservationName& name) override { return publisher_.is_heard(name); }
  void pass() override { publisher_.pass(); }
  std::uint64_t next_call() override { return publisher_.next_call(); }
  std::optional<mission::Admission> request(Message message, const mission::Shared<mission::Call>& call) override;
  void send(const mission::Shared<mission::Call>& call, const idl::Method& method) override;
  void deliver(mission::SkillDelivery what) override { post(std::move(what)); }
  void deliver_at(TimePoint when, mission::Rank rank, mission::SkillDelivery what) override;
  Duration delay_of(std::string_view message) override;
  void falsify(std::string_view call, const idl::Method& method, Value& result) override;
  bool fails(mission::Failing how, std::string_view call) override;
  void answer(std::uint64_t tick, bt::Status status, Map outputs) override;
  void halted() override { replies_.halted(); }
  void log(const scxml::LogLine& line) override { replies_.log(line); }
  void taken(scxml::TransitionIndex transition) override {
    if (taken_) taken_(transition);
  }
  // Not of what it invokes.
  void guard(const scxml::Chart& chart, scxml::TransitionIndex of, bool holds) override {
    if (chart == machine_.model().chart) tried_(of, holds);
  }
  void problem(const std::string& what) override { replies_.problem(what); }

  void take(mission::Delivery delivery);
  // What was published says another order, in which a replay would take it, or what a fault held back.
  void tell_order(const mission::SkillDelivery& what);
  void tell_order(const ToldTopic& topic);
  void tell_taken(const char* what, Map data);
  void tell_delayed(std::string_view what, Map data);
  void tell(std::string source, std::string_view what, Map data);
  // Whether a fault held it back. Cost: a lock.
  [[nodiscard]] bool was_delayed(const mission::SkillDelivery& what);
  [[nodiscard]] mission::Delivery addressed(mission::SkillDelivery what) const { return {leaf_, std::move(what)}; }
  void post(mission::SkillDelivery what) { scheduler_.post(actor_, addressed(std::move(what))); }
  // True: a fault holds it back, and it has been taken.
  [[nodiscard]] bool held_back(std::string_view message, mission::SkillDelivery& what);
  void give_up(const SourceSpan& script);
  void told() const {
    if (replies_.stepped) replies_.stepped({machine_.model(), state_});
  }

  const std::size_t leaf_;
  Publisher& publisher_;
  Scheduler& scheduler_;
  StandingFaults& faults_;
  Watchdog* watchdog_;
  MakePort make_port_;
  Replies replies_;
  std::function<void(scxml::TransitionIndex)> taken_;
  std::function<void(scxml::TransitionIndex, bool)> tried_;
  std::shared_ptr<Watched> watched_;
  mission::SkillMachine machine_;
  mission::SkillState state_;
  ActorId actor_;
  std::atomic<bool> given_up_ = false;
  std::string why_;  // it was given up; written before given_up_
  std::map<std::string, std::unique_ptr<ServicePort>> ports_;
  std::mutex order_mutex_;  // of state_.not_before, and of what is held back
  const bool tells_delays_;
  std::deque<std::uint64_t> delayed_ticks_;  // by their numbers
  std::size_t delayed_halts_ = 0;
  std::size_t delayed_cancels_ = 0;
  // For the latest tick, halt and cancellation, unless a fault holds it back.
  std::atomic<TimePoint> asked_ = kNever;
  std::atomic<TimePoint> halt_asked_ = kNever;
  std::atomic<TimePoint> cancel_asked_ = kNever;
  // For the latest.
  std::atomic<TimePoint> kill_asked_ = kNever;
  std::atomic<TimePoint> restart_asked_ = kNever;
  // In real time: when it last took anything, and anything but a tick.
  std::optional<TimePoint> took_;
  std::optional<TimePoint> took_other_;
  std::uint64_t timers_ = 0;  // taken so far
  std::function<TimePoint(std::uint64_t number)> timer_arrival_;
  std::function<TimePoint(const std::string& call)> veto_arrival_;
  TopicInbox topics_;
};

}  // namespace sentree::runtime
