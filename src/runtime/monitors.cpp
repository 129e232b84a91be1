#include "sentree/runtime/monitors.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/monitor/quick.h"

namespace sentree::runtime {

namespace {

bool matches(const project::GatePlan& gate, std::string_view call) {
  return std::any_of(gate.requests.begin(), gate.requests.end(),
                     [&](const std::string& pattern) { return project::matches_pattern(pattern, call); });
}

}  // namespace

Monitors::Monitors(const project::Plan& plan, Scheduler& scheduler, Stream& stream, Watchdog& watchdog, Replies replies)
    : gates_(plan.gates),
      set_(plan.monitors),
      keeps_(std::any_of(plan.monitors.begin(), plan.monitors.end(), monitor::keeps_observations)),
      scheduler_(scheduler),
      stream_(stream),
      watchdog_(watchdog),
      replies_(std::move(replies)) {
  for (std::size_t i = 0; i < set_.models().size(); ++i) {
    reports_.emplace_back().name = set_.models()[i].name();
    Entry& entry = entries_.emplace_back();
    entry.watched = std::make_shared<Watched>([this, i](const SourceSpan& script) { give_up(i, script); });
    watchdog_.watch(entry.watched);
  }
}

Message decision_message(const MonitorReport& report) {
  Message message;
  message.source = report.name;
  message.name = fmt::format("monitor.{}", to_string(report.verdict));
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
    const monitor::Model& model = set_.models()[gate.monitor];
    const Entry& entry = entries_[gate.monitor];
    if (entry.given_up) return mission::Veto{model.name(), "it was given up and cannot decide: " + entry.why};
    if (auto reason = monitor::veto(model, set_.state(gate.monitor), request, &watched(gate.monitor)))
      return mission::Veto{model.name(), std::move(*reason)};
  }
  return std::nullopt;
}

void Monitors::start() {
  on_own_thread([this] {
    set_.start({}, *this);
    schedule();
  });
}

void Monitors::recall(monitor::MonitorSet::Memory memory) {
  set_.recall(std::move(memory), *this);
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    const monitor::State& state = set_.state(i);
    reports_[i].verdict = state.verdict;
    reports_[i].violations = state.trail.violations;
    if (state.failure()) reports_[i].failure = to_string(*state.failure());  // that was told before
  }
  schedule();
}

void Monitors::observe(const Message& message) {
  // Monitors keep what may be part of a witness; what none of them listens to, or none keeps, is not copied.
  if (!keeps_ || set_.listeners(message.name, message.source).empty())
    set_.observe(monitor::Observation(monitor::Observation(), &message), *this);
  else
    set_.observe(std::make_shared<const Message>(message), *this);
  reached_ = set_.listeners(message.name, message.source);
  if (message.kind == MessageKind::kError) count_veto(message);
  schedule();
}

bool Monitors::wants(const std::string& name) {
  // Where nothing is explained, nobody asks which leaf was at work.
  if (keeps_ && monitor::LeafTracker::sign(name) != monitor::LeafTracker::Sign::kNone) return true;
  constexpr std::string_view kRequest = ".request";
  if (name.ends_with(kRequest) && is_gated(std::string_view(name).substr(0, name.size() - kRequest.size())))
    return true;
  const bool may_be_veto = name.ends_with(".error") || name.ends_with(".late");
  return may_be_veto || set_.hears(name);
}

void Monitors::pass(TimePoint now) {
  reached_ = {};
  if (set_.next_timer() >= now) return;
  set_.advance(now - Duration(1), *this);
  schedule();
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
    tell_given_up();
    return;
  }
  on_own_thread([this, end] {
    tell_given_up();
    stream_.flush();
    advance(end);
    stream_.flush();
  });
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    if (!reports_[i].failure.empty()) continue;
    const monitor::State& state = set_.state(i);
    reports_[i].vacuity = monitor::vacuity(set_.models()[i], state);
    if (reports_[i].verdict != monitor::Verdict::kUndecided) continue;
    reports_[i].standing = monitor::standing(set_.models()[i], state).text();
  }
}

const monitor::State* Monitors::state(std::size_t index) const {
  return index >= entries_.size() || entries_[index].given_up ? nullptr : &set_.state(index);
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

scxml::ExecutionWatch& Monitors::watched(std::size_t index) const {
  entries_[index].watched->in_this_thread();
  return entries_[index].watched->execution();
}

// In the watchdog's thread.
void Monitors::give_up(std::size_t index, const SourceSpan& script) {
  Entry& entry = entries_[index];
  entry.why = watchdog_.reason(script, "monitor " + reports_[index].name);
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

// Also of those whose script did not end while they judged a request, which is no step of theirs.
void Monitors::tell_given_up() {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].given_up && reports_[i].failure.empty()) stepped(i, {});
  }
}

void Monitors::go_on() {
  tell_given_up();
  if (advancing_to_) advance(*advancing_to_);
  stream_.resume();
  schedule();
}

std::vector<Gap> gaps_within(const monitor::Decision& decision, const std::vector<Gap>& gaps) {
  const TimePoint begun = decision.witness.empty() ? TimePoint{} : decision.witness.front().time;
  std::vector<Gap> within;
  for (const Gap& gap : gaps) {
    if (gap.from <= decision.at && begun <= gap.to) within.push_back(gap);
  }
  return within;
}

void Monitors::advance(TimePoint now) {
  advancing_to_ = now;
  set_.advance(now, *this);
  advancing_to_.reset();
}

void Monitors::stepped(std::size_t index, monitor::Decisions decisions) {
  MonitorReport& report = reports_[index];
  const Entry& entry = entries_[index];
  if (report.failure.empty()) {
    if (entry.given_up)
      report.failure = entry.why;
    else if (set_.state(index).failure())
      report.failure = to_string(*set_.state(index).failure());
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
    report.leaf = set_.leaf();
    report.explanation = monitor::explain(set_.models()[index], decision, report.leaf);
    report.gaps = gaps_within(decision, gaps_);
    report.decision = std::move(decision);
    stream_.publish(decision_message(report));
    replies_.decided(report);
  }
  if (replies_.stepped) replies_.stepped(index);
}

void Monitors::schedule() {
  const TimePoint next = set_.next_timer();
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
