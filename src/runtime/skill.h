#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"
#include "sentree/scxml/step.h"

namespace sentree::runtime {

/// A call that a chart asks for.
struct SkillCall {
  std::uint64_t run = 0;  ///< The run it belongs to; its outcome must name it again.
  std::string service;
  std::string method;
  Value args;
  std::string sendid;
};

/// How a call ended, for the chart.
struct SkillEvent {
  std::uint64_t run = 0;
  std::string name;  ///< "battery.getBatteryState.reply", "….error" or "error.communication".
  std::string sendid;
  Value data;
};

/// What a skill does to the world around it. Called from within the skill's own functions, in order.
class SkillPort {
 public:
  virtual ~SkillPort() = default;
  virtual void call(SkillCall call) = 0;
  /// The answer to the outstanding tick.
  virtual void answer(bt::Status status, Map outputs) = 0;
  /// The halt is over; no run is left.
  virtual void halted() = 0;
  /// Wants `Skill::timers` at `when` (kNever: not at all).
  virtual void wake_at(TimePoint when) = 0;
  virtual void log(const scxml::LogLine& line) = 0;
  /// Something a person should know; the run goes on.
  virtual void problem(const std::string& what) = 0;
};

struct SkillOptions {
  std::string name;  ///< The leaf's name in messages.
  bool condition = false;
  Duration halt_deadline = std::chrono::seconds(2);
  std::uint64_t seed = 1;
  /// Refuses a call before it is made: unknown service or method, wrong arguments (becomes error.execution).
  std::function<Result<void>(const scxml::OutgoingSend&)> check_call;
  scxml::ExecutionWatch* watch = nullptr;  ///< Borrowed as long as the skill; null: nobody looks on.
};

/// One leaf's skill: turns ticks and halts into runs of a chart (the design's "A leaf invokes its skill").
///
/// Owns no thread and no clock; whoever drives it hands in the time. Deterministic.
class Skill {
 public:
  Skill(scxml::Chart chart, SkillOptions options, SkillPort& port);
  Skill(const Skill&) = delete;
  Skill& operator=(const Skill&) = delete;

  /// A tick; `started`: the leaf was idle, so a new run begins. Answered by `SkillPort::answer`, at once for an
  /// action, at the end of the run for a condition.
  void tick(bool started, const Map& inputs, TimePoint now);
  /// Answered by `SkillPort::halted`, at once if no run is on.
  void halt(TimePoint now);
  /// Gives the run up without `halt`: no answer of any kind follows.
  void cancel(TimePoint now);
  /// The run is gone as if it had never been, nothing of the chart is executed and nobody is answered: what a process
  /// that is killed does.
  void drop();
  /// A call's outcome. False: its run is over, the chart does not see it.
  bool deliver(const SkillEvent& event, TimePoint now);
  /// Whether an outcome of that run would reach the chart.
  [[nodiscard]] bool is_current(std::uint64_t run) const { return running_ && run == run_; }
  /// Timers of the chart and the halt deadline, as far as due.
  void timers(TimePoint now);

  [[nodiscard]] const scxml::Chart& chart() const { return chart_; }
  [[nodiscard]] const scxml::Session& session() const { return session_; }
  [[nodiscard]] bool running() const { return running_; }
  /// The transition that its chart took last, in any run, and the event that it got last.
  struct Latest {
    std::optional<scxml::TransitionIndex> transition;
    std::string event;
    std::uint64_t transitions = 0;  ///< Taken so far.
  };
  [[nodiscard]] const Latest& latest() const { return watcher_.latest; }
  /// Everything that it remembers, as data. Error: scxml.no-value-form.
  [[nodiscard]] Result<Value> save() const;

 private:
  // Notes what the chart does; its children are not looked at.
  struct Watcher final : scxml::Observer {
    explicit Watcher(const Skill& owner) : skill(owner) {}
    void event(const scxml::Chart& chart, std::string_view session, const scxml::Event& event) override;
    void transition(const scxml::Chart& chart, std::string_view session, scxml::TransitionIndex taken) override;
    const Skill& skill;
    Latest latest;
  };

  void start(const Map& inputs, TimePoint now);
  scxml::StepInfo step(scxml::Event event, TimePoint now);
  void follow(scxml::Effects& effects);
  void end_run(const std::string& final_id, const std::optional<Value>& donedata);
  void settle();
  void schedule();

  scxml::Chart chart_;
  SkillOptions options_;
  SkillPort& port_;
  Watcher watcher_{*this};
  scxml::Host host_;
  scxml::Session session_;
  std::uint64_t run_ = 0;
  bool running_ = false;      // the chart lives
  bool answer_owed_ = false;  // a tick waits for its answer
  bool halting_ = false;      // `halt` was delivered and the run has not ended
  std::optional<TimePoint> halt_due_;
  std::optional<bt::Status> ended_;  // status of a run that ended and has not been answered
  Map outputs_;
};

}  // namespace sentree::runtime
