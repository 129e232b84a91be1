#include "sentree/runtime/monitors.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

namespace {

bool matches(const project::GatePlan& gate, std::string_view call) {
  return std::any_of(gate.requests.begin(), gate.requests.end(),
                     [&](const std::string& pattern) { return project::matches_pattern(pattern, call); });
}

}  // namespace

Monitors::Monitors(const project::Plan& plan, Scheduler& scheduler, Stream& stream, Watchdog& watchdog, Replies replies)
    : models_(plan.monitors),
      gates_(plan.gates),
      dispatch_(models_),
      scheduler_(scheduler),
      stream_(stream),
      watchdog_(watchdog),
      replies_(std::move(replies)),
      states_(models_.size()) {
  for (std::size_t i = 0; i < models_.size(); ++i) {
    reports_.emplace_back().name = models_[i].name();
    Entry& entry = entries_.emplace_back();
    entry.watched = std::make_shared<Watched>([this, i](const SourceSpan& script) { give_up(i, script); });
    watchdog_.watch(entry.watched);
  }
}

Message decision_message(const MonitorReport& report) {
  Message message;
  message.source = report.name;
  message.name = "monitor." + std::string(to_string(report.verdict));
  message.data = Map{{"monitor", report.name}, {"state", report.decision->state}};
  return message;
}

std::string_view call_of(const Message& request) {
  constexpr std::string_view kSuffix = ".request";
  const std::string_view name = request.name;
  return name.ends_with(kSuffix) ? name.substr(0, name.size() - kSuffix.size()) : name;
}

bool Monitors::is_gated(std::string_view call) const {
  return std::any_of(gates_.begin(), gates_.end(), [&](const project::GatePlan& gate) { return matches(gate, call); });
}

std::vector<std::string> Monitors::gated() const {
  std::vector<std::string> patterns;
  for (const project::GatePlan& gate : gates_)
    patterns.insert(patterns.end(), gate.requests.begin(), gate.requests.end());
  return patterns;
}

std::optional<mission::Veto> Monitors::judge(const Message& request) const {
  const std::string_view call = call_of(request);
  for (const project::GatePlan& gate : gates_) {
    if (!matches(gate, call)) continue;
    const std::string& name = models_[gate.monitor].name();
    auto* execution = watch(gate.monitor);
    if (!execution) return mission::Veto{name, "it was given up and cannot decide: " + entries_[gate.monitor].why};
    if (auto reason = monitor::veto(models_[gate.monitor], states_[gate.monitor], request, execution))
      return mission::Veto{name, std::move(*reason)};
  }
  return std::nullopt;
}

void Monitors::start() {
  on_own_thread([this] {
    for (; started_ < models_.size(); ++started_) {
      if (auto* execution = watch(started_)) states_[started_] = monitor::start(models_[started_], {}, execution);
      take(started_, {});
    }
    schedule();
  });
}

void Monitors::observe(const Message& message) {
  const monitor::Dispatch::Route& route = dispatch_.route(message.name);
  route_ = &route;
  leaves_.see(message, route.sign);
  for (; observed_ < route.monitors.size(); ++observed_) {
    const std::size_t index = route.monitors[observed_];
    auto* execution = watch(index);
    take(index,
         execution ? monitor::observe(models_[index], states_[index], message, execution) : monitor::Decisions());
  }
  observed_ = 0;
  if (message.kind == MessageKind::kError) count_veto(message);
  schedule();
}

std::span<const std::uint32_t> Monitors::reached() const {
  return route_ != nullptr ? std::span<const std::uint32_t>(route_->monitors) : std::span<const std::uint32_t>();
}

void Monitors::count_veto(const Message& error) {
  const Value* by = error.data.find("vetoed_by");
  if (by == nullptr) return;
  for (MonitorReport& report : reports_) {
    if (report.name == by->text()) ++report.vetoes;
  }
}

void Monitors::finish(TimePoint end) {
  if (scheduler_.is_virtual() && hung()) {
    for (std::size_t i = 0; i < models_.size(); ++i) take(i, {});
    return;
  }
  on_own_thread([this, end] {
    stream_.flush();
    advance(end);
    stream_.flush();
  });
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (reports_[i].verdict == monitor::Verdict::kUndecided && reports_[i].failure.empty())
      reports_[i].standing = monitor::standing(models_[i], states_[i]).text();
  }
}

const monitor::State* Monitors::state(std::size_t index) const {
  return index >= states_.size() || entries_[index].given_up ? nullptr : &states_[index];
}

std::optional<std::string> Monitors::hung() const {
  for (const Entry& entry : entries_) {
    if (entry.given_up) return entry.why;
  }
  return std::nullopt;
}

void Monitors::on_own_thread(const std::function<void()>& work) {
  for (bool done = false; !done;) {
    LeavableThread thread;
    {
      const std::lock_guard lock(own_mutex_);
      own_thread_ = &thread;
    }
    done = thread.run(work);
    const std::lock_guard lock(own_mutex_);
    own_thread_ = nullptr;
  }
}

scxml::ExecutionWatch* Monitors::watch(std::size_t index) const {
  const Entry& entry = entries_[index];
  if (entry.given_up) return nullptr;
  entry.watched->in_this_thread();
  return &entry.watched->execution();
}

// In the watchdog's thread.
void Monitors::give_up(std::size_t index, const SourceSpan& script) {
  Entry& entry = entries_[index];
  entry.why = watchdog_.reason(script, "monitor " + models_[index].name());
  entry.given_up = true;
  replies_.given_up(entry.why);
  {
    const std::lock_guard lock(own_mutex_);
    if (own_thread_) {
      own_thread_->leave();
      return;
    }
  }
  scheduler_.abandon(stream_.actor(), entry.why);
  if (!scheduler_.is_virtual()) scheduler_.post(stream_.actor(), [this] { go_on(); });
}

void Monitors::go_on() {
  if (advancing_to_) advance_rest();
  stream_.resume();
  schedule();
}

void Monitors::advance(TimePoint now) {
  advancing_to_ = now;
  advance_rest();
}

void Monitors::advance_rest() {
  for (; advanced_ < models_.size(); ++advanced_) {
    auto* execution = watch(advanced_);
    take(advanced_, execution ? monitor::advance(models_[advanced_], states_[advanced_], *advancing_to_, execution)
                              : monitor::Decisions());
  }
  advanced_ = 0;
  advancing_to_.reset();
}

void Monitors::take(std::size_t index, monitor::Decisions decisions) {
  MonitorReport& report = reports_[index];
  const Entry& entry = entries_[index];
  if (report.failure.empty()) {
    if (entry.given_up)
      report.failure = entry.why;
    else if (states_[index].failure)
      report.failure = to_string(*states_[index].failure);
    if (!report.failure.empty() && !(scheduler_.is_virtual() && entry.given_up)) {
      Message message;
      message.kind = MessageKind::kEvent;
      message.source = report.name;
      message.name = "monitor.given_up";
      message.data = Map{{"monitor", report.name}, {"reason", report.failure}};
      stream_.publish(std::move(message));
    }
  }
  for (monitor::Decision& decision : decisions) {
    report.verdict = decision.verdict;
    if (decision.verdict == monitor::Verdict::kViolated) report.violations = decision.number;
    report.leaf = leaves_.active();
    report.explanation = monitor::explain(models_[index], decision, report.leaf);
    report.decision = std::move(decision);
    stream_.publish(decision_message(report));
    replies_.decided(report);
  }
  if (replies_.stepped) replies_.stepped(index);
}

void Monitors::schedule() {
  TimePoint next = kNever;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (!entries_[i].given_up) next = std::min(next, monitor::next_timer(models_[i], states_[i]));
  }
  if (next == kNever || next >= wake_) return;
  wake_ = next;
  // One nanosecond later: an observation at the same instant wins over a timer.
  scheduler_.at(stream_.actor(), next + Duration(1), mission::Rank::kTimer, [this, next] {
    if (wake_ != next) return;
    wake_ = kNever;
    stream_.flush();
    advance(next);
    schedule();
  });
}

}  // namespace sentree::runtime
