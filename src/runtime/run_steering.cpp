#include "sentree/runtime/run_steering.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

namespace {

Diagnostic ended() { return {Severity::kError, "steering.ended", "the run has ended", {}}; }

}  // namespace

RunSteering::RunSteering(SteeredRun run) : run_(std::move(run)) {
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
  {
    const std::lock_guard lock(mutex_);
    step_until_ = 0;
    ++until_;
  }
  hold();
  return {};
}

Result<void> RunSteering::resume() {
  if (auto refused = refuse(); !refused) return refused;
  {
    const std::lock_guard lock(mutex_);
    step_until_ = 0;
    ++until_;
  }
  go_on();
  return {};
}

Result<void> RunSteering::step(std::uint64_t ticks) {
  if (auto refused = refuse(); !refused) return refused;
  {
    const std::lock_guard lock(mutex_);
    step_until_ = run_.tick() + std::max<std::uint64_t>(ticks, 1);
    ++until_;
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
}

Result<void> RunSteering::run_until(TimePoint time) {
  const auto done = in_director([this, time]() -> Result<Applied> {
    std::uint64_t mine = 0;
    {
      const std::lock_guard lock(mutex_);
      step_until_ = 0;
      mine = ++until_;
    }
    run_.scheduler->at(run_.director, time, Rank::kInjection, [this, mine] {
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
  const bool unpaced = factor == 0.0 && run_.scheduler->is_virtual();
  if (!unpaced && !(factor >= kFactorMin && factor <= kFactorMax)) {
    return fail("steering.factor", "the speed " + shortest_decimal(factor) + " must be from " +
                                       shortest_decimal(kFactorMin) + " to " + shortest_decimal(kFactorMax) +
                                       (run_.scheduler->is_virtual() ? ", or 0 for as fast as possible" : ""));
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
                "more than " + std::to_string(Scheduler::kInboxMax) + " commands wait; try again when some are done");
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

Result<Steering::Applied> RunSteering::apply(const Intervention& what) {
  auto applied = in_director([this, what] { return execute(what, "studio"); });
  if (applied && what.kind == Intervention::Kind::kStop) (void)resume();
  return applied;
}

void RunSteering::ask_to_stop(const std::string& source) {
  Intervention stop;
  stop.kind = Intervention::Kind::kStop;
  if (run_.scheduler->inject(run_.director, [this, stop, source] { (void)execute(stop, source); })) (void)resume();
}

Result<Steering::Applied> RunSteering::execute(const Intervention& what, const std::string& source) {
  Message message;
  message.source = source;
  message.name = "scenario.injection";
  const auto dot = what.target.rfind('.');
  Applied applied;
  switch (what.kind) {
    case Intervention::Kind::kCall:
      message.target = what.target.substr(0, dot);
      message.data = Map{{"args", what.args}, {"what", what.target}};
      run_.publish(std::move(message));
      applied.outcome = run_.call(what.target.substr(0, dot), what.target.substr(dot + 1), what.args);
      return applied;
    case Intervention::Kind::kKill:
      message.target = what.target;
      message.data = Map{{"process", what.target}, {"what", "kill"}};
      run_.publish(std::move(message));
      run_.kill_process(what.target);
      return applied;
    case Intervention::Kind::kStop:
      message.target = "mission";
      message.data = Map{{"what", "stop"}};
      run_.publish(std::move(message));
      run_.stop();
      return applied;
    default: return fail("steering.kind", "this run cannot do that");
  }
}

std::vector<StandingIntervention> RunSteering::standing() const { return {}; }

std::vector<SteeredPart> RunSteering::parts() const {
  std::vector<SteeredPart> parts;
  for (const ProcessEntry& entry : run_.plan->scenario.processes) {
    parts.push_back({entry.name,
                     !entry.skill.empty()     ? "skill"
                     : !entry.monitor.empty() ? "monitor"
                                              : "component",
                     true});
  }
  return parts;
}

Result<std::string> RunSteering::scenario() const { return fail("steering.kind", "this run cannot be saved"); }

}  // namespace sentree::runtime
