#include "sentree/runtime/detail/run_impl.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "sentree/mission/memory_elsewhere.h"
#include "sentree/runtime/detail/decision_record.h"

namespace sentree::runtime {

// A run that was given no way to parts elsewhere has none.
std::optional<std::string> Run::Impl::refuse_elsewhere() const {
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

std::optional<std::string> Run::Impl::reach_elsewhere() {
  for (const project::ObserverPlan& observer : plan_.observers) {
    if (observer.is_monitor) remote_reports_.emplace_back().name = observer.name;
  }
  if (!options_.elsewhere) return refuse_elsewhere();
  elsewhere_ = options_.elsewhere(
      {.plan = plan_,
       .publisher = publisher_,
       .publish = [this](Message message) { stream_.publish(std::move(message)); },
       .problem = [this](const std::string& what) { problem(what); },
       .happened = [this](const ProcessEvent& event) { on_process(event); },
       .decided = [this](const std::string& name,
                         const monitor::Decision& decision) { on_decided_elsewhere(name, decision); },
       .journal = durability_ ? options_.durable->journal : std::filesystem::path(),
       .left_behind = options_.resume != nullptr ? options_.resume->parts : List(),
       .only_looks = options_.on_reached != nullptr});
  publisher_.set_elsewhere(elsewhere_.get());
  if (auto error = elsewhere_->start(services_)) return error;
  keep_parts();
  if (durability_) return recall_observers();
  return std::nullopt;
}

const std::vector<std::unique_ptr<Observer>>& Run::Impl::observers() const {
  static const std::vector<std::unique_ptr<Observer>> kNone;
  return elsewhere_ ? elsewhere_->observers() : kNone;
}

void Run::Impl::keep_parts() {
  if (durability_) durability_->journal().parts(elsewhere_->parts());
}

void Run::Impl::on_process(const ProcessEvent& event) {
  if (options_.resume != nullptr && ready_.load() == nullptr) {
    const std::lock_guard lock(problems_mutex_);
    died_with_run_.push_back(event);
    return;
  }
  if (event.kind == ProcessEvent::Kind::kExited) problem(fmt::format("process {} ended: {}", event.process, event.how));
  if (event.kind == ProcessEvent::Kind::kGivenUp)
    problem(fmt::format("process {} ended too often and is not started again", event.process));
  observe_process(event);
}

void Run::Impl::tell_died_with_run() {
  std::vector<ProcessEvent> events;
  {
    const std::lock_guard lock(problems_mutex_);
    events.swap(died_with_run_);
  }
  for (const ProcessEvent& event : events) {
    if (event.kind != ProcessEvent::Kind::kRestarted) {
      observe_process(event);
      continue;
    }
    const auto entry = std::find_if(scenario_.processes.begin(), scenario_.processes.end(),
                                    [&](const project::ProcessEntry& each) { return each.name == event.process; });
    const bool begins_anew = entry != scenario_.processes.end() && !entry->component.empty();
    problem(fmt::format("process {} ended while nobody was there and is started again at {:.3f} s: {}", event.process,
                        seconds(scheduler_->now()),
                        begins_anew ? "it begins anew, and what it had done and had in mind is lost"
                                    : "it goes on where it was, since the run keeps that"));
    observe_process(event);
  }
}

void Run::Impl::observe_process(const ProcessEvent& event) {
  take_observations();
  Message message;
  message.source = "run";
  message.target = event.process;
  message.data = Map{{"process", event.process}};
  switch (event.kind) {
    case ProcessEvent::Kind::kExited:
      message.name = "process.exited";
      message.data = Map{{"process", event.process}, {"pid", event.pid}, {"how", event.how}};
      break;
    case ProcessEvent::Kind::kRestarted:
      message.name = "process.restarted";
      message.data = Map{{"process", event.process}, {"pid", event.pid}};
      break;
    case ProcessEvent::Kind::kGivenUp: message.name = "process.given_up"; break;
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

void Run::Impl::take_observations() {
  if (elsewhere_) elsewhere_->take_observations();
}

// In the observer's thread.
void Run::Impl::on_decided_elsewhere(const std::string& name, const monitor::Decision& decision) {
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
}

bool Run::Impl::is_decided_elsewhere() {
  const std::lock_guard lock(problems_mutex_);
  return !decided_elsewhere_.empty();
}

void Run::Impl::take_decisions() {
  std::vector<std::pair<std::string, monitor::Decision>> decisions;
  {
    const std::lock_guard lock(problems_mutex_);
    decisions.swap(decided_elsewhere_);
  }
  for (const auto& [name, decision] : decisions) take_decision(name, decision);
}

void Run::Impl::take_decision(const std::string& name, const monitor::Decision& decision) {
  const auto report = note_decision(name, decision);
  if (!report) return;
  if (durability_) durability_->decided(name, decision);
  stream_.publish(decision_message(*report));
  on_decision(*report);
}

std::optional<MonitorReport> Run::Impl::note_decision(const std::string& name, const monitor::Decision& decision) {
  const std::lock_guard lock(problems_mutex_);
  const auto slot = std::find_if(remote_reports_.begin(), remote_reports_.end(),
                                 [&](const MonitorReport& known) { return known.name == name; });
  if (slot == remote_reports_.end() || (durability_ && slot->decision)) return std::nullopt;
  slot->verdict = decision.verdict;
  slot->decision = decision;
  if (durability_) slot->gaps = gaps_within(decision, durability_->gaps());
  return *slot;
}

// The run when it was at rest, and what parts elsewhere have said since.
struct Run::Impl::Gathered {
  struct Part {
    std::size_t index = 0;
    ToldMemory memory;
    TimePoint at{};  // half-way between question and answer
  };
  mission::State state;
  std::mutex mutex;  // of what follows
  std::vector<Part> parts;
  std::size_t asked = static_cast<std::size_t>(-1);  // until that is known
};

void Run::Impl::capture_at_rest(CaptureTold told) {
  const auto gathered = std::make_shared<Gathered>();
  if (!scheduler_->look_at_rest(director_, [&] { gathered->state = capture(); }))
    return told(tl::unexpected(Uncaptured{.is_at_work = true, .why_never = {}}));
  const TimePoint asked = scheduler_->now();
  const auto end = [this, gathered, told] {
    scheduler_->post(director_, [this, gathered, told] { told(whole(*gathered)); });
  };
  std::size_t count = 0;
  if (elsewhere_ && !durability_) {
    count = elsewhere_->ask_memories([this, gathered, asked, end](std::size_t part, ToldMemory memory) {
      const TimePoint now = scheduler_->now();
      const std::lock_guard lock(gathered->mutex);
      gathered->parts.push_back({part, std::move(memory), asked + (now - asked) / 2});
      if (gathered->parts.size() == gathered->asked) end();
    });
  }
  if (count == 0) return told(std::move(gathered->state));
  const std::lock_guard lock(gathered->mutex);
  gathered->asked = count;
  if (gathered->parts.size() == count) end();
}

tl::expected<mission::State, RunInside::Uncaptured> Run::Impl::whole(Gathered& gathered) {
  const tl::unexpected at_work(Uncaptured{.is_at_work = true, .why_never = {}});
  // A part that has gone on meanwhile is not what the others knew of.
  take_observations();
  mission::State& state = gathered.state;
  if (stream_.published() != state.published) return at_work;
  const std::lock_guard lock(gathered.mutex);
  for (const Gathered::Part& part : gathered.parts) {
    if (part.memory.kind == ToldMemory::Kind::kNotNow) return at_work;
    const bool is_world = part.index == Elsewhere::kSimulator;
    const auto never = [&](const std::string& why) {
      return tl::unexpected(Uncaptured{
          .is_at_work = false,
          .why_never = fmt::format("{}: {}", is_world ? "the simulator" : plan_.leaves[part.index].name, why)});
    };
    if (part.memory.kind == ToldMemory::Kind::kNever) return never("it does not say what it remembers");
    if (!is_world && !plan_.leaves[part.index].chart) return never("the project has no chart of it");
    const auto recalled = is_world ? mission::recall_world(plan_, part.memory.octets, part.at, state)
                                   : mission::recall_skill(plan_, part.index, part.memory.octets, part.at, state);
    if (!recalled) return never(recalled.error().message);
  }
  if (plan_.world && !state.world)
    return tl::unexpected(Uncaptured{.is_at_work = false, .why_never = "the simulator is none of the run's processes"});
  return std::move(state);
}

}  // namespace sentree::runtime
