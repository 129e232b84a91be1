#include "sentree/runtime/detail/run_steering.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/project/scenario_text.h"
#include "sentree/runtime/local_skill.h"

namespace sentree::runtime {

namespace {

using namespace project::intervention;

Diagnostic ended() { return {Severity::kError, "steering.ended", "the run has ended", {}}; }

}  // namespace

// A port of a simulated service, while that is not killed.
class RunSteering::GuardedPort final : public ServicePort {
 public:
  GuardedPort(std::string service, const Down& service_down, const Down& all_down, std::unique_ptr<ServicePort> port)
      : service_(std::move(service)), service_down_(service_down), all_down_(all_down), port_(std::move(port)) {}
  void call(const idl::Method& method, Value args, Done done) override {
    if (service_down_.killed || all_down_.killed)
      done(killed(service_));
    else
      port_->call(method, std::move(args), std::move(done));
  }
  bool take(std::size_t leaf, const mission::Shared<mission::Call>& call) override {
    return !service_down_.killed && !all_down_.killed && port_->take(leaf, call);
  }
  static mission::CallOutcome killed(const std::string& service) {
    return mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable,
                                        fmt::format("service {} was killed", service));
  }

 private:
  std::string service_;
  const Down& service_down_;
  const Down& all_down_;
  std::unique_ptr<ServicePort> port_;
};

RunSteering::RunSteering(SteeredRun run)
    : run_(std::move(run)),
      scope_(scope_of(*run_.plan)),
      standing_(run_.plan->scenario.delays),
      killed_skills_(run_.plan->leaves.size(), 0) {
  for (const project::LeafPlan& leaf : run_.plan->leaves) chart_names_.push_back("skill:" + leaf.name);
  for (const auto& [name, service] : run_.plan->services) down_[name];
  down_[std::string(project::kSimulatorPart)];
  run_.scheduler->on_standing([this] {
    const std::lock_guard lock(mutex_);
    changed_.notify_all();
  });
}

Result<void> RunSteering::refuse() const {
  const std::lock_guard lock(mutex_);
  if (ended_) return tl::unexpected(ended());
  return {};
}

// What `step` and `run_until` had in mind is void.
void RunSteering::change_mind() {
  const std::lock_guard lock(mutex_);
  step_until_ = 0;
  ++until_;
  stopped_at_ = 0;
  stopped_what_.clear();
}

void RunSteering::go_on() {
  Pace pace = run_.scheduler->pace();
  pace.paused = false;
  run_.scheduler->set_pace(pace);
}

void RunSteering::hold() {
  Pace pace = run_.scheduler->pace();
  pace.paused = true;
  run_.scheduler->set_pace(pace);
}

Steering::Status RunSteering::status() const {
  const Pace pace = run_.scheduler->pace();
  const std::lock_guard lock(mutex_);
  Status status;
  status.state = ended_ ? State::kEnded : pace.paused ? State::kPaused : State::kRunning;
  status.factor = pace.factor;
  status.breakpoint = stopped_at_;
  status.stopped_at = stopped_what_;
  return status;
}

Steering::Status RunSteering::wait_paused() {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || run_.scheduler->standing(); });
  }
  return status();
}

Result<void> RunSteering::pause() {
  if (auto refused = refuse(); !refused) return refused;
  change_mind();
  hold();
  return {};
}

Result<void> RunSteering::resume() {
  if (auto refused = refuse(); !refused) return refused;
  change_mind();
  go_on();
  return {};
}

Result<void> RunSteering::step(std::uint64_t ticks) {
  if (auto refused = refuse(); !refused) return refused;
  {
    const std::lock_guard lock(mutex_);
    // Behind the steps that it still owes.
    step_until_ = std::max(step_until_, run_.tick()) + std::max<std::uint64_t>(ticks, 1);
    ++until_;
    stopped_at_ = 0;
    stopped_what_.clear();
  }
  go_on();
  return {};
}

void RunSteering::tick_done(std::uint64_t tick) {
  {
    const std::lock_guard lock(mutex_);
    if (step_until_ == 0 || tick < step_until_) return;
    step_until_ = 0;
  }
  hold();
  // Another step may have been asked for just before that.
  const std::lock_guard lock(mutex_);
  if (step_until_ != 0) go_on();
}

Result<void> RunSteering::run_until(TimePoint time) {
  const auto done = in_director([this, time]() -> Result<Applied> {
    std::uint64_t mine = 0;
    {
      const std::lock_guard lock(mutex_);
      step_until_ = 0;
      mine = ++until_;
      stopped_at_ = 0;
      stopped_what_.clear();
    }
    run_.scheduler->at(run_.director, time, mission::Rank::kInjection, [this, mine] {
      {
        const std::lock_guard lock(mutex_);
        if (until_ != mine) return;
      }
      hold();
    });
    go_on();
    return Applied{};
  });
  if (!done) return tl::unexpected(done.error());
  return {};
}

Result<void> RunSteering::set_factor(double factor) {
  if (auto refused = refuse(); !refused) return refused;
  const bool unpaced = factor == 0.0 && run_.plan->scenario.virtual_time;
  if (!unpaced && !(factor >= kFactorMin && factor <= kFactorMax)) {
    return fail("steering.factor",
                fmt::format("the speed {} must be from {} to {}{}", shortest_decimal(factor),
                            shortest_decimal(kFactorMin), shortest_decimal(kFactorMax),
                            run_.plan->scenario.virtual_time ? ", or 0 for as fast as possible" : ""));
  }
  Pace pace = run_.scheduler->pace();
  pace.factor = factor;
  run_.scheduler->set_pace(pace);
  return {};
}

Result<Steering::Applied> RunSteering::in_director(std::function<Result<Applied>()> work) {
  if (run_.scheduler->is_inside())
    return fail("steering.inside", "a listener or callback of the run cannot wait for the run itself");
  const auto answer = std::make_shared<Answer>();
  {
    // `finish` comes either before this and is seen, or after it and sees the answer.
    const std::lock_guard lock(mutex_);
    if (ended_) return tl::unexpected(ended());
    std::erase_if(open_, [](const auto& open) { return open.expired(); });
    open_.push_back(answer);
  }
  const bool taken = run_.scheduler->inject(run_.director, [answer, work = std::move(work)] {
    auto result = work();
    const std::lock_guard lock(answer->mutex);
    if (!answer->result) answer->result = std::move(result);
    answer->changed.notify_all();
  });
  if (!taken) {
    return fail("steering.busy",
                fmt::format("more than {} commands wait; try again when some are done", Scheduler::kInboxMax));
  }
  std::unique_lock lock(answer->mutex);
  answer->changed.wait(lock, [&] { return answer->result.has_value(); });
  return *answer->result;
}

void RunSteering::finish() {
  std::vector<std::weak_ptr<Answer>> open;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    open.swap(open_);
    changed_.notify_all();
  }
  for (const auto& weak : open) {
    const auto answer = weak.lock();
    if (!answer) continue;
    const std::lock_guard lock(answer->mutex);
    if (!answer->result) answer->result = tl::unexpected(ended());
    answer->changed.notify_all();
  }
}

Result<Steering::Applied> RunSteering::apply_for(const project::Intervention& what, const std::string& source) {
  if (auto checked = check_intervention(what, scope_); !checked) return tl::unexpected(checked.error());
  auto applied = in_director([this, what, source] { return execute(what, source, By::kPerson); });
  if (applied && std::holds_alternative<Stop>(what)) (void)resume();
  return applied;
}

void RunSteering::ask_to_stop(const std::string& source) {
  if (run_.scheduler->inject(run_.director, [this, source] { (void)execute(Stop{}, source, By::kPerson); }))
    (void)resume();
}

void RunSteering::inject(const project::Injection& injection) {
  const auto applied = execute(injection.what, injection.source, By::kTimeline);
  const std::string place = fmt::format("{}: ", to_string(injection.span));
  if (!applied) {
    run_.problem(place + applied.error().message);
  } else if (const auto* call = std::get_if<Call>(&injection.what)) {
    const mission::CallOutcome& outcome = applied->outcome;
    if (outcome.ok && (outcome.result.as_string() == nullptr || outcome.result.text() == "OK")) return;
    run_.problem(
        fmt::format("{}{} answered {}", place, call->method, outcome.ok ? to_json(outcome.result) : outcome.message));
  }
}

Result<Steering::Applied> RunSteering::execute(const project::Intervention& what, const std::string& source, By by) {
  if (by == By::kPerson) {
    {
      const std::lock_guard lock(mutex_);
      if (done_.size() >= kInterventionsMax)
        return fail("steering.too-many", fmt::format("a run takes no more than {} interventions", kInterventionsMax));
    }
    if (run_.keep) run_.keep(what, source);
  }
  by_ = by;
  auto applied = mission::apply(what, source, *this);
  if (applied && by == By::kPerson) {
    const std::lock_guard lock(mutex_);
    done_.push_back({.at = now(), .what = what, .source = source, .span = {}});
  }
  return applied;
}

Result<mission::CallOutcome> RunSteering::call_service(const Call& what) {
  const auto dot = what.method.rfind('.');
  const auto down = down_.find(what.method.substr(0, dot));
  if (down != down_.end() && (down->second.killed || down_.find(project::kSimulatorPart)->second.killed))
    return GuardedPort::killed(down->first);
  return run_.call(what.method.substr(0, dot), what.method.substr(dot + 1), what.args);
}

std::optional<std::size_t> RunSteering::leaf_here(const std::string& part) const {
  const auto& leaves = run_.plan->leaves;
  for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
    if (leaves[leaf].name == part && run_.skill(leaf) != nullptr) return leaf;
  }
  return std::nullopt;
}

bool RunSteering::is_process(const std::string& part) const {
  const auto& processes = run_.plan->scenario.processes;
  return std::any_of(processes.begin(), processes.end(), [&](const auto& process) { return process.name == part; });
}

std::optional<bool> RunSteering::is_killed(const std::string& part) const {
  if (is_process(part)) return false;
  if (const auto leaf = leaf_here(part)) return killed_skills_[*leaf] != 0;
  const auto down = down_.find(part);
  return down != down_.end() ? std::optional(down->second.killed.load()) : std::nullopt;
}

void RunSteering::kill_part(const std::string& part, TimePoint asked) {
  if (is_process(part)) {
    run_.kill_process(part);
  } else if (const auto leaf = leaf_here(part)) {
    killed_skills_[*leaf] = 1;
    run_.kill_skill(*leaf, asked);
  } else {
    down_.find(part)->second.killed = true;
  }
}

void RunSteering::restart_part(const std::string& part, TimePoint asked) {
  if (const auto leaf = leaf_here(part)) {
    killed_skills_[*leaf] = 0;
    run_.restart_skill(*leaf, asked);
  } else {
    down_.find(part)->second.killed = false;
  }
}

Result<std::uint64_t> RunSteering::next_id() {
  return standing_.with([](mission::Faults& faults) { return faults.next_id(); });
}

void RunSteering::stand(std::uint64_t id, const project::Intervention& what) {
  const auto* breakpoint = std::get_if<Breakpoint>(&what);
  if (by_ == By::kPerson && breakpoint != nullptr) {
    const std::lock_guard lock(mutex_);
    holding_.insert(id);
  }
  standing_.with([&](mission::Faults& faults) { faults.add(id, what); });
  if (breakpoint != nullptr && breakpoint->point == Breakpoint::Point::kState) prime(*breakpoint);
}

Result<void> RunSteering::end_standing(std::uint64_t id) {
  return standing_.with([&](mission::Faults& faults) { return faults.clear(id); });
}

void RunSteering::prime(const Breakpoint& breakpoint) {
  for (std::size_t leaf = 0; leaf < chart_names_.size(); ++leaf) {
    SkillActor* skill = chart_names_[leaf] == breakpoint.target ? run_.skill(leaf) : nullptr;
    if (skill == nullptr) continue;
    skill->inspect([this, leaf](const Skill* shown) {
      if (shown != nullptr) skill_stepped(leaf, *shown);
    });
  }
  const auto& models = run_.plan->monitors;
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (breakpoint.target == "monitor:" + models[i].name())
      run_.scheduler->post(run_.observer, [this, i] { monitor_stepped(i); });
  }
}

std::unique_ptr<ServicePort> RunSteering::guard(const std::string& service, std::string_view part,
                                                std::unique_ptr<ServicePort> port) {
  const Down& own = down_.find(service)->second;
  return std::make_unique<GuardedPort>(service, own, part.empty() ? own : down_.find(part)->second, std::move(port));
}

void RunSteering::save(mission::State& state) const {
  state.faults = standing_.get();
  for (const auto& [name, down] : down_) {
    if (down.killed) state.down.insert(name);
  }
}

void RunSteering::load(const mission::State& state) {
  standing_.set(state.faults);
  for (auto& [name, down] : down_) down.killed = state.down.contains(name);
  for (std::size_t leaf = 0; leaf < state.skills.size(); ++leaf)
    killed_skills_[leaf] = state.skills[leaf].phase == mission::SkillPhase::kKilled ? 1 : 0;
}

void RunSteering::observed(const Message& message) {
  if (!standing_.any()) return;
  const auto hits = standing_.with([&](mission::Faults& faults) { return faults.reached_by(message); });
  if (hits.empty()) return;
  const Value* to = message.data.find("to");
  reached(hits, message.name == "node.status" && to != nullptr ? fmt::format("{} is {}", message.source, to->text())
                                                               : message.name);
}

void RunSteering::skill_stepped(std::size_t leaf, const Skill& skill) {
  if (!standing_.any()) return;
  std::string entered;
  const auto is_active = [&](const std::string& state) {
    const auto index = skill.chart().find(state);
    const bool active = skill.running() && index && skill.session().configuration().contains(*index);
    if (active) entered = state;
    return active;
  };
  const auto hits =
      standing_.with([&](mission::Faults& faults) { return faults.reached_in(chart_names_[leaf], is_active); });
  if (!hits.empty()) reached(hits, fmt::format("{} entered {}", chart_names_[leaf], entered));
}

void RunSteering::monitor_stepped(std::size_t index) {
  if (!standing_.any()) return;
  const monitor::State* state = run_.monitors().state(index);
  if (state == nullptr) return;
  const monitor::Model& model = run_.plan->monitors[index];
  const std::string name = "monitor:" + model.name();
  std::string entered;
  const auto is_active = [&](const std::string& id) {
    const auto found = model.chart().find(id);
    const bool active = found && state->session.configuration().contains(*found);
    if (active) entered = id;
    return active;
  };
  const auto hits = standing_.with([&](mission::Faults& faults) { return faults.reached_in(name, is_active); });
  if (!hits.empty()) reached(hits, fmt::format("{} entered {}", name, entered));
}

void RunSteering::reached(const std::vector<std::uint64_t>& breakpoints, const std::string& what) {
  for (const std::uint64_t id : breakpoints) {
    bool holds = false;
    {
      const std::lock_guard lock(mutex_);
      holds = holding_.contains(id);
      if (holds && stopped_at_ == 0) {
        stopped_at_ = id;
        stopped_what_ = what;
        step_until_ = 0;
        ++until_;
      }
    }
    if (holds) hold();
    Message message;
    message.source = "scenario";
    message.name = "scenario.breakpoint";
    message.data = Map{{"breakpoint", static_cast<std::int64_t>(id)}, {"what", what}};
    run_.publish(std::move(message));
  }
}

std::vector<mission::StandingIntervention> RunSteering::standing() const { return standing_.get().list(); }

std::vector<project::SteeredPart> RunSteering::parts() const { return parts_of(scope_); }

Result<std::string> RunSteering::scenario() const {
  std::vector<project::Injection> done;
  {
    const std::lock_guard lock(mutex_);
    done = done_;
  }
  return scenario_text(run_.plan->scenario, done);
}

}  // namespace sentree::runtime
