#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/flat_map.h"
#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/faults.h"
#include "sentree/mission/part_states.h"
#include "sentree/mission/parts.h"
#include "sentree/mission/reply_look.h"
#include "sentree/monitor/projection.h"
#include "sentree/scxml/enabled.h"

namespace sentree::mission {

/// Runs in virtual time as `VirtualHost` does, but each state of a part is a number, and a step of a part is looked up:
/// the machines are asked once for each state, delivery and answers of what the step asks. A run is a few numbers.
///
/// States of a part are one if their canonical forms are (`encode`), times relative to now. Numbers are those of this
/// memory; equal runs have equal numbers. Nothing is ever forgotten.
///
/// Services that nothing in the plan serves are served outside. What they answer is rarely the same twice, so answers
/// that enable the same transitions stand in for each other where nothing else in the chart looks at them; observations
/// of such an answer have what the one said that came first (`result`).
///
/// Not for plans in which a chart asks for ids (`remembers`).
class PartMemory final : private Ground {
 public:
  /// What a run does to who tries it, and what that decides. Observations and choices have numbers: the same again has
  /// the same number.
  class Outside {
   public:
    virtual ~Outside() = default;
    /// @param number  Of observations that differ in nothing but time and calls. From 0, in the order of their first
    ///                appearance here, which is that of no run.
    virtual void observed(std::uint32_t number, TimePoint now, const Message& message) = 0;
    /// @param number  Of choices made by one model in one place of one step; its alternatives are always the same.
    virtual std::uint64_t choose(std::uint32_t number, const Choice& choice) = 0;
    /// Which of several parts gets what is on its way to it first: an index of `parts`, whose members are leaves, then
    /// models, then the mission.
    virtual std::size_t order(std::span<const std::uint32_t> parts) = 0;
    virtual std::optional<Veto> judge(const Message& request) = 0;
    virtual void taken(std::size_t leaf, scxml::TransitionIndex transition) = 0;
    /// Told when a step is executed, not when it is looked up.
    virtual void met(const Met& /*what*/) {}
    virtual void problem(const std::string& what) = 0;
    virtual void refused(const Diagnostic& why) = 0;
    /// Serves a call.
    [[nodiscard]] virtual CallOutcome serve(std::size_t /*leaf*/, const Call& /*call*/) {
      return CallOutcome::failed(idl::CallErrorKind::kUnreachable, "nobody serves it");
    }
    /// Gets back what it has served, when nobody looks at it any more.
    virtual void served(const Call& /*call*/, Value&& /*result*/) {}
  };

  /// A run between two deliveries. A plain value.
  struct Run {
    TimePoint now{};
    bool begun = false;
    std::vector<std::uint32_t> parts;  ///< Numbers of states: leaves, models, the tree.
    std::vector<TimePoint> as_of;      ///< By part: the time at which it was so.
    struct Waiting {
      TimePoint when{};
      Rank rank = Rank::kMessage;
      std::uint32_t what = 0;
      std::uint32_t put_by = UINT32_MAX;  ///< A step of `Trace`; else it was put before.
    };
    std::vector<Waiting> queue;         ///< By time and rank, those of one time and rank in the order put.
    std::vector<TimePoint> not_before;  ///< Earliest delivery: of ticks by leaf, of topics by leaf, of topics by model.
    std::uint32_t standing = 0;         ///< What stands and is killed.
    std::vector<CallOutcome> served;    ///< Outside, in the order in which they are in the queue.
  };

  /// What others may notice of steps.
  struct Trace {
    struct Step {
      std::uint32_t part = 0;  ///< As in `Outside::order`.
      TimePoint when{};
      Rank rank = Rank::kMessage;
      std::uint32_t put_by = UINT32_MAX;  ///< The step that put what it takes.
      std::uint32_t puts = 0;             ///< Behind its last one in `Trace::puts`; the first is behind those before.
      std::uint32_t observed = 0;         ///< Likewise.
      bool asks_faults = false;           ///< While some stand.
    };
    struct Put {
      std::uint32_t part = 0;
      TimePoint when{};
      Rank rank = Rank::kMessage;
      bool is_topic = false;  ///< When it comes depends on what else was published.
    };
    std::vector<Step> steps;
    std::vector<Put> puts;
    std::vector<std::uint32_t> observed;  ///< Numbers.
    void clear() {
      steps.clear();
      puts.clear();
      observed.clear();
    }
  };

  /// Where faults may come from, beside the delays that the scenario of the plan begins with.
  enum class FaultsFrom : std::uint8_t { kNowhere, kTimeline, kAnywhere };

  /// @param plan  Without obstacles for `VirtualHost`; borrowed.
  /// @param times  As of `PartStates`.
  PartMemory(const project::Plan& plan, FaultsFrom faults, bt::Times times = bt::Times::kFromNow);
  /// Goes through runs by what this one has found out, and finds out nothing. Several may do so at a time, while this
  /// one does nothing. What it did is right unless it has `missed` something.
  [[nodiscard]] std::unique_ptr<PartMemory> reader() const {
    return std::unique_ptr<PartMemory>(new PartMemory(tables_));
  }
  [[nodiscard]] bool missed() const { return missed_; }
  void forget_missed() { missed_ = false; }

  /// Whether the plan is one for it.
  [[nodiscard]] static bool remembers(const project::Plan& plan);

  // As those of `VirtualHost`.
  [[nodiscard]] Run begin();
  [[nodiscard]] static TimePoint next(const Run& run) { return run.queue.empty() ? kNever : run.queue.front().when; }
  /// What is due first.
  [[nodiscard]] const Delivery& front(const Run& run) const { return tables_->deliveries[run.queue.front().what].what; }
  void step(Run& run, Outside& outside);
  Result<void> inject(Run& run, const project::Intervention& what, Outside& outside,
                      std::optional<std::uint64_t> number = std::nullopt);
  /// While it is told of an observation, or of a transition: the result that has come from outside, which is that of an
  /// observation that `is_answer`. Null: none has. It may be taken, and must be put back.
  [[nodiscard]] Value* result() { return result_ ? &*result_ : nullptr; }
  [[nodiscard]] bool is_answer(std::uint32_t observation) const { return tables_->messages[observation].is_answer; }
  [[nodiscard]] bt::Status root(const Run& run) const { return tables_->states.tree(run.parts.back()).root(); }
  [[nodiscard]] bool ended(const Run& run) const { return tables_->states[run.parts.back()].ended; }
  [[nodiscard]] bool over(const Run& run) const { return tables_->states[run.parts.back()].over; }
  [[nodiscard]] TimePoint planned(const Run& run) const {
    return run.as_of.back() + tables_->states[run.parts.back()].until_planned;
  }
  [[nodiscard]] const project::Plan& plan() const { return tables_->parts.plan(); }
  /// From now on steps are appended to it; null: to none.
  void trace(Trace* trace) { trace_ = trace; }

  [[nodiscard]] const Faults& faults(const Run& run) const { return tables_->standing[run.standing]->faults; }
  [[nodiscard]] bool is_killed(const Run& run, std::size_t leaf) const {
    return will_be_killed(
        leaf, tables_->states[run.parts[leaf]].killed, run.queue,
        [this](const Run::Waiting& waiting) -> const Delivery& { return tables_->deliveries[waiting.what].what; });
  }
  [[nodiscard]] bool is_down(const Run& run, const std::string& service) const {
    return tables_->standing[run.standing]->down.contains(service);
  }

  /// The state of a model as it was found first: its times mean nothing.
  [[nodiscard]] const ModelState& model(const Run& run, std::size_t index) const {
    return tables_->states.model(run.parts[tables_->parts.skills() + index]);
  }

  /// Every state of a part that was found, by its index: leaves, then models, then the tree. `wake` is how long its
  /// chart waits for its next timer.
  void each_state(const std::function<void(std::size_t part, PartView, std::optional<Duration> wake)>& visit) const {
    tables_->states.each(visit);
  }

  /// Brings every part to now, and leaves out what can have no effect any more.
  void settle(Run& run);
  /// A settled run as numbers, with times relative to now: equal for runs that behave alike from here on. Appends.
  void pack(const Run& run, std::vector<std::uint32_t>& out);
  void unpack(std::span<const std::uint32_t> packed, TimePoint now, Run& run) const;
  /// As `mission::has_effect`.
  [[nodiscard]] bool has_effect(const Run& run, const Run::Waiting& waiting) const;
  /// Durations have numbers too.
  [[nodiscard]] std::uint32_t number_of(Duration duration);

  /// A part's state that has no canonical form; no run is right after it.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return tables_->states.error(); }
  [[nodiscard]] std::uint64_t looked_up() const { return tables_->looked_up; }
  [[nodiscard]] std::uint64_t executed() const { return tables_->executed; }
  /// Bytes, about.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct OnItsWay {
    Delivery what;
    std::uint32_t part = 0;
    Numbered tick;
    Numbered call;
    std::optional<Duration> timer;  // how far what a timer was set for is from when it rings
    bool is_answer_due = false;
    bool served = false;  // the outcome of a call that is served outside, which is `Run::served.front()`
  };
  // An outcome from outside that came to a state of a skill.
  struct StandIn {
    Value result;
    std::optional<std::vector<scxml::TransitionIndex>> enabled;  // any result that enables them; nothing: that one
    std::uint32_t delivery = 0;
  };
  struct Known {
    Message message;
    bool is_answer = false;  // it tells the result of a call
    bool told = false;       // `what` and `takers` are known
    std::vector<std::pair<Subscriptions::Taker, std::uint32_t>> takers;
    std::uint32_t topic = kNone;
  };
  struct Asked {
    std::string model;
    const char* function = "";
    std::string name;
    std::string place;
    std::uint64_t count = 0;
    std::vector<Value> alternatives;
    std::vector<double> probabilities;  // empty: nobody says
  };
  struct Stands {
    Faults faults;
    std::set<std::string> down;
  };

  // What a step does, in order.
  struct Op {
    enum class Kind : std::uint8_t { kObserve, kPut, kTell, kCall, kServe, kTaken, kProblem, kRefused };
    Kind kind = Kind::kObserve;
    Rank rank = Rank::kMessage;
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    std::int64_t c = 0;
  };
  // What it asks then.
  struct Query {
    enum class Kind : std::uint8_t { kNothing, kTick, kRun, kForced, kDelay, kFalsify, kFails, kJudge, kChoose };
    Kind kind = Kind::kNothing;
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    const idl::Method* method = nullptr;
  };
  // A step up to where it asks something, or to its end.
  struct Node {
    std::vector<Op> ops;
    Query query;
    std::vector<std::pair<std::int64_t, std::uint32_t>> next;  // by answer
    std::uint32_t result = kNone;                              // at the end: the part's state
  };

  // ---- the ground of a step that is executed
  TimePoint now() const override { return frame_; }
  void publish(Message message) override;
  void set_tick(std::uint64_t) override {}
  void put(TimePoint when, Rank rank, Delivery&& what) override;
  void tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) override;
  void call(std::size_t leaf, const Shared<Call>& call) override;
  void serve(std::size_t model, ServeCall what) override;
  void taken(std::size_t leaf, scxml::TransitionIndex transition) override;
  void met(const Met& what) override {
    if (outside_ != nullptr) outside_->met(what);
  }
  void problem(const std::string& what) override;
  void refused(const Diagnostic& why) override;
  std::uint64_t next_call() override { return 1; }
  std::uint64_t tick_number(std::size_t leaf, std::uint64_t next) override;
  std::uint64_t run_number(std::size_t leaf, std::uint64_t next) override;
  std::optional<bt::Status> forced(std::string_view leaf) override;
  Duration delay_of(std::string_view message) override;
  void falsify(std::string_view call, const idl::Method& method, Value& result) override;
  bool fails(Failing how, std::string_view call) override;
  std::optional<Veto> judge(Message& request) override;
  std::optional<std::uint64_t> choose(const Choice& choice) override;

  [[nodiscard]] bool is_told() const { return replayed_ < script_.size(); }
  void add(Op op);
  std::int64_t answer(Query query);
  Result<void> inject(const project::Intervention& what, std::optional<std::uint64_t> number);
  void take(std::uint32_t part, std::uint32_t what);
  void execute(std::uint32_t state, std::uint32_t what, std::uint32_t node);
  void perform(const Op& op);
  [[nodiscard]] std::uint32_t arrived(std::uint32_t what);
  [[nodiscard]] std::int64_t ask(const Query& query);
  [[nodiscard]] std::uint64_t unused_tick(std::size_t leaf) const;
  [[nodiscard]] std::uint64_t unused_run(std::size_t leaf) const;
  void insert(TimePoint when, Rank rank, std::uint32_t what, bool is_topic = false);
  void deliver_topic(std::uint32_t message);
  template <class Change>
  auto change_standing(const Change& change);

  std::uint32_t intern(const Delivery& what, TimePoint when);
  std::uint32_t intern(Message&& message);
  std::uint32_t intern_text(std::string_view text);
  std::uint32_t intern_value(const Value& value);
  std::uint32_t intern_standing(Stands&& stands);
  [[nodiscard]] std::uint32_t aged(std::uint32_t state, Duration by);
  [[nodiscard]] std::uint32_t part_of(const Delivery& what) const;
  std::uint32_t new_node();

  // What has a number, and which; and what steps do.
  struct Tables {
    Tables(const project::Plan& plan, FaultsFrom from, bt::Times times);

    Parts parts;
    bool faults;
    bool gates;
    std::uint64_t looked_up = 0;
    std::uint64_t executed = 0;

    PartStates states;
    std::vector<OnItsWay> deliveries;
    std::unordered_map<std::string, std::uint32_t> number_of_delivery;
    std::vector<Known> messages;
    std::unordered_map<std::string, std::uint32_t> number_of_message;
    std::vector<std::string> texts;
    std::unordered_map<std::string, std::uint32_t> number_of_text;
    std::vector<Value> values;
    std::unordered_map<std::string, std::uint32_t> number_of_value;
    std::vector<std::unique_ptr<const Stands>> standing;
    std::unordered_map<std::string, std::uint32_t> number_of_standing;
    std::vector<Duration> durations;
    std::unordered_map<std::int64_t, std::uint32_t> number_of_duration;
    std::vector<Asked> choices;
    std::vector<Veto> vetoes;  // an answer says which, from 1
    std::vector<Diagnostic> refusals;
    std::vector<Node> nodes;
    FlatMap<std::uint64_t, WordHash> steps;                // nodes by state and delivery
    FlatMap<std::uint64_t, WordHash> number_of_stand_ins;  // likewise
    std::deque<std::vector<StandIn>> stand_ins;
    std::vector<ReplyLook> looks;                               // by leaf
    std::unordered_map<std::string, std::uint32_t> injections;  // nodes by what is injected into what stands
  };

  /// Reads the tables of another one.
  explicit PartMemory(std::shared_ptr<Tables> tables) : tables_(std::move(tables)), reads_(true) {}
  /// What is not in the tables is not found out.
  std::uint32_t miss() {
    missed_ = true;
    return 0;
  }

  std::shared_ptr<Tables> tables_;
  bool reads_ = false;
  bool missed_ = false;

  // Of the step that is taken.
  Run* run_ = nullptr;
  Outside* outside_ = nullptr;
  Trace* trace_ = nullptr;
  bool steps_one_ = false;  // and does not inject
  TimePoint frame_{};
  std::uint32_t node_ = 0;
  std::vector<std::int64_t> script_;  // answers that are known
  std::size_t replayed_ = 0;
  std::vector<std::uint32_t> first_;
  std::vector<std::size_t> due_;
  std::optional<Value> result_;
  const Call* answered_ = nullptr;  // with `result_`
};

}  // namespace sentree::mission
