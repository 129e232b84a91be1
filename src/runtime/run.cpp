#include "sentree/runtime/detail/run_impl.h"

#include <unistd.h>

#include <fmt/format.h>

namespace sentree::runtime {

RunReport Run::Impl::execute() {
  RunReport report;
  report.scenario = scenario_.name;
  report.virtual_time = scenario_.virtual_time;
  report.seed = scenario_.seed;
  if (auto error = prepare()) {
    report.error = *error;
    return report;
  }
  report.processes = processes();
  connect_stream();
  if (options_.from != nullptr)
    go_on_from(*options_.from);
  else
    monitors_.start();
  if (options_.on_view) options_.on_view(this);
  if (serves_control()) serve_control();
  start_clocks();
  start_parts();
  if (auto begun = begin_or_resume(); !begun) {
    report.error = to_string(begun.error());
    end_callers();
    return report;
  }
  ready_ = mission_.get();
  if (interrupted_) interrupt();  // while the parts were started
  // In virtual time nothing goes on without a thread, so a script that never ends has ended the run.
  const auto hung = scheduler_->is_virtual() ? monitors_.hung() : std::nullopt;
  const auto unheard = elsewhere_ ? elsewhere_->subscribe(services_) : std::nullopt;
  if (!scheduler_->is_virtual()) open_ports();
  const auto error = hung ? hung : unheard ? unheard : scheduler_->run();
  finish();
  report.error = error.value_or("");
  fill(report);
  if (owed_.empty()) {
    judge(scenario_, report);
    return report;
  }
  project::Scenario left = scenario_;
  std::erase_if(left.verdicts, [this](const auto& one) { return one.second == "owed" && owed_.contains(one.first); });
  judge(left, report);
  return report;
}

// What is owed on a loop is owed while that goes on. How skills halt behind it is no part of it.
void Run::Impl::note_owed() {
  if (!scenario_.loop || !scheduler_->is_virtual()) return;
  for (std::size_t i = 0; i < plan_.monitors.size(); ++i) {
    const monitor::State* const state = monitors_.state(i);
    if (state != nullptr && state->verdict == monitor::Verdict::kUndecided &&
        monitor::standing(plan_.monitors[i], *state).pending)
      owed_.insert(plan_.monitors[i].name());
  }
}

std::optional<std::string> Run::Impl::prepare() {
  if (!scenario_.project.executed_by.empty()) {
    return fmt::format("the mission is executed by {}, not here; sentree watch and sentree studio show it",
                       scenario_.project.executed_by);
  }
  if (auto error = prepare_durability()) return error;
  if (auto error = reach_elsewhere()) return error;
  make_models();
  if (auto error = make_mission()) return error;
  subscriptions_ = mission::Subscriptions(plan_, [this](std::size_t leaf) { return skills_[leaf] != nullptr; });
  return std::nullopt;
}

// Who hears what is observed, in this order: monitors decide before anybody else is told.
void Run::Impl::connect_stream() {
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
        [this, &name = name, &listener = listener](const Message& message) {
          if (message.name == name && is_heard(message.sequence)) listener(message);
        },
        [&name = name](const std::string& of) { return of == name; });
  }
  if (serves_control()) stream_.subscribe([this](const Message& message) { tap_.observe(message); });
  stream_.subscribe([this](const Message& message) { steering_.observed(message); },
                    [](const std::string&) { return false; });
  stream_.hear_all_while([this] { return steering_.faults().any(); });
  if (!subscriptions_.empty()) stream_.subscribe([this](const Message& message) { deliver(message); });
  stream_.subscribe([this](const Message& message) { tell_unanswered(message); },
                    [](const std::string& name) { return name.ends_with(".error"); });
}

void Run::Impl::start_clocks() {
  // A run whose time stands still for a moment is not the robot's.
  if (durability_ && !scenario_.virtual_time) scheduler_->on_behind([this](Duration behind) { fell_behind(behind); });
  if (!scheduler_->is_virtual() && sim_) {
    // What calls see later than they should makes a replay differ: that comes last.
    constexpr std::chrono::milliseconds kWork{250};
    sim_->keep_up({kWork, stretched(kWork)}, [this](Duration behind) { problem(falls_behind(behind)); });
  }
  scheduler_->at(director_, TimePoint(scenario_.duration), mission::Rank::kInjection, [this] {
    timed_out_ = true;
    note_owed();
    stop_mission();
  });
  if (options_.inject) schedule_timeline();
  schedule_telemetry();
}

void Run::Impl::schedule_timeline() {
  if (options_.from != nullptr) timeline_to_ = options_.from->now;
  if (options_.resume != nullptr) timeline_to_ = Durability::timeline_to(*options_.resume).value_or(timeline_to_);
  for (const project::Injection& injection : scenario_.timeline) {
    if (injection.at <= timeline_to_) continue;
    scheduler_->at(director_, injection.at, mission::Rank::kInjection, [this, &injection] {
      timeline_to_ = std::max(timeline_to_, injection.at);
      steering_.inject(injection);
    });
  }
}

void Run::Impl::start_parts() {
  if (options_.from != nullptr) return;
  for (const auto& model : models_) model->start();
  mission_->start();
}

Result<void> Run::Impl::begin_or_resume() {
  if (options_.resume != nullptr) return execute_again(*options_.resume);
  if (options_.on_begin) options_.on_begin(*this);
  if (durability_) keep_journal(TimePoint{});
  return {};
}

void Run::Impl::finish() {
  steering_.finish();
  if (options_.on_view) options_.on_view(nullptr);
  // Skills elsewhere first: they still publish while they halt. Monitors and observers see what they say.
  if (elsewhere_) elsewhere_->end_speaking();
  // Ended as it is, with no tick in which the mission could have said so.
  if (scheduler_->is_virtual() && (left_behind_ || (interrupted_ && ended_ == TimePoint{}))) ended_ = scheduler_->now();
  // One that is repeated may have completed when it is cut off.
  const bool by_itself = bt::is_completed(mission_->state().root) && !timed_out_ && !interrupted_;
  const TimePoint judged = mission::judged_until(ended_, by_itself);
  monitors_.finish(judged);
  for (const auto& observer : observers()) observer->finish(judged);
  take_decisions();  // those that no actor took any more
  stream_.flush();
  // In a replay everybody has the time to take what there is.
  for (SkillActor* const skill : skills_) {
    if (skill != nullptr && !scheduler_->is_virtual()) skill->tell_untaken();
  }
  stream_.flush();
  if (elsewhere_) elsewhere_->end();
  end_callers();
}

void Run::Impl::fill(RunReport& report) {
  report.mission = mission_->state().root;
  report.reason = mission_->state().reason;
  report.ended = ended_;
  // One that had completed only waited for its leaves to halt.
  report.timed_out = timed_out_ && (scenario_.project.repeat || !bt::is_completed(report.mission));
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
    report.problems = problems_.list();
    report.given_up = given_up_;
  }
  if (stream_.lost() > 0) {
    report.problems.push_back(
        fmt::format("{} observations were lost: monitors and recorder did not keep up", stream_.lost()));
  }
  tell_unasked(report);
  const std::vector<std::string> of_mission = mission_->problems();
  report.problems.insert(report.problems.end(), of_mission.begin(), of_mission.end());
}

void Run::Impl::forget() {
  if (!is_over_) return;
  if (is_again()) end_journal(*options_.resume, recording_name());  // it had ended
  durability_->journal().remove();
}

void Run::Impl::interrupt() {
  interrupted_ = true;
  if (ready_.load() != nullptr && node_watch_) node_watch_->stop_asked();
  const Pace pace = scheduler_->pace();
  if (scheduler_->is_virtual() && !pace.paused && pace.factor <= 0) {
    scheduler_->stop();
  } else if (ready_.load() != nullptr) {
    steering_.ask_to_stop("interrupt");
  }
}

void Run::Impl::end_callers() {
  using Closed = Elsewhere::Closed;
  if (elsewhere_) elsewhere_->close(left_behind_ ? Closed::kButLeftBehind : Closed::kWhole);
}

std::vector<ProcessReport> Run::Impl::processes() {
  std::vector<ProcessReport> all{{"run", static_cast<std::int64_t>(getpid())}};
  if (!elsewhere_) return all;
  const auto others = elsewhere_->processes();
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

std::optional<sim::State> Run::Impl::world() {
  return sim_ ? std::optional<sim::State>(sim_->snapshot()) : std::nullopt;
}

Result<void> Run::Impl::settle(std::chrono::milliseconds patience) {
  if (auto settled = scheduler_->settle(director_, patience); !settled) return settled;
  // Its thread has its data still.
  const std::lock_guard lock(problems_mutex_);
  if (given_up_.empty()) return {};
  return fail("run.cannot-carry", given_up_.front() + ", and what it has begun cannot be taken over");
}

mission::State Run::Impl::capture() {
  mission::State state;
  scheduler_->save(state);
  stream_.save(state);
  steering_.save(state);
  state.tree = mission_->state();
  for (SkillActor* skill : skills_) state.skills.push_back(skill != nullptr ? skill->state() : mission::SkillState());
  for (const auto& model : models_) state.models.push_back(model->state());
  if (sim_) state.world = sim_->snapshot();
  state.monitors = monitors_.memory();
  return state;
}

void Run::Impl::go_on_from(const mission::State& state) {
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

void Run::Impl::end() {
  ended_ = scheduler_->now();
  scheduler_->stop();
}

void Run::Impl::on_decision(const MonitorReport& report) {
  if (options_.on_decision && is_heard(stream_.published())) options_.on_decision(report);
  if (scenario_.stop_when_violated && report.verdict == monitor::Verdict::kViolated) stop_mission();
}

void Run::Impl::given_up(const std::string& why) {
  left_behind_ = true;
  {
    const std::lock_guard lock(problems_mutex_);
    given_up_.push_back(why);
  }
  problem(why);
}

void Run::Impl::problem(const std::string& what) {
  if (is_again()) return;
  std::size_t times = 1;
  {
    const std::lock_guard lock(problems_mutex_);
    times = problems_.add(what);
  }
  // One that comes at every tick is told at the first, the tenth, the hundredth … time.
  if (options_.on_problem && is_power_of_ten(times))
    options_.on_problem(times == 1 ? what : fmt::format("{} ({} times by now)", what, times));
}

Duration Run::Impl::stretched(Duration wall) const {
  return Duration(static_cast<std::int64_t>(static_cast<double>(wall.count()) * scenario_.factor));
}

Run::Run(const project::Plan& plan, RunOptions options) : impl_(std::make_unique<Impl>(plan, std::move(options))) {}
Run::~Run() {
  if (impl_->left_behind()) keep_for_ever(std::shared_ptr<Impl>(std::move(impl_)));
}
RunReport Run::execute() { return impl_->execute(); }
void Run::interrupt() { impl_->interrupt(); }
void Run::forget() { impl_->forget(); }

}  // namespace sentree::runtime
