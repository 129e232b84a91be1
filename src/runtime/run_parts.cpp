#include "sentree/runtime/detail/run_impl.h"

#include <algorithm>
#include <type_traits>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/base/diagnostic.h"
#include "sentree/mission/effect.h"
#include "sentree/project/cpp_nodes.h"

namespace sentree::runtime {

namespace {

struct KeptChart final : mission::ChartElsewhere {
  KeptChart(Durability& by, std::unique_ptr<mission::ChartElsewhere> of) : durability(by), chart(std::move(of)) {}
  tl::expected<Value, Away> execute(const scxml::Session& session, const scxml::StepOrder& order) override {
    return durability.execute(*chart, session, order);
  }
  void took(const scxml::Session& session) override { chart->took(session); }
  Durability& durability;
  const std::unique_ptr<mission::ChartElsewhere> chart;
};

bool simulates_a_service(const Services& services) {
  return std::any_of(services.begin(), services.end(), [](const auto& service) { return service.second.at == "sim"; });
}

}  // namespace

Run::Impl::Impl(const project::Plan& plan, RunOptions options)
    : plan_(plan),
      scenario_(plan.scenario),
      options_(std::move(options)),
      services_(plan.services),
      scheduler_(scenario_.virtual_time || options_.durable ? make_virtual_scheduler()
                                                            : make_real_scheduler(scenario_.factor)),
      stream_(*scheduler_),
      watchdog_(scenario_.project.deadlines.script),
      monitors_(plan, *scheduler_, stream_, watchdog_, replies_of_monitors()),
      publisher_(stream_, monitors_, *scheduler_, stretched(scenario_.project.deadlines.call)),
      director_(scheduler_->add_actor("director")),
      steering_(what_is_steered()) {
  make_durable();
  follow_orders();
  const bool at_pace = scenario_.virtual_time || options_.pace > 0;
  scheduler_->set_pace({.paused = options_.paused, .factor = at_pace ? options_.pace : scenario_.factor});
  make_world();
}

Run::Impl::~Impl() {
  end_callers();
  if (sim_) sim_->stop_keeping_up();
}

Monitors::Replies Run::Impl::replies_of_monitors() {
  return {.decided = [this](const MonitorReport& report) { on_decision(report); },
          .given_up = [this](const std::string& why) { given_up(why); },
          .stepped = [this](std::size_t index) { steering_.monitor_stepped(index); }};
}

SteeredRun Run::Impl::what_is_steered() {
  return {.plan = &plan_,
          .scheduler = scheduler_.get(),
          .director = director_,
          .publish = [this](Message message) { stream_.publish(std::move(message)); },
          .tick = [this] { return stream_.tick(); },
          .call = [this](const std::string& service, const std::string& method,
                         const Value& args) { return call_service(service, method, args); },
          .stop = [this] { stop_mission(); },
          .kill_process =
              [this](const std::string& process) {
                if (elsewhere_) elsewhere_->kill(process);
              },
          .restart_process = [this](const std::string& process) { return elsewhere_ && elsewhere_->restart(process); },
          .skill = [this](std::size_t leaf) { return skills_[leaf]; },
          .kill_skill =
              [this](std::size_t leaf, TimePoint asked) {
                pass(leaf, RunOptions::LeafMessage::kKill, [this, leaf, asked] { skills_[leaf]->kill(asked); });
              },
          .restart_skill =
              [this](std::size_t leaf, TimePoint asked) {
                pass(leaf, RunOptions::LeafMessage::kRestart, [this, leaf, asked] { skills_[leaf]->restart(asked); });
              },
          .monitors = [this]() -> const Monitors& { return monitors_; },
          .problem = [this](const std::string& what) { problem(what); },
          .keep =
              [this](const project::Intervention& what, const std::string& source) {
                if (durability_) durability_->intervention(what, source);
              },
          .observer = stream_.actor()};
}

void Run::Impl::make_durable() {
  if (!options_.durable) return;
  if (options_.resume != nullptr) options_.durable->resumed = options_.resume->file;
  durability_ = std::make_unique<Durability>(
      plan_, *scheduler_, *options_.durable, [this](std::size_t leaf) { return skills_[leaf]; },
      options_.resume != nullptr ? options_.resume->gaps : std::vector<Gap>());
  scheduler_->keep(durability_.get());
}

// Those that the scenario wants among deliveries that are due at one instant.
void Run::Impl::follow_orders() {
  if (scenario_.orders.empty()) return;
  const auto decide = [this](std::uint64_t number, std::span<const mission::Delivery* const> due) {
    orders_ = number;
    const auto first = mission::scripted(plan_, number, due);
    if (!first) problem(fmt::format("order {} of the scenario: nothing is due for the part that it names", number));
    return first.value_or(0);
  };
  scheduler_->on_order(decide, [this](const mission::Delivery& what) {
    return mission::has_effect(what, mission_->state(), [this](bool is_model, std::size_t part) {
      return is_model ? models_[part]->state().wake : skills_[part]->state().wake;
    });
  });
}

void Run::Impl::make_world() {
  if (plan_.world && (simulates_a_service(services_) || services_.empty()))
    sim_ = std::make_unique<SimHost>(plan_.world, scenario_.seed, *scheduler_);
}

SimHost* Run::Impl::sim() { return simulates_a_service(services_) ? sim_.get() : nullptr; }

void Run::Impl::make_models() {
  for (std::size_t i = 0; i < plan_.models.size(); ++i) {
    mission::ComponentModel model = mission::component_model(plan_, i);
    model.patience = stretched(model.patience);
    models_.push_back(std::make_unique<ModelActor>(
        std::move(model), i,
        ModelActor::Surroundings{
            .publisher = publisher_,
            .scheduler = *scheduler_,
            .faults = steering_.faults(),
            .watchdog = &watchdog_,
            .answer = [this](std::size_t leaf,
                             mission::Outcome outcome) { skills_[leaf]->take_outcome(std::move(outcome)); },
            .problem = [this](const std::string& what) { problem(what); },
            .choose = [this](const mission::Choice& choice) { return chosen(choice); },
            .given_up = [this](const std::string& why) { given_up(why); }}));
  }
}

std::optional<std::uint64_t> Run::Impl::chosen(const mission::Choice& choice) {
  if (options_.on_choice) options_.on_choice(choice);
  const auto told = mission::scripted(scenario_, choice);
  if (!told && scenario_.choices) problem(mission::no_such_alternative(scenario_, choice));
  return told;
}

void Run::Impl::tell_unasked(RunReport& report) const {
  if (interrupted_ || !report.error.empty()) return;
  // Of those behind the last one that was asked for, the first; what comes from the command line has no place.
  const auto tell = [&report](const auto& entries, std::uint64_t last, const auto& is_meant, const auto& name,
                              const std::string& asked) {
    std::size_t count = 0;
    const auto* first = static_cast<const std::decay_t<decltype(entries.front())>*>(nullptr);
    for (const auto& entry : entries) {
      if (entry.span.line == 0 || !is_meant(entry) || entry.number <= last) continue;
      ++count;
      if (first == nullptr || entry.number < first->number) first = &entry;
    }
    if (first == nullptr) return;
    const std::string tick = first->tick > 0 ? fmt::format(" of tick {}", first->tick) : "";
    const std::string others = count < 2    ? ""
                               : count == 2 ? ", nor was one behind it"
                                            : fmt::format(", nor were {} behind it", count - 1);
    report.problems.push_back(to_string(
        Diagnostic{Severity::kWarning, "run.unasked",
                   fmt::format("{}{} was never asked for{}: {}", name(*first), tick, others, asked), first->span}));
  };
  for (std::size_t i = 0; i < plan_.models.size() && scenario_.choices; ++i) {
    const project::ModelPlan& model = plan_.models[i];
    // One that serves nothing here is not there.
    const bool serves = std::any_of(model.serves.begin(), model.serves.end(), [this](const std::string& service) {
      const auto known = services_.find(service);
      return known != services_.end() && known->second.at == "model";
    });
    if (!serves && !model.serves.empty()) continue;
    const std::uint64_t made = models_[i]->state().choices;
    tell(
        *scenario_.choices, made, [&](const project::ScenarioChoice& one) { return one.model == model.name; },
        [](const project::ScenarioChoice& one) {
          return one.name.empty() ? fmt::format("choice {}#{}", one.model, one.number)
                                  : fmt::format("choice '{}' ({}#{})", one.name, one.model, one.number);
        },
        fmt::format("{} chose {} time{} in this run", model.name, made, made == 1 ? "" : "s"));
  }
  if (!scheduler_->is_virtual()) return;
  tell(
      scenario_.orders, orders_, [](const project::ScenarioOrder&) { return true; },
      [](const project::ScenarioOrder& one) { return fmt::format("order {} ({} first)", one.number, one.first); },
      fmt::format("{} time{} in this run something was due for several parts at once", orders_,
                  orders_ == 1 ? "" : "s"));
}

ModelActor* Run::Impl::model_of(const std::string& service) const {
  for (std::size_t i = 0; i < plan_.models.size(); ++i) {
    const auto& serves = plan_.models[i].serves;
    if (std::find(serves.begin(), serves.end(), service) != serves.end()) return models_[i].get();
  }
  SENTREE_ASSERT(false);  // checked when the plan was prepared
  return nullptr;
}

std::optional<std::string> Run::Impl::make_mission() {
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
  watch_nodes();
  const WatchNodes watched(node_watch_.get());
  mission_ = std::make_unique<Mission>(std::move(model), scenario_.factor, *scheduler_, stream_, steering_.faults(),
                                       std::move(drivers), std::move(hooks));
  return std::nullopt;
}

void Run::Impl::watch_nodes() {
  if (project::cpp_nodes(plan_).empty()) return;
  const project::Deadlines& deadlines = scenario_.project.deadlines;
  const bool stands = scheduler_->is_virtual();
  NodeWatch::Patience patience{.told = deadlines.unresponsive, .halt = deadlines.halt};
  if (stands) patience.limit = std::max(scenario_.duration, deadlines.unresponsive);
  node_watch_ = std::make_unique<NodeWatch>(
      plan_.tree, stands ? 0.0 : scenario_.factor, patience,
      NodeWatch::Replies{.now = [this] { return scheduler_->now(); },
                         .told = [this](const std::string& what) { problem(what); },
                         .given_up = [this](const std::string& why) { give_up_mission(why); }});
}

void Run::Impl::give_up_mission(const std::string& why) {
  keep_for_ever(bt::nodes_of(plan_.tree));
  given_up(why);
  scheduler_->abandon(mission_->actor(), why);
  if (scheduler_->is_virtual()) return;
  ended_ = scheduler_->now();
  scheduler_->stop();
}

void Run::Impl::stop_mission() {
  if (node_watch_) node_watch_->stop_asked();
  const TimePoint at = options_.stop_arrival ? options_.stop_arrival() : TimePoint{};
  if (at <= scheduler_->now())
    mission_->stop();
  else if (at != kNever)
    scheduler_->at(director_, at, mission::Rank::kMessage, [this] { mission_->stop(); });
}

void Run::Impl::pass(std::size_t leaf, RunOptions::LeafMessage what, Scheduler::Task task) {
  const TimePoint at = options_.arrival ? options_.arrival(leaf, what) : TimePoint{};
  if (at <= scheduler_->now())
    task();
  else if (at != kNever)
    scheduler_->at(director_, at, mission::Rank::kMessage, std::move(task));
}

void Run::Impl::fail_leaf(std::size_t leaf, const std::string& reason) {
  const std::uint64_t asked = mission_->state().leaves.at(leaf).outstanding;
  mission_->answered(leaf, asked, bt::Status::kFailure, Map{{"reason", reason}});
}

struct Run::Impl::LocalDriver final : LeafDriver {
  LocalDriver(Impl& of, std::size_t leaf) : run(of), index(leaf) {}
  void tick(mission::TickSkill what, TimePoint asked) override {
    run.pass(index, RunOptions::LeafMessage::kTick,
             [this, what = std::move(what), asked]() mutable { skill->tick(std::move(what), asked); });
  }
  void halt(TimePoint asked) override {
    run.pass(index, RunOptions::LeafMessage::kHalt, [this, asked] { skill->halt(asked); });
  }
  void cancel(TimePoint asked) override {
    run.pass(index, RunOptions::LeafMessage::kCancel, [this, asked] { skill->cancel(asked); });
  }
  Impl& run;
  std::size_t index;
  std::unique_ptr<KeptChart> chart;  // null: executed here
  std::unique_ptr<SkillActor> skill;
};

Result<std::unique_ptr<LeafDriver>> Run::Impl::make_local(std::size_t index) {
  const project::LeafPlan& leaf = plan_.leaves[index];
  SkillActor::Replies replies;
  replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
    pass(index, RunOptions::LeafMessage::kAnswer, [this, index, tick, status, outputs = std::move(outputs)]() mutable {
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
  std::function<TimePoint(std::uint64_t)> timer_arrival;
  if (options_.timer_arrival)
    timer_arrival = [this, index](std::uint64_t number) { return options_.timer_arrival(index, number); };
  std::function<TimePoint(const std::string&)> veto_arrival;
  if (options_.veto_arrival)
    veto_arrival = [this, index](const std::string& call) { return options_.veto_arrival(index, call); };
  driver->skill = std::make_unique<SkillActor>(
      std::move(model), index,
      SkillActor::Surroundings{
          .publisher = publisher_,
          .scheduler = *scheduler_,
          .faults = steering_.faults(),
          .watchdog = &watchdog_,
          .make_port = [this,
                        name = leaf.name](const project::ServicePlan& service) { return make_port(service, name); },
          .timer_arrival = std::move(timer_arrival),
          .veto_arrival = std::move(veto_arrival),
          .chart_elsewhere = driver->chart.get(),
          // One that is durable executes some of it again, and would have to say the same of what it finds in its
          // journal.
          .tells_delays = !scheduler_->is_virtual()},
      std::move(replies));
  skills_[index] = driver->skill.get();
  return std::unique_ptr<LeafDriver>(std::move(driver));
}

Result<std::unique_ptr<LeafDriver>> Run::Impl::make_remote(std::size_t index) {
  LeafReplies replies;
  replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
    take_observations();
    mission_->answered(index, tick, status, std::move(outputs));
  };
  replies.unreachable = [this, index](std::uint64_t tick, const std::string& reason) {
    take_observations();
    // Whose answer it was no chart tells, and a replay executes the chart.
    Message message;
    message.source = "run";
    message.target = plan_.leaves[index].name;
    message.name = message.target + ".unreachable";
    message.data = Map{{"reason", reason}};
    stream_.publish(std::move(message));
    mission_->answered(index, tick, bt::Status::kFailure, Map{{"reason", reason}});
  };
  replies.halted = [this, index] {
    take_observations();
    mission_->halted(index);
  };
  replies.problem = [this](const std::string& what) { problem(what); };
  return elsewhere_->make_leaf(index, std::move(replies));
}

}  // namespace sentree::runtime
