#include "sentree/monitor/monitor_set.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <set>

#include <fmt/format.h>

#include "sentree/monitor/detail/model.h"
#include "sentree/scxml/step.h"

namespace sentree::monitor {

LeafTracker::Sign LeafTracker::sign(std::string_view observation) {
  if (observation.ends_with(".tick.request")) return Sign::kTicked;
  if (observation.ends_with(".tick.reply")) return Sign::kAnswered;
  if (observation.ends_with(".halt.reply") || observation.ends_with(".tick.error") || observation.ends_with(".cancel"))
    return Sign::kEnded;
  return Sign::kNone;
}

void LeafTracker::see(const Message& message, Sign sign) {
  if (sign == Sign::kNone) return;
  // Requests go to the leaf, answers come from it.
  const std::string leaf = message.name.substr(0, message.name.rfind('.', message.name.rfind('.') - 1));
  if (sign == Sign::kTicked) {
    ticked_ = leaf;
    return;
  }
  if (ticked_ == leaf) ticked_.clear();
  const Value* status = message.data.find("status");
  if (sign == Sign::kAnswered && status != nullptr && status->text() == "RUNNING")
    note_running(leaf);
  else
    forget_running(leaf);
}

void LeafTracker::note_running(std::string leaf) {
  const auto [since, is_new] = running_.try_emplace(leaf, ++answers_);
  if (is_new) {
    latest_.emplace_hint(latest_.end(), answers_, std::move(leaf));
    return;
  }
  auto moved = latest_.extract(since->second);
  moved.key() = since->second = answers_;
  latest_.insert(latest_.end(), std::move(moved));
}

void LeafTracker::forget_running(const std::string& leaf) {
  const auto since = running_.find(leaf);
  if (since == running_.end()) return;
  latest_.erase(since->second);
  running_.erase(since);
}

std::vector<std::string> LeafTracker::running() const {
  std::vector<std::string> leaves;
  for (const auto& [since, leaf] : latest_) leaves.push_back(leaf);
  return leaves;
}

const std::string& LeafTracker::active() const {
  static const std::string kNone;
  if (!ticked_.empty()) return ticked_;
  return latest_.empty() ? kNone : latest_.rbegin()->second;
}

void Dispatch::add(Targets& targets, std::size_t monitor) const {
  targets.monitors.push_back(static_cast<std::uint32_t>(monitor));
  targets.projection.add(Access::parts(models_[monitor]).projection);
}

void Dispatch::plan(Targets& targets, const std::string& observation) const {
  scxml::PlainPaths paths;
  for (const std::uint32_t monitor : targets.monitors) {
    const Model::Parts& parts = Access::parts(models_[monitor]);
    targets.plans.push_back(parts.renaming ? std::nullopt
                                           : scxml::PlainPlan::make(parts.spec.chart, observation, paths));
  }
  targets.reader = Reader(paths);
}

Dispatch::Route Dispatch::make(const std::string& observation) const {
  Route route;
  route.sign = LeafTracker::sign(observation);
  std::set<std::string> sources;
  for (const Model& model : models_) {
    if (const auto only = model.listens_to_only(observation)) sources.insert(only->begin(), only->end());
  }
  for (const std::string& source : sources) route.by_source[source];
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (!models_[i].listens_to(observation)) continue;
    const auto only = models_[i].listens_to_only(observation);
    if (!only) add(route.any, i);
    for (auto& [source, targets] : route.by_source) {
      if (!only || std::find(only->begin(), only->end(), source) != only->end()) add(targets, i);
    }
  }
  if (routes_.size() >= kPlannedRoutesMax) return route;
  plan(route.any, observation);
  for (auto& [source, targets] : route.by_source) plan(targets, observation);
  return route;
}

Dispatch::Route& Dispatch::look_up(const std::string& observation, Known*& found) {
  auto known = routes_.find(observation);
  if (known == routes_.end() && routes_.size() < kRoutesMax)
    known = routes_.emplace(observation, make(observation)).first;
  if (known != routes_.end()) {
    found = &*known;
    return known->second;
  }
  passing_ = make(observation);
  return passing_;
}

Dispatch::Route& Dispatch::route(const std::string& observation) {
  // Names that come again and again differ at their ends and in their middle, and in how long they are.
  const std::size_t size = observation.size();
  std::uint64_t word = 0;
  std::uint64_t end = 0;
  if (size >= sizeof word) {
    std::memcpy(&word, observation.data() + (size - sizeof word) / 2, sizeof word);
    std::memcpy(&end, observation.data() + size - sizeof end, sizeof end);
  }
  constexpr std::uint64_t kMixing = 0x9E3779B97F4A7C15U;
  Known*& lately = lately_[((word ^ (end << 1U) ^ size) * kMixing) >> 58U];
  if (lately != nullptr && lately->first == observation) return lately->second;
  return look_up(observation, lately);
}

namespace {

// Appends what is decided to a list.
class Collector final : public MonitorSet::Listener {
 public:
  Collector(const MonitorSet& set, std::vector<MonitorSet::Decided>* out) : set_(set), out_(out) {}
  void stepped(std::size_t monitor, Decisions decisions) override {
    for (Decision& decision : decisions) out_->push_back({monitor, std::move(decision), set_.leaf()});
  }

 private:
  const MonitorSet& set_;
  std::vector<MonitorSet::Decided>* out_;
};

}  // namespace

MonitorSet::MonitorSet(std::vector<Model> models)
    : models_(std::move(models)),
      states_(models_.size()),
      dispatch_(models_),
      rung_(models_.size()),
      timers_(models_.size(), kNever) {}

MonitorSet::MonitorSet(std::vector<Model> models, TimePoint begin) : MonitorSet(std::move(models)) {
  Collector nothing(*this, nullptr);
  start(begin, nothing);
}

void MonitorSet::note_timer(std::size_t monitor) {
  set_timer(monitor, monitor::next_timer(models_[monitor], states_[monitor]));
}

void MonitorSet::set_timer(std::size_t monitor, TimePoint due) {
  TimePoint& timer = timers_[monitor];
  if (timer == due) return;
  if (timer != kNever) wakes_.erase({timer, monitor});
  if (due != kNever) wakes_.insert({due, monitor});
  timer = due;
}

void MonitorSet::start(TimePoint begin, Listener& listener) {
  for (; started_ < models_.size(); ++started_) {
    if (!listener.is_given_up(started_)) {
      states_[started_] = monitor::start(models_[started_], begin, listener.watch(started_));
      note_timer(started_);
    }
    listener.stepped(started_, {});
  }
}

void MonitorSet::recall(Memory memory, Listener& listener) {
  states_ = std::move(memory.states);
  leaves_ = std::move(memory.leaves);
  started_ = models_.size();
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (!listener.is_given_up(i)) note_timer(i);
  }
}

void MonitorSet::observe(const Observation& observation, Listener& listener) {
  const Message& message = *observation;
  if (next_timer() < message.time) advance(message.time - Duration(1), listener);
  Dispatch::Route& route = dispatch_.route(message.name);
  leaves_.see(message, route.sign);
  Dispatch::Targets& targets = route.of(message.source);
  if (targets.monitors.empty()) return;
  Shared shared(message, targets.projection);
  const scxml::PlainValue* const members = targets.reader.read(message);
  for (; observed_ < targets.monitors.size(); ++observed_) {
    const std::uint32_t i = targets.monitors[observed_];
    if (listener.is_given_up(i)) {
      set_timer(i, kNever);
      listener.stepped(i, {});
      continue;
    }
    PlainWay plainly;
    if (!targets.plans.empty() && targets.plans[observed_]) plainly = {&*targets.plans[observed_], members};
    Decisions decisions = monitor::observe(models_[i], states_[i], observation, &shared, plainly, listener.watch(i));
    if (!plainly.kept_timers()) note_timer(i);
    listener.stepped(i, std::move(decisions));
  }
  observed_ = 0;
}

void give_up_ringing(const Model& model, Core& core, TimePoint due) {
  scxml::give_up(core.session, {Severity::kError, "monitor.too-many-timers",
                                fmt::format("its timers ring more than {} times within a second, the last at {} s",
                                            MonitorSet::kRungMax, seconds(due)),
                                SourceSpan{model.chart().file()}});
}

void MonitorSet::advance(TimePoint now, Listener& listener) {
  // In order of time, not of monitors.
  while (next_timer() <= now) {
    const auto [due, i] = *wakes_.begin();
    if (listener.is_given_up(i)) {
      set_timer(i, kNever);
      listener.stepped(i, {});
      continue;
    }
    Decisions decisions = monitor::advance(models_[i], states_[i], due, listener.watch(i));
    if (due - rung_[i].since >= std::chrono::seconds(1)) rung_[i] = {.since = due};
    if (++rung_[i].times > kRungMax) give_up_ringing(models_[i], states_[i], due);
    note_timer(i);
    listener.stepped(i, std::move(decisions));
  }
}

void MonitorSet::observe(const Message& message, std::vector<Decided>& out) {
  // Not owned: it stays where it is.
  observe(Observation(Observation(), &message), out);
}

void MonitorSet::observe(const Observation& observation, std::vector<Decided>& out) {
  Collector collector(*this, &out);
  observe(observation, collector);
}

void MonitorSet::advance(TimePoint now, std::vector<Decided>& out) {
  Collector collector(*this, &out);
  advance(now, collector);
}

std::span<const std::uint32_t> MonitorSet::listeners(const std::string& observation, const std::string& source) {
  return dispatch_.route(observation).of(source).monitors;
}

bool MonitorSet::hears(const std::string& observation) {
  const Dispatch::Route& route = dispatch_.route(observation);
  return !route.any.monitors.empty() || std::any_of(route.by_source.begin(), route.by_source.end(),
                                                    [](const auto& of) { return !of.second.monitors.empty(); });
}

std::vector<MonitorSet::Decided> evaluate(std::vector<Model> models, std::span<const Message> recording,
                                          TimePoint begin, TimePoint end) {
  MonitorSet set(std::move(models), begin);
  std::vector<MonitorSet::Decided> out;
  for (const Message& message : recording) set.observe(message, out);
  set.advance(end, out);
  return out;
}

}  // namespace sentree::monitor
