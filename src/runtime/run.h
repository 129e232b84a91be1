#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/mission/choice.h"
#include "sentree/monitor/explanation.h"
#include "sentree/monitor/monitor.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/elsewhere.h"
#include "sentree/runtime/inside.h"
#include "sentree/runtime/journal.h"
#include "sentree/runtime/mission.h"
#include "sentree/runtime/skill.h"
#include "sentree/runtime/stream.h"
#include "sentree/sim/state.h"

namespace sentree::runtime {

struct MonitorReport {
  std::string name;
  monitor::Verdict verdict = monitor::Verdict::kUndecided;
  std::optional<monitor::Decision> decision;        ///< The last, of a re-arming monitor.
  std::optional<monitor::Explanation> explanation;  ///< Of a monitor that was synthesized from a requirement.
  std::string leaf;                                 ///< That was at work when it decided; empty: none.
  std::uint64_t violations = 0;
  std::string standing;  ///< Why it is undecided: "pending: …" or "holds so far: …".
  std::string failure;   ///< Why it was given up; empty: it was not.
  /// Why it says nothing that it is undecided, see `monitor::vacuity`; empty: it was put to the test.
  std::string vacuity;
  std::uint64_t vetoes = 0;  ///< Requests that it refused as a gate.
  /// Those that lie within what led to the decision: what happened then nobody has seen.
  std::vector<Gap> gaps = {};
};

/// What came out of a run.
struct RunReport {
  std::string scenario;
  bool virtual_time = true;
  std::uint64_t seed = 1;
  bt::Status mission = bt::Status::kIdle;
  std::string reason;      ///< Why it failed, as the failing leaf said.
  TimePoint ended{};       ///< Run time.
  bool timed_out = false;  ///< Ended by the scenario's duration.
  bool interrupted = false;
  std::uint64_t observations = 0;
  TickTiming timing;
  std::vector<MonitorReport> monitors;
  std::vector<Gap> gaps;                 ///< Of a run that was resumed, and of the runs before it.
  std::optional<JournalCost> journal;    ///< Of a durable run.
  std::vector<ProcessReport> processes;  ///< The run itself first.
  std::vector<std::string> problems;
  /// Skills and monitors whose scripts did not end, with chart and line.
  std::vector<std::string> given_up;
  std::string error;  ///< The run could not go on; empty otherwise.
  /// Expectations of the scenario that did not hold, one sentence each; empty: all held.
  std::vector<std::string> unmet;

  [[nodiscard]] bool any_violated() const;
};

/// What a live view may look at while a run goes on. From any thread.
class RunView {
 public:
  virtual ~RunView() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// The simulated world as of now; nothing if this process has none.
  [[nodiscard]] virtual std::optional<sim::State> world() = 0;
  /// The run itself first, then its other processes that live.
  [[nodiscard]] virtual std::vector<ProcessReport> processes() = 0;
};

struct RunOptions {
  /// Reaches the parts of the run in other processes and at addresses; null: a plan that has any is refused, and
  /// services at addresses are unreachable.
  std::function<std::unique_ptr<Elsewhere>(Elsewhere::Surroundings)> elsewhere;
  /// When the first ticks begin, instead of by the mission's rate.
  std::vector<TimePoint> tick_times;
  /// Sees every observation in order.
  std::vector<Stream::Listener> listeners;
  /// Likewise those of one name. In virtual time without `listeners`, what nobody listens to is only counted.
  std::vector<std::pair<std::string, Stream::Listener>> listeners_of;
  /// Told of a decision right after the observation that caused it.
  std::function<void(const MonitorReport&)> on_decision;
  /// Told of problems as they occur, in any thread.
  std::function<void(const std::string&)> on_problem;
  /// Told, in the model's actor, of each choice as it is about to be made.
  std::function<void(const mission::Choice&)> on_choice;
  /// Called with the view before the run begins and with null after it has ended.
  std::function<void(RunView*)> on_view;
  /// Called when every part is made and nothing has happened yet.
  std::function<void(RunInside&)> on_begin;
  /// Told, in the skill's actor, after each step of a skill that runs in this process. `leaf` is its index in the plan.
  std::function<void(std::size_t leaf, const Skill&)> on_skill_step;
  /// Makes the port through which a leaf's skill calls a service; null: the usual one.
  std::function<std::unique_ptr<ServicePort>(const project::ServicePlan&, const std::string& leaf)> make_port;
  /// Opens a page for the run, when somebody asks for it through the control socket; called in its threads.
  OpenPage open_page;
  /// The run stands at time 0 until it is resumed through `RunInside::steering`.
  bool paused = false;
  /// Run seconds per wall second; 0: in virtual time as fast as the machine allows, else the scenario's factor.
  double pace = 0.0;
  /// When something that passes between the mission and a skill of this process arrives: at once if that is not later
  /// than now, not at all at kNever. Null: all at once.
  /// kDue: the end of the mission's patience with the answer; time 0: as its deadlines say.
  enum class LeafMessage : std::uint8_t { kTick, kAnswer, kHalt, kHalted, kCancel, kDue, kKill, kRestart };
  std::function<TimePoint(std::size_t leaf, LeafMessage)> arrival;
  /// Likewise when a skill of this process takes what was just published on a topic that it subscribes to: not at all
  /// at kNever.
  std::function<TimePoint(std::size_t leaf, const mission::Publication&)> topic_arrival;
  /// Likewise of the timers of a leaf's chart, which are numbered from 1 as it takes them.
  std::function<TimePoint(std::size_t leaf, std::uint64_t number)> timer_arrival;
  /// Likewise when the mission is stopped, which the run has just been told to do.
  std::function<TimePoint()> stop_arrival;
  /// Likewise when a leaf's call that is vetoed is refused.
  std::function<TimePoint(std::size_t leaf, const std::string& call)> veto_arrival;
  /// Goes on from there, instead of beginning; borrowed until `execute` returns.
  const mission::State* from = nullptr;
  /// False: somebody else sees to the scenario's timeline.
  bool inject = true;
  /// The run keeps a journal (see journal.h), and executes its parts one after the other, in real time too. Its skills
  /// and monitors run in this process.
  std::optional<DurableOptions> durable;
  /// A durable run goes on where this one was: what happened since the journal's state is executed again, unheard but
  /// for observations behind `DurableOptions::known`. Borrowed until `execute` returns.
  const Journaled* resume = nullptr;
  struct Reached {
    mission::State state;
    List open;  ///< Calls on their way, as `Journaled::open` has them.
    std::vector<Gap> gaps;
  };
  /// Told what the resumed run was when its executive died. It ends there: its journal stays as it is, and no call
  /// leaves it.
  std::function<void(Reached)> on_reached;
};

/// Runs a scenario to its end. One run at a time per object.
class Run {
 public:
  Run(const project::Plan& plan, RunOptions options);
  ~Run();

  /// Blocks until the run has ended. Errors that prevent the start (port taken, process that does not start) are in
  /// `RunReport::error`.
  [[nodiscard]] RunReport execute();
  /// Halts the mission and ends the run in order, paused or not; in virtual time without a pace it ends as it is. From
  /// any thread, not from a signal handler.
  void interrupt();
  /// After a durable run that has ended: what it said is safe elsewhere, so nobody needs to resume it, and its journal
  /// goes.
  void forget();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Compares a report with what its scenario expects; fills `unmet`.
void judge(const project::Scenario& scenario, RunReport& report);

}  // namespace sentree::runtime
