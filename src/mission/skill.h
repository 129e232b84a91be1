#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"
#include "sentree/idl/schema.h"
#include "sentree/mission/delivery.h"
#include "sentree/mission/faults.h"
#include "sentree/mission/observation_name.h"
#include "sentree/mission/step_memory.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/remote_step.h"
#include "sentree/scxml/session.h"

namespace sentree::mission {

/// Goals of one skill that have not ended; of more, the oldest are left to their chart.
inline constexpr std::size_t kGoalsMax = 16;
/// Calls of one chart to one service that wait for a gate's decision; one more fails at once as unreachable.
inline constexpr std::size_t kGatedCallsMax = 256;

/// Where a skill is between two deliveries.
enum class SkillPhase : std::uint8_t {
  kIdle,     ///< No run, nothing to tell.
  kRunning,  ///< Its chart lives, and no tick waits for an answer.
  kOwing,    ///< Its chart lives, and a condition's tick waits for the end of the run.
  kHalting,  ///< `halt` was delivered, and the run has not ended.
  kEnded,    ///< The run has ended, and its chart with it; the next tick is told how.
  kResting,  ///< No run, but its chart lives on (`SkillModel::protocol`).
  kReady,    ///< The run has ended and its chart lives on; the next tick is told how it ended.
  kKilled,   ///< As if its process were gone.
};
[[nodiscard]] std::string_view to_string(SkillPhase phase);

/// A step that a skill may take from one phase to another, and by what.
struct SkillEdge {
  SkillPhase from;
  std::string_view by;  ///< "tick", "halt", "cancel", "kill", "restart", "timer", "outcome", "topic".
  SkillPhase to;
  friend bool operator==(const SkillEdge&, const SkillEdge&) = default;
};
/// All of them. A step that is not in the table is a bug, and stops the program.
[[nodiscard]] std::span<const SkillEdge> skill_edges();
/// What a delivery counts as in the table: nothing for those that leave the chart alone.
[[nodiscard]] std::string_view kind_of(const SkillDelivery& delivery);

/// What one leaf's skill is made of. Never changes.
struct SkillModel {
  std::string name;  ///< The leaf's name in messages.
  bool condition = false;
  Duration halt_deadline = std::chrono::seconds(2);  ///< Run time.
  Duration call_deadline = std::chrono::seconds(2);  ///< Likewise: what a fault makes late comes when it is over.
  std::uint64_t seed = 1;
  scxml::Chart chart;
  const std::map<std::string, project::ServicePlan>* services = nullptr;  ///< Borrowed.
  Map constants = {};  ///< Initial values of <data>; ports come over them.
  /// The chart lives on between runs, is ticked and answers as this says. Nothing: each run is one of the chart.
  std::optional<project::SkillProtocol> protocol = {};
  /// Topics whose latest publication each run begins with.
  std::vector<std::string> latest_topics = {};
};

/// Of a leaf whose skill has a chart. `plan` is borrowed.
[[nodiscard]] SkillModel skill_model(const project::Plan& plan, std::size_t leaf);

/// What a skill remembers between deliveries. A plain value: a copy goes on alike.
struct SkillState {
  SkillPhase phase = SkillPhase::kIdle;
  std::uint64_t run = 0;       ///< The chart's present or last one, from 1.
  std::uint64_t tick = 0;      ///< The latest.
  std::uint64_t answered = 0;  ///< The latest that was answered.
  bool asked = false;          ///< With a protocol: the chart has taken a tick and not answered it.
  std::optional<TimePoint> halt_due;
  bt::Status ended = bt::Status::kIdle;  ///< kEnded, kReady: the run's status.
  Map outputs;                           ///< Likewise.
  std::string trouble;                   ///< What an error event said last, if no reply has come since; empty: none.
  TimePoint wake = kNever;               ///< When its timer rings.
  /// Earliest time at which a tick or a halt may reach it: a delayed one holds back the later ones. Written by who
  /// sends them.
  TimePoint not_before{};
  TimePoint topics_not_before{};  ///< The same for what is published; written by who delivers it.

  /// The transition that its chart took last, in any run, and the event that it got last.
  struct Latest {
    std::optional<scxml::TransitionIndex> transition;
    std::string event;
    std::uint64_t transitions = 0;  ///< Taken so far.
    friend bool operator==(const Latest&, const Latest&) = default;
  };
  Latest latest;

  /// Calls to one service that are not yet sent.
  struct Line {
    std::string service;
    std::vector<Shared<Call>> waiting;  ///< For the gates, in the order made.
    TimePoint not_before{};             ///< A delayed call holds back the later ones.
    friend bool operator==(const Line&, const Line&) = default;
  };
  std::vector<Line> lines;

  /// A goal that the run sent to an action of ROS and that has not ended, as far as it has been told.
  struct Goal {
    std::string service;
    std::string id;          ///< Empty: it has not been accepted yet.
    bool abandoned = false;  ///< Its run was halted meanwhile: it is cancelled once it is accepted.
    friend bool operator==(const Goal&, const Goal&) = default;
  };
  std::vector<Goal> goals;
  std::vector<Shared<Publication>> heard;  ///< The latest of each of the model's `latest_topics`; sorted by topic.
  scxml::Session session;

  /// Its chart lives.
  [[nodiscard]] bool running() const {
    return phase != SkillPhase::kIdle && phase != SkillPhase::kEnded && phase != SkillPhase::kKilled;
  }
  /// Whether the outcome of a call of that run would reach the chart.
  [[nodiscard]] bool is_current(std::uint64_t number) const { return running() && number == run; }
  friend bool operator==(const SkillState&, const SkillState&) = default;
};

/// What a skill does to the world around it, in order.
class SkillHost {
 public:
  virtual ~SkillHost() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  virtual void publish(Message message) = 0;
  /// Likewise; the caller keeps what it says.
  virtual void show(Message& message) { publish(message); }
  /// Whether anybody, a gate too, would see an observation of that name. One that nobody would see is not published,
  /// nor requested, but passed.
  [[nodiscard]] virtual bool is_heard(ObservationName& /*name*/) { return true; }
  /// Has its place in the order, and that is all.
  virtual void pass() {}
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// The number of its next run: at least 1, and that of no run whose calls are on their way.
  /// @param next  Where they are counted.
  [[nodiscard]] virtual std::uint64_t run_number(std::uint64_t next) { return next; }
  /// Publishes a request unless a gate refuses it. Nothing: `Admitted` follows.
  [[nodiscard]] virtual std::optional<Admission> request(Message message, const Shared<Call>& call) = 0;
  /// Makes the call; `Outcome` follows.
  virtual void send(const Shared<Call>& call, const idl::Method& method) = 0;
  /// Something for the skill itself: as soon as possible, or at a time.
  virtual void deliver(SkillDelivery what) = 0;
  virtual void deliver_at(TimePoint when, Rank rank, SkillDelivery what) = 0;
  /// The faults that stand: how long a message "SERVICE.METHOD" or "SERVICE.METHOD.reply" is held back, and what a
  /// reply says instead.
  [[nodiscard]] virtual Duration delay_of(std::string_view message) = 0;
  virtual void falsify(std::string_view call, const idl::Method& method, Value& result) = 0;
  /// Whether a fault makes calls of "SERVICE.METHOD" unreachable, or late.
  [[nodiscard]] virtual bool fails(Failing /*how*/, std::string_view /*call*/) { return false; }
  /// The answer to tick number `tick`.
  virtual void answer(std::uint64_t tick, bt::Status status, Map outputs) = 0;
  /// The halt is over; no run is left.
  virtual void halted() = 0;
  virtual void log(const scxml::LogLine& line) = 0;
  /// Its chart takes a transition.
  virtual void taken(scxml::TransitionIndex /*transition*/) {}
  /// Its chart enters a state. With a memory of steps, told when a step is executed, not when it is looked up.
  virtual void entered(scxml::StateIndex /*state*/) {}
  /// Something a person should know; the run goes on.
  virtual void problem(const std::string& what) = 0;
};

/// Executes the steps of one skill's chart somewhere else.
class ChartElsewhere {
 public:
  enum class Away : std::uint8_t {
    kHere,  ///< The skill is to do it itself.
    kLost,  ///< Nobody does: the run of the chart is over.
  };
  virtual ~ChartElsewhere() = default;
  /// @param session  On which the step is done; borrowed for the call.
  /// @returns what `scxml::execute_and_tell` told.
  [[nodiscard]] virtual tl::expected<Value, Away> execute(const scxml::Session& session,
                                                          const scxml::StepOrder& order) = 0;
  /// What was told has been done to the session, which is now this.
  virtual void took(const scxml::Session& session) = 0;
};

/// Turns ticks and halts into runs of a chart (the design's "A leaf invokes its skill"), or speaks a chart's own
/// protocol with it, and makes the chart's calls: checks them against the IDL, asks the gates, publishes request and
/// outcome, keeps their order. The one seam that every call of every skill passes through. A call of a one-way method
/// has no outcome but failure.
///
/// What is published on a topic that it subscribes to is the event SERVICE.METHOD, whose data are the arguments. It
/// reaches a chart that lives, and begins one with a protocol, whose ports then come with the first tick only. A run
/// begins with what was published last on the model's `latest_topics`, before its first tick.
///
/// Owns no thread and no clock. Deterministic: equal states, deliveries and answers of the host give equal effects.
class SkillMachine {
 public:
  /// @param watch  Sees the chart's scripts; borrowed; null: nobody looks on.
  explicit SkillMachine(SkillModel model, scxml::ExecutionWatch* watch = nullptr);
  SkillMachine(const SkillMachine&) = delete;
  SkillMachine& operator=(const SkillMachine&) = delete;

  [[nodiscard]] const SkillModel& model() const { return model_; }
  /// Steps of its chart are looked up where they are known.
  void remember_steps() {
    if (!model_.protocol) memory_.emplace(model_.chart);
  }
  /// From now on its chart's steps are executed there; borrowed. What cannot be there fails the run of the chart.
  void execute_elsewhere(ChartElsewhere* elsewhere) { elsewhere_ = elsewhere; }
  /// Takes one delivery. True: the skill has taken a step that views want to know of.
  bool step(SkillState& state, SkillDelivery&& delivery, SkillHost& host);
  /// What a skill does that can do nothing any more, instead of `step`: its ticks fail and its halts are over.
  static void refuse(SkillState& state, const SkillDelivery& delivery, const std::string& why, SkillHost& host);
  /// Answers what is owed, so that nobody waits for a skill that can do nothing any more.
  static void give_up(SkillState& state, const std::string& why, SkillHost& host);

 private:
  class Step;

  // What a chart with a protocol has said in a step: a status, or that its halt is over.
  struct Said {
    std::optional<bt::Status> status;
    Map outputs;
  };
  // A method that the chart has called.
  struct Called {
    std::string service;
    const idl::Method* method;
    std::string name;  // SERVICE.METHOD
    ObservationName request;
    ObservationName reply;
  };
  Called& called(const Call& call);
  void hear(const scxml::Event& event);
  void got(const std::string& event, const std::string& message);
  void took(scxml::TransitionIndex taken);

  SkillModel model_;
  std::vector<std::optional<bt::Status>> meaning_of_state_;  // by state; empty without a protocol
  std::optional<scxml::StateIndex> halted_state_;
  scxml::Host host_;
  SkillState* stepped_ = nullptr;  // whose chart executes
  SkillHost* surroundings_ = nullptr;
  scxml::Effects effects_;
  std::optional<StepMemory> memory_;
  ChartElsewhere* elsewhere_ = nullptr;
  std::deque<Called> called_;
  std::vector<Said> said_;
  std::vector<std::string> unclear_;  // answers without meaning
  struct Observer final : scxml::Observer {
    explicit Observer(SkillMachine& of) : machine(of) {}
    void event(const scxml::Chart& chart, std::string_view session, const scxml::Event& event) override;
    void transition(const scxml::Chart& chart, std::string_view session, scxml::TransitionIndex taken) override;
    void entered(const scxml::Chart& chart, std::string_view session, scxml::StateIndex state) override;
    void unhandled(const scxml::Chart& chart, std::string_view session, const Diagnostic& why) override;
    SkillMachine& machine;
  };
  Observer observer_{*this};
};

/// Whether a call can be made at all: its service, method and arguments are in the IDL. What is sent elsewhere is not
/// looked at. Errors: run.unknown-service, those of `idl::find_method` and of `idl::conform_arguments`.
[[nodiscard]] Result<void> check_call(const scxml::OutgoingSend& send,
                                      const std::map<std::string, project::ServicePlan>& services);

/// Whether it is an action of ROS 2: its goals are sent and cancelled, and end by the topic `result`.
[[nodiscard]] bool is_action(const idl::Service& service);
inline constexpr std::string_view kSendGoal = "send_goal";

/// Everything that a skill remembers of its chart, as data, for snapshots. Error: scxml.no-value-form.
[[nodiscard]] Result<Value> save(const SkillModel& model, const SkillState& state);

}  // namespace sentree::mission
