#include "sentree/runtime/run.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <set>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/runtime/decision_record.h"
#include "sentree/runtime/durable.h"
#include "sentree/runtime/elsewhere.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/model_actor.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/run_steering.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/stream_publisher.h"
#include "sentree/runtime/tap.h"
#include "sentree/runtime/telemetry.h"
#include "sentree/runtime/topics.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/sim/services.h"
#include "sentree/sim/topics.h"

namespace sentree::runtime {

namespace {

// What a call of somebody who steers the run gets.
constexpr std::chrono::seconds kCallPatience{1};
// How long a durable run waits for observers elsewhere to say how far they are: at a state that can be left out, and
// where there is no other one.
constexpr std::chrono::milliseconds kBetweenTicks{500};
constexpr std::chrono::seconds kAfterResumption{30};
// Why parts elsewhere are refused by a run that was given no way to them (`RunOptions::elsewhere`).
constexpr const char* kOnlyHere = ", and everything runs in one process here";

// A service at an address, in a run that reaches none.
class UnreachablePort final : public ServicePort {
 public:
  explicit UnreachablePort(std::string name) : name_(std::move(name)) {}
  void call(const idl::Method&, Value, Done done) override {
    done({.ok = false,
          .result = {},
          .kind = "unreachable",
          .message = fmt::format("{} is elsewhere{}", name_, kOnlyHere)});
  }

 private:
  const std::string name_;
};

}  // namespace

class Run::Impl final : public RunView, private RunInside {
 public:
  Impl(const project::Plan& plan, RunOptions options)
      : plan_(plan),
        scenario_(plan.scenario),
        options_(std::move(options)),
        scheduler_(scenario_.virtual_time || options_.durable ? make_virtual_scheduler()
                                                              : make_real_scheduler(scenario_.factor)),
        stream_(*scheduler_),
        watchdog_(scenario_.project.deadlines.script),
        monitors_(plan, *scheduler_, stream_, watchdog_,
                  {.decided = [this](const MonitorReport& report) { on_decision(report); },
                   .given_up = [this](const std::string& why) { given_up(why); },
                   .stepped = [this](std::size_t index) { steering_.monitor_stepped(index); }}),
        publisher_(stream_, monitors_, *scheduler_, stretched(scenario_.project.deadlines.call)),
        director_(scheduler_->add_actor("director")),
        steering_({.plan = &plan,
                   .scheduler = scheduler_.get(),
                   .director = director_,
                   .publish = [this](Message message) { stream_.publish(std::move(message)); },
                   .tick = [this] { return stream_.tick(); },
                   .call = [this](const std::string& service, const std::string& method,
                                  const Value& args) { return call_service(service, method, args); },
                   .stop = [this] { mission_->stop(); },
                   .kill_process =
                       [this](const std::string& process) {
                         if (elsewhere_) elsewhere_->kill(process);
                       },
                   .restart_process =
                       [this](const std::string& process) { return elsewhere_ && elsewhere_->restart(process); },
                   .skill = [this](std::size_t leaf) { return skills_[leaf]; },
                   .monitors = [this]() -> const Monitors& { return monitors_; },
                   .problem = [this](const std::string& what) { problem(what); },
                   .keep =
                       [this](const project::Intervention& what, const std::string& source) {
                         if (durability_) durability_->intervention(what, source);
                       },
                   .observer = stream_.actor()}) {
    if (options_.durable) {
      if (options_.resume != nullptr) options_.durable->resumed = options_.resume->file;
      durability_ = std::make_unique<Durability>(
          plan_, *scheduler_, *options_.durable, [this](std::size_t leaf) { return skills_[leaf]; },
          options_.resume != nullptr ? options_.resume->gaps : std::vector<Gap>());
      scheduler_->keep(durability_.get());
    }
    if (!scenario_.orders.empty()) {
      scheduler_->on_order([this](std::uint64_t number, std::span<const mission::Delivery* const> due) {
        const auto first = mission::scripted(plan_, number, due);
        if (!first) problem(fmt::format("order {} of the scenario: nothing is due for the part that it names", number));
        return first.value_or(0);
      });
    }
    scheduler_->set_pace(
        {.paused = options_.paused, .factor = scenario_.virtual_time ? options_.pace : scenario_.factor});
    services_ = plan.services;
    const bool simulates =
        std::any_of(services_.begin(), services_.end(), [](const auto& service) { return service.second.at == "sim"; });
    if (plan.world && (simulates || services_.empty()))
      sim_ = std::make_unique<SimHost>(plan.world, scenario_.seed, *scheduler_);
  }

  ~Impl() override {
    end_callers();
    if (sim_) sim_->stop_keeping_up();
  }

  RunReport execute() {
    RunReport report;
    report.scenario = scenario_.name;
    report.virtual_time = scenario_.virtual_time;
    report.seed = scenario_.seed;
    if (!scenario_.project.executed_by.empty()) {
      report.error = fmt::format("the mission is executed by {}, not here; sentree watch and sentree studio show it",
                                 scenario_.project.executed_by);
      return report;
    }
    if (auto error = prepare_durability()) {
      report.error = *error;
      return report;
    }
    if (auto error = prepare()) {
      report.error = *error;
      return report;
    }
    report.processes = processes();

    stream_.subscribe([this](const Message& message) { monitors_.observe(message); },
                      [this](const std::string& name) { return monitors_.wants(name); });
    stream_.on_passed([this](TimePoint now) { monitors_.pass(now); });
    for (const auto& observer : observers())
      stream_.subscribe([observer = observer.get()](const Message& message) { observer->observe(message); });
    for (const auto& listener : options_.listeners) {
      stream_.subscribe([this, &listener](const Message& message) {
        if (is_heard(message.sequence)) listener(message);
      });
    }
    for (const auto& [name, listener] : options_.listeners_of) {
      stream_.subscribe(
          [this, &name, &listener](const Message& message) {
            if (message.name == name && is_heard(message.sequence)) listener(message);
          },
          [&name](const std::string& of) { return of == name; });
    }
    if (serves_control()) stream_.subscribe([this](const Message& message) { tap_.observe(message); });
    stream_.subscribe([this](const Message& message) { steering_.observed(message); },
                      [](const std::string&) { return false; });
    stream_.hear_all_while([this] { return steering_.faults().any(); });
    if (!topics_.empty()) stream_.subscribe([this](const Message& message) { deliver(message); });
    if (options_.from != nullptr)
      go_on_from(*options_.from);
    else
      monitors_.start();
    if (options_.on_view) options_.on_view(this);
    if (serves_control()) serve_control();
    // A run whose time stands still for a moment is not the robot's.
    if (durability_ && !scenario_.virtual_time) scheduler_->on_behind([this](Duration behind) { fell_behind(behind); });
    if (!scheduler_->is_virtual() && sim_) {
      // What calls see later than they should makes a replay differ: that comes last.
      constexpr std::chrono::milliseconds kWork{250};
      sim_->keep_up({kWork, stretched(kWork)}, [this](Duration behind) { problem(falls_behind(behind)); });
    }
    scheduler_->at(director_, TimePoint(scenario_.duration), mission::Rank::kInjection, [this] {
      timed_out_ = true;
      mission_->stop();
    });
    if (options_.inject) schedule_timeline();
    schedule_telemetry();
    if (options_.from == nullptr) {
      for (const auto& model : models_) model->start();
      mission_->start();
    }
    if (options_.resume != nullptr) {
      if (auto again = execute_again(*options_.resume); !again) {
        report.error = to_string(again.error());
        end_callers();
        return report;
      }
    } else {
      if (options_.on_begin) options_.on_begin(*this);
      if (durability_) keep_journal(TimePoint{});
    }
    ready_ = mission_.get();
    if (interrupted_) steering_.ask_to_stop("interrupt");  // while the parts were started
    // In virtual time nothing goes on without a thread, so a script that never ends has ended the run.
    const auto hung = scheduler_->is_virtual() ? monitors_.hung() : std::nullopt;
    const auto unheard = elsewhere_ ? elsewhere_->subscribe(services_) : std::nullopt;
    const auto error = hung ? hung : unheard ? unheard : scheduler_->run();
    steering_.finish();
    if (options_.on_view) options_.on_view(nullptr);
    // Skills elsewhere first: they still publish while they halt. Monitors and observers see what they say.
    if (elsewhere_) elsewhere_->end_speaking();
    // Ended as it is, with no tick in which the mission could have said so.
    if (scheduler_->is_virtual() && (left_behind_ || (interrupted_ && ended_ == TimePoint{})))
      ended_ = scheduler_->now();
    monitors_.finish(ended_);
    for (const auto& observer : observers()) observer->finish(ended_);
    take_decisions();  // those that no actor took any more
    stream_.flush();
    if (elsewhere_) elsewhere_->end();
    end_callers();

    report.error = error.value_or("");
    report.mission = mission_->state().root;
    report.reason = mission_->state().reason;
    report.ended = ended_;
    report.timed_out = timed_out_;
    report.interrupted = interrupted_;
    report.observations = stream_.published();
    report.timing = mission_->timing();
    report.monitors = monitors_.reports();
    if (durability_ && !options_.on_reached) {
      is_over_ = true;
      report.journal = durability_->journal().cost();
      report.gaps = durability_->gaps();
    }
    {
      const std::lock_guard lock(problems_mutex_);
      report.monitors.insert(report.monitors.end(), remote_reports_.begin(), remote_reports_.end());
      report.problems = problems_;
      report.given_up = given_up_;
    }
    if (stream_.lost() > 0) {
      report.problems.push_back(std::to_string(stream_.lost()) +
                                " observations were lost: monitors and recorder did not keep up");
    }
    report.problems.insert(report.problems.end(), mission_->problems().begin(), mission_->problems().end());
    judge(scenario_, report);
    return report;
  }

  void forget() {
    if (!is_over_) return;
    if (is_again()) end_journal(*options_.resume, recording_name());  // it had ended
    durability_->journal().remove();
  }

  /// A thread still uses parts of this.
  [[nodiscard]] bool left_behind() const { return left_behind_; }

  void interrupt() {
    interrupted_ = true;
    const Pace pace = scheduler_->pace();
    if (scheduler_->is_virtual() && !pace.paused && pace.factor <= 0) {
      scheduler_->stop();
    } else if (ready_.load() != nullptr) {
      steering_.ask_to_stop("interrupt");
    }
  }

  TimePoint now() const override { return scheduler_->now(); }
  std::vector<ProcessReport> processes() override {
    std::vector<ProcessReport> all{{"run", static_cast<std::int64_t>(getpid())}};
    if (!elsewhere_) return all;
    const auto others = elsewhere_->processes();
    all.insert(all.end(), others.begin(), others.end());
    return all;
  }
  std::optional<sim::State> world() override {
    return sim_ ? std::optional<sim::State>(sim_->snapshot()) : std::nullopt;
  }

 private:
  Scheduler& scheduler() override { return *scheduler_; }
  ActorId director() const override { return director_; }
  ActorId observer() const override { return stream_.actor(); }
  void publish(Message message) override { stream_.publish(std::move(message)); }
  std::uint64_t published() const override { return stream_.published(); }
  SimHost* sim() override {
    const bool here =
        std::any_of(services_.begin(), services_.end(), [](const auto& s) { return s.second.at == "sim"; });
    return here ? sim_.get() : nullptr;
  }
  const Mission& mission() const override { return *mission_; }
  const Monitors& monitors() const override { return monitors_; }
  SkillActor* skill(std::size_t leaf) override { return skills_[leaf]; }
  Steering& steering() override { return steering_; }
  void inject(const project::Injection& injection) override { steering_.inject(injection); }
  void put_faults_on_calls(bool on) override { steering_.faults().spare_calls(!on); }
  mission::State capture() override {
    SENTREE_ASSERT(scheduler_->is_virtual());
    mission::State state;
    scheduler_->save(state);
    stream_.save(state);
    steering_.save(state);
    state.tree = mission_->state();
    for (SkillActor* skill : skills_) state.skills.push_back(skill->state());
    for (const auto& model : models_) state.models.push_back(model->state());
    if (sim_) state.world = sim_->snapshot();
    state.monitors = monitors_.memory();
    return state;
  }
  void go_on_from(const mission::State& state) {
    scheduler_->load(state, [this](const mission::Delivery& what) {
      if (what.leaf == mission::Delivery::kTree) return mission_->actor();
      const bool to_model = std::holds_alternative<mission::ModelDelivery>(what.what);
      return to_model ? models_[what.leaf]->actor() : skills_[what.leaf]->actor();
    });
    stream_.load(state);
    steering_.load(state);
    mission_->state() = state.tree;
    for (std::size_t leaf = 0; leaf < skills_.size(); ++leaf) skills_[leaf]->state() = state.skills[leaf];
    for (std::size_t i = 0; i < models_.size(); ++i) models_[i]->state() = state.models[i];
    if (sim_ && state.world) sim_->restore(*state.world);
    monitors_.recall(state.monitors);
  }
  void end() override {
    ended_ = scheduler_->now();
    scheduler_->stop();
  }

  std::optional<std::string> prepare_durability() {
    if (!durability_) return std::nullopt;
    if (const std::string obstacle = Durability::obstacle(plan_); !obstacle.empty())
      return "the run cannot be durable: " + obstacle;
    if (options_.resume == nullptr) return std::nullopt;
    auto state = mission::restore(plan_, options_.resume->state);
    if (!state) return fmt::format("{}: {}", options_.resume->file.string(), state.error().message);
    resumed_from_ = std::move(*state);
    options_.from = &*resumed_from_;
    return std::nullopt;
  }

  // What happened since the journal's state is going to happen again.
  Result<void> execute_again(const Journaled& journaled) {
    Durability::Again again;
    if (auto begun = durability_->begin_again(journaled, again); !begun) return begun;
    const auto at = [&](const Place& where, Scheduler::Task task) {
      again.emplace_back(where, [this, when = where.when, task = std::move(task)] {
        scheduler_->at(director_, when, mission::Rank::kInjection, task);
      });
    };
    for (const auto& [where, saved] : journaled.interventions) {
      const Value* what = saved.find("what");
      const Value* source = saved.find("source");
      if (what == nullptr || source == nullptr)
        return fail("journal.damaged", journaled.file.string() + ": an intervention is none");
      auto intervention = mission::restore_intervention(*what);
      if (!intervention) return tl::unexpected(intervention.error());
      at(where, [this, intervention = std::move(*intervention), by = std::string(source->text())] {
        steering_.again(intervention, by);
      });
    }
    for (const auto& [where, saved] : journaled.inputs) {
      if (auto message = Durability::observed(saved)) at(where, [this, message] { stream_.publish(*message); });
      if (auto decided = Durability::decided(saved))
        at(where, [this, decided] { take_decision(decided->first, decided->second); });
    }
    std::stable_sort(again.begin(), again.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [where, schedule] : again) schedule();
    scheduler_->catch_up(journaled.reached, [this, &journaled] { resumed(journaled); });
    return {};
  }

  // It is where it was when its executive died: the time since then passes at once.
  void resumed(const Journaled& journaled) {
    if (options_.on_reached) {
      options_.on_reached({capture(), durability_->reached(), durability_->gaps()});
      scheduler_->stop();
      return;
    }
    const auto wall = between(journaled.at, options_.durable->clock());
    const Duration lost = scenario_.virtual_time ? Duration(0) : stretched(wall.value_or(Duration(0)));
    const Gap gap{scheduler_->now(), add_saturating(scheduler_->now(), lost), wall.value_or(Duration(0))};
    // Nobody was there to hear an answer, so nobody was late. What was to be done in that time is done now.
    mission::TreeState& tree = mission_->state();
    for (mission::TreeState::Leaf& leaf : tree.leaves) leaf.asked = add_saturating(leaf.asked, lost);
    tree.deadline.when = add_saturating(tree.deadline.when, lost);
    scheduler_->leap(gap.to, [lost](TimePoint& when, mission::Delivery& what) {
      const auto* to_tree = std::get_if<mission::TreeDelivery>(&what.what);
      if (to_tree != nullptr && (std::holds_alternative<mission::AnswerDue>(*to_tree) ||
                                 std::holds_alternative<mission::HaltLimit>(*to_tree)))
        when = add_saturating(when, lost);
    });
    durability_->resumed(gap, lost);
    monitors_.note_gaps(durability_->gaps());
    if (options_.on_begin) options_.on_begin(*this);
    Message message;
    message.source = "run";
    message.name = "mission.resumed";
    message.data =
        Map{{"from_ns", gap.from.time_since_epoch().count()}, {"lost_ns", lost.count()}, {"wall_ns", gap.wall.count()}};
    stream_.publish(std::move(message));
    if (!wall)
      problem("the machine's clock was set back: how long nobody was there is not known, and counts as no time");
    auto beside = remember_observers(kAfterResumption, true);
    durability_->snapshot(capture(), beside.value_or(List()));
    if (!beside) durability_->journal().give_up("a monitor in another process does not say how far it is");
    end_journal(journaled, recording_name());
    durability_->ask_again();
    keep_journal(add_saturating(gap.to, journal_period()));
  }

  std::string recording_name() const {
    const Value* recording = options_.durable->note.find("recording");
    return recording != nullptr ? std::string(recording->text()) : options_.durable->journal.filename().string();
  }

  // Run time between two states in the journal.
  Duration journal_period() const {
    return scenario_.virtual_time ? options_.durable->snapshot_period : stretched(options_.durable->snapshot_period);
  }

  void keep_journal(TimePoint when) {
    scheduler_->at(director_, when, mission::Rank::kInjection, [this, when] {
      // Behind what came in at this instant, of which a part may be in the state and another not yet in the journal.
      scheduler_->at(director_, scheduler_->now(), mission::Rank::kInjection, [this, when] {
        // Without it, the records behind the last state say everything still.
        const Duration patience = when == TimePoint{} ? Duration(kAfterResumption) : Duration(kBetweenTicks);
        if (auto beside = remember_observers(patience, false)) durability_->snapshot(capture(), std::move(*beside));
        keep_journal(std::max(when + journal_period(), scheduler_->now()));
      });
    });
  }

  // At first and whenever it has doubled.
  void fell_behind(Duration behind) {
    if (behind < tell_behind_) return;
    tell_behind_ = 2 * behind;
    problem(behind_the_clock(behind, durability_->waited_for_charts(), durability_->journal().cost().waited));
  }

  bool is_again() const { return durability_ && durability_->catching_up(); }
  // Observations of what is executed again were heard before, but for the last ones.
  bool is_heard(std::uint64_t sequence) const { return !is_again() || sequence > options_.durable->known; }

  std::optional<std::string> prepare() {
    if (auto error = reach_elsewhere()) return error;
    make_models();
    if (auto error = make_mission()) return error;
    subscribe();
    return std::nullopt;
  }

  std::optional<std::string> reach_elsewhere() {
    for (const project::ObserverPlan& observer : plan_.observers) {
      if (observer.is_monitor) remote_reports_.emplace_back().name = observer.name;
    }
    if (!options_.elsewhere) {
      const bool looks_only = options_.on_reached != nullptr;
      const auto away = std::find_if(plan_.leaves.begin(), plan_.leaves.end(),
                                     [](const project::LeafPlan& leaf) { return !leaf.at.empty(); });
      if (away != plan_.leaves.end() && !looks_only)
        return fmt::format("the skill of {} runs elsewhere{}", away->name, kOnlyHere);
      if (!plan_.observers.empty())
        return fmt::format("{} observes from elsewhere{}", plan_.observers.front().name, kOnlyHere);
      if (!scenario_.processes.empty() && !looks_only)
        return fmt::format("process {} cannot be started{}", scenario_.processes.front().name, kOnlyHere);
      return std::nullopt;
    }
    elsewhere_ = options_.elsewhere({.plan = plan_,
                                     .publisher = publisher_,
                                     .publish = [this](Message message) { stream_.publish(std::move(message)); },
                                     .problem = [this](const std::string& what) { problem(what); },
                                     .happened = [this](const ProcessEvent& event) { on_process(event); },
                                     .decided =
                                         [this](const std::string& name, const monitor::Decision& decision) {
                                           {
                                             const std::lock_guard lock(problems_mutex_);
                                             decided_elsewhere_.emplace_back(name, decision);
                                           }
                                           if (durability_) {
                                             (void)scheduler_->inject(director_, [this] { take_decisions(); });
                                             return;
                                           }
                                           // The stream's actor is where monitors of this process decide too.
                                           scheduler_->post(stream_.actor(), [this] { take_decisions(); });
                                         },
                                     .journal = durability_ ? options_.durable->journal : std::filesystem::path(),
                                     .left_behind = options_.resume != nullptr ? options_.resume->parts : List(),
                                     .only_looks = options_.on_reached != nullptr});
    publisher_.set_elsewhere(elsewhere_.get());
    if (auto error = elsewhere_->start(services_)) return error;
    keep_parts();
    if (durability_) return recall_observers();
    return std::nullopt;
  }

  // Observers begin as they were at the journal's state, from which on everything is observed again.
  std::optional<std::string> recall_observers() {
    static const std::vector<Value> kNothing;
    const auto& known = options_.resume != nullptr ? options_.resume->open : kNothing;
    for (const Value& entry : known) {
      if (auto decided = Durability::decided(entry)) note_decision(decided->first, decided->second);
    }
    for (std::size_t i = 0; i < observers().size(); ++i) {
      Value memory;
      for (const Value& entry : known) {
        const Value* name = entry.find("observer");
        const Value* what = entry.find("memory");
        if (name != nullptr && what != nullptr && name->text() == plan_.observers[i].name) memory = *what;
      }
      if (auto recalled = observers()[i]->recall(memory); !recalled) return recalled.error().message;
    }
    return std::nullopt;
  }

  // As they are now, for the journal. Nothing: one does not say it in time, or has decided what has not been taken.
  // That may be `taken` where the journal begins, and nothing of this instant is executed again.
  std::optional<List> remember_observers(Duration patience, bool taken) {
    // What is taken is observed, and may make another one decide: each once.
    for (std::size_t rounds = 0; rounds <= observers().size(); ++rounds) {
      List all;
      for (std::size_t i = 0; i < observers().size(); ++i) {
        auto memory = observers()[i]->remember(patience);
        if (!memory) return std::nullopt;
        all.push_back(Map{{"observer", plan_.observers[i].name}, {"memory", std::move(*memory)}});
      }
      if (is_decided_elsewhere()) {
        if (!taken) break;
        take_decisions();
        continue;
      }
      const std::lock_guard lock(problems_mutex_);
      for (const MonitorReport& report : remote_reports_) {
        if (report.decision) all.push_back(Map{{"decided", report.name}, {"decision", save(*report.decision)}});
      }
      return all;
    }
    return std::nullopt;
  }

  bool is_decided_elsewhere() {
    const std::lock_guard lock(problems_mutex_);
    return !decided_elsewhere_.empty();
  }

  const std::vector<std::unique_ptr<Observer>>& observers() const {
    static const std::vector<std::unique_ptr<Observer>> kNone;
    return elsewhere_ ? elsewhere_->observers() : kNone;
  }

  void keep_parts() {
    if (durability_) durability_->journal().parts(elsewhere_->parts());
  }

  void on_process(const ProcessEvent& event) {
    take_observations();
    Message message;
    message.source = "run";
    message.target = event.process;
    message.data = Map{{"process", event.process}};
    switch (event.kind) {
      case ProcessEvent::Kind::kExited:
        message.name = "process.exited";
        message.data = Map{{"process", event.process}, {"pid", event.pid}, {"how", event.how}};
        problem(fmt::format("process {} ended: {}", event.process, event.how));
        break;
      case ProcessEvent::Kind::kRestarted:
        message.name = "process.restarted";
        message.data = Map{{"process", event.process}, {"pid", event.pid}};
        break;
      case ProcessEvent::Kind::kGivenUp:
        message.name = "process.given_up";
        problem(fmt::format("process {} ended too often and is not started again", event.process));
        break;
    }
    if (!durability_) {
      stream_.publish(std::move(message));
      return;
    }
    (void)scheduler_->inject(director_, [this, message = std::move(message)] {
      durability_->observed(message);
      keep_parts();
      stream_.publish(message);
    });
  }

  // What comes from another process must not be published before what that has observed.
  void take_observations() {
    if (elsewhere_) elsewhere_->take_observations();
  }

  void take_decisions() {
    std::vector<std::pair<std::string, monitor::Decision>> decisions;
    {
      const std::lock_guard lock(problems_mutex_);
      decisions.swap(decided_elsewhere_);
    }
    for (const auto& [name, decision] : decisions) take_decision(name, decision);
  }

  // Nothing: it is an observer that is no monitor of the project, or one of a run that goes on, and known.
  std::optional<MonitorReport> note_decision(const std::string& name, const monitor::Decision& decision) {
    const std::lock_guard lock(problems_mutex_);
    const auto slot = std::find_if(remote_reports_.begin(), remote_reports_.end(),
                                   [&](const MonitorReport& known) { return known.name == name; });
    if (slot == remote_reports_.end() || (durability_ && slot->decision)) return std::nullopt;
    slot->verdict = decision.verdict;
    slot->decision = decision;
    if (durability_) slot->gaps = gaps_within(decision, durability_->gaps());
    return *slot;
  }

  // Of a monitor elsewhere.
  void take_decision(const std::string& name, const monitor::Decision& decision) {
    const auto report = note_decision(name, decision);
    if (!report) return;
    if (durability_) durability_->decided(name, decision);
    stream_.publish(decision_message(*report));
    on_decision(*report);
  }

  // Nobody serves it: what is published has left when it was observed.
  static bool is_published_only(const project::ServicePlan& service) {
    return service.at == "topics" || (service.at == "sim" && service.interface == sim::kTelemetry);
  }

  std::unique_ptr<ServicePort> make_port(const project::ServicePlan& service, const std::string& leaf) {
    if (options_.make_port) {
      if (auto port = options_.make_port(service, leaf)) return port;
    }
    if (is_published_only(service)) return make_topic_port();
    if (service.at == "sim") {
      SENTREE_ASSERT(sim_ != nullptr);  // checked when the plan was prepared
      return steering_.guard(service.name, project::kSimulatorPart,
                             make_sim_port(*sim_, service.interface, service.robot));
    }
    if (service.at == "model") return steering_.guard(service.name, "", make_model_port(*model_of(service.name), leaf));
    auto port = elsewhere_ ? elsewhere_->make_port(service, scenario_.project.deadlines.call)
                           : std::make_unique<UnreachablePort>(service.name);
    return durability_ ? durability_->guard(std::move(port)) : std::move(port);
  }

  void make_models() {
    for (std::size_t i = 0; i < plan_.models.size(); ++i) {
      mission::ComponentModel model = mission::component_model(plan_, i);
      model.patience = stretched(model.patience);
      models_.push_back(std::make_unique<ModelActor>(
          std::move(model), i,
          ModelActor::Surroundings{
              .publisher = publisher_,
              .scheduler = *scheduler_,
              .watchdog = &watchdog_,
              .answer = [this](std::size_t leaf,
                               mission::Outcome outcome) { skills_[leaf]->take_outcome(std::move(outcome)); },
              .problem = [this](const std::string& what) { problem(what); },
              .choose = [this](const mission::Choice& choice) { return chosen(choice); },
              .given_up = [this](const std::string& why) { given_up(why); }}));
    }
  }

  std::optional<std::uint64_t> chosen(const mission::Choice& choice) {
    const auto told = mission::scripted(scenario_, choice);
    if (!told && scenario_.choices) {
      problem(fmt::format("choice {} of {} ({}) has no alternative of the value that the scenario gives it",
                          choice.number, choice.model, choice.function));
    }
    return told;
  }

  ModelActor* model_of(const std::string& service) const {
    for (std::size_t i = 0; i < plan_.models.size(); ++i) {
      const auto& serves = plan_.models[i].serves;
      if (std::find(serves.begin(), serves.end(), service) != serves.end()) return models_[i].get();
    }
    SENTREE_ASSERT(false);  // checked when the plan was prepared
    return nullptr;
  }

  std::optional<std::string> make_mission() {
    std::vector<std::unique_ptr<LeafDriver>> drivers;
    skills_.assign(plan_.leaves.size(), nullptr);
    for (std::size_t i = 0; i < plan_.leaves.size(); ++i) {
      // A durable run keeps its skills itself, wherever their charts are executed.
      auto driver = plan_.leaves[i].at.empty() || durability_ ? make_local(i) : make_remote(i);
      if (!driver) return driver.error().message;
      drivers.push_back(std::move(*driver));
    }
    project::Deadlines deadlines = scenario_.project.deadlines;
    for (Duration* deadline : {&deadlines.condition, &deadlines.budget, &deadlines.halt, &deadlines.unresponsive})
      *deadline = stretched(*deadline);
    mission::TreeModel model{.plan = &plan_,
                             .period = scenario_.project.period,
                             .repeat = scenario_.project.repeat,
                             .deadlines = deadlines,
                             .tick_times = options_.tick_times,
                             .one_deadline_timer = !scheduler_->is_virtual()};
    MissionHooks hooks;
    if (options_.arrival)
      hooks.due = [this](std::size_t leaf) { return options_.arrival(leaf, RunOptions::LeafMessage::kDue); };
    hooks.tick_done = [this](std::uint64_t tick) { steering_.tick_done(tick); };
    hooks.ended = [this] {
      ended_ = scheduler_->now();
      scheduler_->stop();
    };
    mission_ = std::make_unique<Mission>(std::move(model), scenario_.factor, *scheduler_, stream_, steering_.faults(),
                                         std::move(drivers), std::move(hooks));
    return std::nullopt;
  }

  // Once the skills and models are made.
  void subscribe() {
    for (std::size_t i = 0; i < plan_.leaves.size(); ++i) {
      SkillActor* const skill = skills_[i];
      for (const std::string& topic : plan_.leaves[i].subscribes) {
        if (skill != nullptr)
          topics_.add(topic, [skill](const auto& what, Duration delay) { skill->take_topic(what, delay); });
      }
    }
    for (std::size_t i = 0; i < plan_.models.size(); ++i) {
      for (const std::string& topic : plan_.models[i].subscribes)
        topics_.add(topic,
                    [model = models_[i].get()](const auto& what, Duration delay) { model->take_topic(what, delay); });
    }
  }

  // What anybody has published, whether in this process or elsewhere.
  void deliver(const Message& message) {
    if (message.kind != MessageKind::kRequest) return;
    const std::string_view topic = call_of(message);
    if (!topics_.is_subscribed(topic)) return;
    const Value* const args = message.data.find("args");
    const auto service = services_.find(message.target);
    const idl::Method* const method = service != services_.end() && topic.size() > message.target.size()
                                          ? service->second.service->find(topic.substr(message.target.size() + 1))
                                          : nullptr;
    auto conforming = method != nullptr ? idl::conform_arguments(*method, args != nullptr ? *args : Value(Map()))
                                        : fail("run.topic", "the run has no such service");
    if (!conforming)
      return problem(fmt::format("{} of {} reaches nobody: {}", topic, message.source, conforming.error().message));
    StandingFaults& faults = steering_.faults();
    topics_.deliver({std::string(topic), message.source, std::move(*conforming)},
                    faults.calls_spared() ? Duration(0) : faults.delay_of(topic));
  }

  void pass(std::size_t leaf, RunOptions::LeafMessage what, Scheduler::Task task) {
    const TimePoint at = options_.arrival ? options_.arrival(leaf, what) : TimePoint{};
    if (at <= scheduler_->now())
      task();
    else if (at != kNever)
      scheduler_->at(director_, at, mission::Rank::kMessage, std::move(task));
  }

  struct KeptChart final : mission::ChartElsewhere {
    KeptChart(Durability& by, std::unique_ptr<mission::ChartElsewhere> of) : durability(by), chart(std::move(of)) {}
    tl::expected<Value, Away> execute(const scxml::Session& session, const scxml::StepOrder& order) override {
      return durability.execute(*chart, session, order);
    }
    void took(const scxml::Session& session) override { chart->took(session); }
    Durability& durability;
    const std::unique_ptr<mission::ChartElsewhere> chart;
  };

  struct LocalDriver final : LeafDriver {
    LocalDriver(Impl& of, std::size_t leaf) : run(of), index(leaf) {}
    void tick(std::uint64_t tick, bool started, const Map& inputs) override {
      run.pass(index, RunOptions::LeafMessage::kTick,
               [this, tick, started, inputs] { skill->tick(tick, started, inputs); });
    }
    void halt() override {
      run.pass(index, RunOptions::LeafMessage::kHalt, [this] { skill->halt(); });
    }
    void cancel() override { skill->cancel(); }
    Impl& run;
    std::size_t index;
    std::unique_ptr<KeptChart> chart;  // null: executed here
    std::unique_ptr<SkillActor> skill;
  };

  Result<std::unique_ptr<LeafDriver>> make_local(std::size_t index) {
    const project::LeafPlan& leaf = plan_.leaves[index];
    SkillActor::Replies replies;
    replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
      pass(index, RunOptions::LeafMessage::kAnswer,
           [this, index, tick, status, outputs = std::move(outputs)]() mutable {
             mission_->answered(index, tick, status, std::move(outputs));
           });
    };
    replies.halted = [this, index] {
      pass(index, RunOptions::LeafMessage::kHalted, [this, index] { mission_->halted(index); });
    };
    replies.problem = [this](const std::string& what) { problem(what); };
    replies.given_up = [this](const std::string& why) { given_up(why); };
    replies.log = [this, name = leaf.name](const scxml::LogLine& line) {
      Message message;
      message.source = name;
      message.name = name + ".log";
      message.data = Map{{"label", line.label}, {"text", line.text}};
      stream_.publish(std::move(message));
    };
    replies.stepped = [this, index](const Skill& skill) {
      steering_.skill_stepped(index, skill);
      if (options_.on_skill_step && !is_again()) options_.on_skill_step(index, skill);
    };
    auto driver = std::make_unique<LocalDriver>(*this, index);
    mission::SkillModel model = mission::skill_model(plan_, index);
    model.halt_deadline = stretched(model.halt_deadline);
    model.call_deadline = stretched(model.call_deadline);
    model.services = &services_;
    if (!leaf.at.empty() && elsewhere_) {
      auto chart = elsewhere_->make_chart(index);
      if (!chart) return tl::unexpected(chart.error());
      driver->chart = std::make_unique<KeptChart>(*durability_, std::move(*chart));
    }
    driver->skill = std::make_unique<SkillActor>(
        std::move(model), index,
        SkillActor::Surroundings{
            .publisher = publisher_,
            .scheduler = *scheduler_,
            .faults = steering_.faults(),
            .watchdog = &watchdog_,
            .make_port = [this,
                          name = leaf.name](const project::ServicePlan& service) { return make_port(service, name); },
            .chart_elsewhere = driver->chart.get()},
        std::move(replies));
    skills_[index] = driver->skill.get();
    return std::unique_ptr<LeafDriver>(std::move(driver));
  }

  Result<std::unique_ptr<LeafDriver>> make_remote(std::size_t index) {
    LeafReplies replies;
    replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
      take_observations();
      mission_->answered(index, tick, status, std::move(outputs));
    };
    replies.halted = [this, index] {
      take_observations();
      mission_->halted(index);
    };
    replies.problem = [this](const std::string& what) { problem(what); };
    return elsewhere_->make_leaf(index, std::move(replies));
  }

  Duration stretched(Duration wall) const {
    return Duration(static_cast<std::int64_t>(static_cast<double>(wall.count()) * scenario_.factor));
  }

  void schedule_timeline() {
    for (const project::Injection& injection : scenario_.timeline) {
      if (options_.from != nullptr && injection.at <= options_.from->now) continue;  // has happened
      scheduler_->at(director_, injection.at, mission::Rank::kInjection,
                     [this, &injection] { steering_.inject(injection); });
    }
  }

  void schedule_telemetry() {
    if (!sim_) return;
    for (const project::ServiceEntry& service : scenario_.project.services) {
      if (service.at != "sim") continue;
      for (const project::PublishedTopic& topic : service.publish) {
        const sim::TopicInfo* const info = sim::find_topic(topic.method);
        const idl::Method* const method = services_.at(service.name).service->find(topic.method);
        SENTREE_ASSERT(info != nullptr && method != nullptr);  // checked when the plan was prepared
        telemetry_.add({.service = service.name,
                        .method = topic.method,
                        .argument = method->arguments.fields.front().name,
                        .port = steering_.guard(service.name, project::kSimulatorPart,
                                                make_sim_port(*sim_, std::string(info->service), service.robot)),
                        .source = std::string(info->method),
                        .period = topic.period});
      }
    }
    telemetry_.start(options_.from);
  }

  // A call from outside the mission: by the scenario's timeline or through the control socket.
  mission::CallOutcome call_service(const std::string& name, const std::string& method, const Value& arguments) {
    const auto controlled = plan_.world ? project::test_control_of(name, *plan_.world) : std::nullopt;
    const auto service = services_.find(name);
    const idl::ServicePtr interface = controlled                   ? plan_.test_control
                                      : service != services_.end() ? service->second.service
                                                                   : nullptr;
    if (!interface)
      return {.ok = false,
              .result = {},
              .kind = "arguments",
              .message = fmt::format("the run has no service \"{}\"", name)};
    const auto found = idl::find_method(*interface, method, name);
    if (!found) return {.ok = false, .result = {}, .kind = "arguments", .message = found.error().message};
    const auto args = idl::conform_arguments(**found, arguments);
    if (!args) return {.ok = false, .result = {}, .kind = "arguments", .message = args.error().message};
    if (const auto checked = idl::check_ranges(**found, *args); !checked)
      return {.ok = false, .result = {}, .kind = "arguments", .message = checked.error().message};
    const std::string at = !controlled  ? service->second.at
                           : sim_       ? "sim"
                           : elsewhere_ ? elsewhere_->control_address(services_, name)
                                        : std::string();
    if ((*found)->oneway) {
      Message request;
      request.kind = MessageKind::kRequest;
      request.source = "scenario";
      request.target = name;
      request.name = name + "." + method + ".request";
      request.call = publisher_.next_call();
      request.data = Map{{"args", *args}};
      stream_.publish(std::move(request));
      if (!controlled && is_published_only(service->second))
        return {.ok = true, .result = {}, .kind = {}, .message = {}};
    }
    if (at == "sim")
      return sim_->call(interface->name, method, *args, controlled ? *controlled : service->second.robot);
    if (at == "model") {
      mission::Call call{
          .run = 0, .id = publisher_.next_call(), .service = name, .method = method, .args = *args, .sendid = {}};
      return model_of(name)->call(std::move(call), "scenario", kCallPatience);
    }
    // It has left the run already.
    if (is_again()) return {.ok = true, .result = {}, .kind = {}, .message = {}};
    if (!elsewhere_)
      return {.ok = false,
              .result = {},
              .kind = "unreachable",
              .message = fmt::format("nothing in the run serves \"{}\"", name)};
    return elsewhere_->call(at, interface, name, method, *args, kCallPatience);
  }

  bool serves_control() const {
    return elsewhere_ && (!scenario_.virtual_time || options_.pace > 0 || options_.paused);
  }
  void serve_control() {
    ControlHandler handler;
    handler.scenario = [this] { return scenario_.name; };
    handler.now = [this] { return scheduler_->now(); };
    handler.services = [this] {
      std::vector<ControlHandler::ServiceEntry> entries;
      for (const auto& [name, service] : services_)
        entries.push_back({name, service.service, service.observed.empty() ? service.at : service.observed});
      if (plan_.test_control && plan_.world) {
        for (const std::string& name : project::test_control_names(*plan_.world))
          entries.push_back({name, plan_.test_control, "sim"});
      }
      return entries;
    };
    handler.call = [this](const std::string& service, const std::string& method, const Value& arguments) {
      auto applied = steering_.apply_for(
          project::intervention::Call{.method = service + "." + method, .args = arguments}, "control");
      if (applied) return std::move(applied->outcome);
      return mission::CallOutcome{.ok = false, .result = {}, .kind = "arguments", .message = applied.error().message};
    };
    handler.tap = &tap_;
    handler.open_page = options_.open_page;
    elsewhere_->serve_control(std::move(handler));
  }

  // Ends, and waits for, the threads that call into this and that are not the scheduler's: before what they call goes,
  // and before whoever executes the run is told that it is over.
  void end_callers() {
    if (elsewhere_) elsewhere_->close(left_behind_);
  }

  void on_decision(const MonitorReport& report) {
    if (options_.on_decision && is_heard(stream_.published())) options_.on_decision(report);
    if (scenario_.stop_when_violated && report.verdict == monitor::Verdict::kViolated) mission_->stop();
  }

  void given_up(const std::string& why) {
    left_behind_ = true;
    {
      const std::lock_guard lock(problems_mutex_);
      given_up_.push_back(why);
    }
    problem(why);
  }

  void problem(const std::string& what) {
    if (is_again()) return;
    {
      const std::lock_guard lock(problems_mutex_);
      if (problems_.size() < kProblemsMax) problems_.push_back(what);
    }
    if (options_.on_problem) options_.on_problem(what);
  }

  const project::Plan& plan_;
  const project::Scenario& scenario_;
  RunOptions options_;
  Services services_;
  std::unique_ptr<Scheduler> scheduler_;
  std::unique_ptr<SimHost> sim_;  // after its clock: it keeps up with it until it goes
  Stream stream_;
  Watchdog watchdog_;
  Monitors monitors_;
  StreamPublisher publisher_;
  ActorId director_;
  Telemetry telemetry_{*scheduler_, publisher_, director_};
  RunSteering steering_;
  std::unique_ptr<Durability> durability_;  // null: the run is not durable
  std::optional<mission::State> resumed_from_;
  std::vector<MonitorReport> remote_reports_;  // of monitors elsewhere; under problems_mutex_
  std::vector<std::pair<std::string, monitor::Decision>> decided_elsewhere_;  // not yet taken; likewise
  Tap tap_;
  std::unique_ptr<Elsewhere> elsewhere_;             // null: everything runs in this process
  std::vector<std::unique_ptr<ModelActor>> models_;  // as in the plan
  std::vector<SkillActor*> skills_;                  // by leaf; null: it runs elsewhere
  Topics topics_;
  std::unique_ptr<Mission> mission_;
  std::atomic<Mission*> ready_ = nullptr;  // the mission, once it can be interrupted
  std::mutex problems_mutex_;
  std::vector<std::string> problems_;
  std::vector<std::string> given_up_;
  std::atomic<bool> left_behind_ = false;
  TimePoint ended_{};
  Duration tell_behind_ = std::chrono::seconds(1);
  bool is_over_ = false;  // and durable
  std::atomic<bool> timed_out_ = false;
  std::atomic<bool> interrupted_ = false;
};

Run::Run(const project::Plan& plan, RunOptions options) : impl_(std::make_unique<Impl>(plan, std::move(options))) {}
Run::~Run() {
  if (impl_->left_behind()) keep_for_ever(std::shared_ptr<Impl>(std::move(impl_)));
}
RunReport Run::execute() { return impl_->execute(); }
void Run::interrupt() { impl_->interrupt(); }
void Run::forget() { impl_->forget(); }

}  // namespace sentree::runtime
