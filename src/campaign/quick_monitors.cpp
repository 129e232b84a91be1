#include "sentree/campaign/quick_monitors.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "sentree/monitor/quick.h"

namespace sentree::campaign {

namespace {

// Whether a projection has a member of what every observation has.
bool looks_at(const monitor::Projection& projection, std::string_view fact) {
  return projection.data(Message()).find(fact) != nullptr;
}

}  // namespace

bool QuickMonitors::fits(const monitor::Model& model) {
  return !monitor::keeps_observations(model) && scxml::is_native(model.chart()) &&
         !looks_at(monitor::Projection::of(model.chart()), "call");
}

QuickMonitors::QuickMonitors(const std::vector<monitor::Model>& models) {
  for (const monitor::Model& model : models) {
    Of of{.model = model,
          .reads = scxml::EventReads(model.chart()),
          .projection = monitor::Projection::of(model.chart()),
          .beginning = monitor::start(model, {})};
    of.remembers = model.chart().ambient().empty() && !looks_at(of.projection, "tick") &&
                   !looks_at(of.projection, "time") && !of.projection.is_whole() &&
                   of.beginning.renaming.status() == scxml::SessionStatus::kNew;
    monitors_.push_back(std::move(of));
  }
}

void QuickMonitors::begin() {
  go_well_ = true;
  decided_ = 0;
  watches_.resize(monitors_.size());
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    watches_[i] = {};
    watches_[i].core = intern(i, monitors_[i].beginning, {});
    if (!watches_[i].core) watches_[i].state = monitors_[i].beginning;
    monitor::State seen = monitors_[i].beginning;
    ++seen.trail.seen;
    watches_[i].tested = monitor::was_tested(monitors_[i].model, seen);
  }
}

void QuickMonitors::forget() {
  routes_.clear();
  kept_.clear();
  number_of_core_.clear();
  steps_.clear();
}

bool QuickMonitors::hears(const std::string& observation) const {
  return std::any_of(monitors_.begin(), monitors_.end(),
                     [&](const Of& of) { return of.model.listens_to(observation); });
}

QuickMonitors::Route QuickMonitors::route_of(const Message& message) const {
  Route route{.is_known = true, .monitors = {}, .projection = {}};
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    if (!monitors_[i].model.listens_to(message.name)) continue;
    const auto only = monitors_[i].model.listens_to_only(message.name);
    if (only && std::find(only->begin(), only->end(), message.source) == only->end()) continue;
    route.monitors.push_back(i);
    route.projection.add(monitors_[i].projection);
  }
  return route;
}

void QuickMonitors::observe(std::uint32_t number, const Message& message, bool varies) {
  Route once;
  if (number == kOnce)
    once = route_of(message);
  else if (number >= routes_.size())
    routes_.resize(number + 1);
  Route& route = number == kOnce ? once : routes_[number];
  if (!route.is_known) route = route_of(message);
  if (route.monitors.empty()) return;
  Varying varying{message, route.projection, {}};
  for (const std::uint32_t i : route.monitors) observe(i, number, message, varies ? &varying : nullptr);
}

// @param varying  Of an observation that varies.
void QuickMonitors::observe(std::uint32_t i, std::uint32_t number, const Message& message, Varying* varying) {
  Watch& watch = watches_[i];
  if (watch.verdict != monitor::Verdict::kUndecided) return;
  Of& of = monitors_[i];
  watch.seen = true;
  if (!watch.core) {
    step_as_it_is(watch, of.model, message);
    watch.core = intern(i, watch.state, message.time);
    return;
  }
  if (number == kOnce) return execute(i, message, nullptr, std::nullopt);
  auto& known = steps_[std::uint64_t{*watch.core} << 32U | number];
  std::optional<std::vector<scxml::TransitionIndex>> enabled;
  if (varying != nullptr) {
    if (!of.reads.elsewhere()) {
      const monitor::Core& core = *kept_[*watch.core];
      enabled = monitor::enabled_plainly(of.model, core, message);
      if (!enabled) enabled = scxml::enabled_by(of.model.chart(), core.session, varying->event(), message.time);
    }
    if (!enabled || std::any_of(enabled->begin(), enabled->end(),
                                [&](scxml::TransitionIndex t) { return of.reads.in_content(t); })) {
      const std::size_t before = kept_.size();
      execute(i, message, nullptr, std::nullopt);
      // Of one that keeps what it sees, hardly a state comes again.
      constexpr std::uint64_t kTriedMin = 500;
      of.fresh += kept_.size() - before;
      if (++of.once > kTriedMin && of.fresh * 2 > of.once) of.remembers = false;
      return;
    }
  }
  for (const Step& step : known) {
    if (step.enabled != enabled) continue;
    watch.core = step.next;
    watch.tested = watch.tested || step.tests;
    if (step.verdict == monitor::Verdict::kUndecided) return;
    watch.verdict = step.verdict;
    ++decided_;
    return;
  }
  execute(i, message, &known, std::move(enabled));
}

// @param known  Where the step is kept; null: nowhere.
void QuickMonitors::execute(std::uint32_t i, const Message& message, std::vector<Step>* known,
                            std::optional<std::vector<scxml::TransitionIndex>> enabled) {
  Watch& watch = watches_[i];
  Watch stepped;
  stepped.state = state_of(i, *kept_[*watch.core]);
  // What is known may come in a run in which it is what puts the monitor to the test.
  stepped.tested = watch.tested && known == nullptr;
  step_as_it_is(stepped, monitors_[i].model, message);
  const auto next = intern(i, stepped.state, message.time);
  if (next && known != nullptr && go_well_)
    known->push_back({std::move(enabled), *next, stepped.tested, stepped.verdict});
  watch.tested = watch.tested || stepped.tested;
  watch.verdict = stepped.verdict;
  watch.core = next;
  if (!next) watch.state = std::move(stepped.state);
}

// Without its trail, which explains, once nobody asks any more whether it was put to the test.
void QuickMonitors::step_as_it_is(Watch& watch, const monitor::Model& model, const Message& message) {
  if (watch.tested) {
    monitor::Core& core = watch.state;
    monitor::Stepped stepped;
    if (monitor::next_timer(model, core) < message.time)
      stepped = monitor::step_timers(model, core, message.time - Duration(1));
    if (stepped.verdict == monitor::Verdict::kUndecided) stepped = monitor::step(model, core, message);
    decide(watch, stepped.verdict);
  } else {
    for (const monitor::Decision& decision : monitor::observe(model, watch.state, message))
      decide(watch, decision.verdict);
    watch.tested = monitor::was_tested(model, watch.state);
  }
  if (watch.state.failure()) go_well_ = false;
}

void QuickMonitors::decide(Watch& watch, monitor::Verdict verdict) {
  if (verdict == monitor::Verdict::kUndecided) return;
  ++decided_;
  watch.verdict = verdict;
  if (verdict != monitor::Verdict::kSatisfied) go_well_ = false;
}

// Nothing: time decides something, or the chart asks for more than what is observed.
std::optional<std::uint32_t> QuickMonitors::intern(std::uint32_t i, const monitor::Core& core, TimePoint now) {
  if (!monitors_[i].remembers || core.failure() || core.session.next_timer() != kNever) return std::nullopt;
  std::string form = std::to_string(i) + "\n";
  if (!monitor::encode(monitors_[i].model, core, now, form)) return std::nullopt;
  const auto [found, is_new] = number_of_core_.try_emplace(std::move(form), static_cast<std::uint32_t>(kept_.size()));
  if (is_new) kept_.push_back(std::make_unique<const monitor::Core>(core));
  return found->second;
}

// That has observed nothing. What is owed now had been owed before.
monitor::State QuickMonitors::state_of(std::uint32_t i, const monitor::Core& core) const {
  monitor::State state;
  static_cast<monitor::Core&>(state) = core;
  state.trail.entered_by.resize(monitors_[i].model.chart().states().size());
  state.trail.beginning = core.session.configuration();
  return state;
}

void QuickMonitors::finish(TimePoint now) {
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    Watch& watch = watches_[i];
    if (watch.core || watch.verdict != monitor::Verdict::kUndecided) continue;
    for (const monitor::Decision& decision : monitor::advance(monitors_[i].model, watch.state, now))
      decide(watch, decision.verdict);
    if (watch.state.failure()) go_well_ = false;
  }
}

std::vector<runtime::MonitorReport> QuickMonitors::reports() const {
  std::vector<runtime::MonitorReport> reports;
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    const Watch& watch = watches_[i];
    runtime::MonitorReport& report = reports.emplace_back();
    report.name = monitors_[i].model.name();
    report.verdict = watch.verdict;
    if (watch.verdict != monitor::Verdict::kUndecided || (watch.tested && watch.seen)) continue;
    monitor::State state = watch.core ? state_of(i, *kept_[*watch.core]) : watch.state;
    if (watch.core && watch.seen) ++state.trail.seen;
    report.vacuity = monitor::vacuity(monitors_[i].model, state);
  }
  return reports;
}

}  // namespace sentree::campaign
