#include "sentree/campaign/detail/quick_monitors.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace sentree::campaign {

namespace {

// Whether a projection has a member of what every observation has.
bool looks_at(const monitor::Projection& projection, std::string_view fact) {
  return projection.data(Message()).find(fact) != nullptr;
}

}  // namespace

bool QuickMonitors::fits(const monitor::Model& model) {
  return !monitor::keeps_observations(model) && scxml::is_native(model.chart()) &&
         (model.test() == nullptr || scxml::is_native(model.test()->chart())) &&
         !looks_at(monitor::Projection::of(model.chart()), "call");
}

QuickMonitors::QuickMonitors(const std::vector<monitor::Model>& models) : models_(models) {
  for (const monitor::Model& model : models) add(model, false);
  for (const monitor::Model& model : models) {
    if (model.test() != nullptr) add(*model.test(), true);
  }
}

void QuickMonitors::add(const monitor::Model& model, bool is_test) {
  Of of{.model = model,
        .is_test = is_test,
        .reads = scxml::EventReads(model.chart()),
        .projection = monitor::Projection::of(model.chart()),
        .beginning = monitor::begin(model, {})};
  of.remembers = model.chart().ambient().empty() && !looks_at(of.projection, "tick") &&
                 !looks_at(of.projection, "time") && !of.projection.is_whole() &&
                 of.beginning.renaming.status() == scxml::SessionStatus::kNew;
  monitors_.push_back(std::move(of));
}

void QuickMonitors::begin() {
  go_well_ = true;
  decided_ = 0;
  watches_.resize(monitors_.size());
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    watches_[i] = {};
    watches_[i].core = intern(i, monitors_[i].beginning, {});
    if (!watches_[i].core) watches_[i].state = monitors_[i].beginning;
  }
}

void QuickMonitors::forget() {
  routes_.clear();
  kept_.clear();
  number_of_core_.clear();
  number_of_steps_ = {};
  steps_.clear();
}

bool QuickMonitors::hears(const std::string& observation) const {
  return std::any_of(monitors_.begin(), monitors_.end(),
                     [&](const Of& of) { return of.model.listens_to(observation); });
}

QuickMonitors::Route QuickMonitors::route_of(const Message& message) const {
  std::vector<std::uint32_t> monitors;
  std::vector<monitor::Model> models;
  monitor::Projection projection;
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    if (!monitors_[i].model.listens_to(message.name)) continue;
    const auto only = monitors_[i].model.listens_to_only(message.name);
    if (only && std::find(only->begin(), only->end(), message.source) == only->end()) continue;
    monitors.push_back(i);
    models.push_back(monitors_[i].model);
    projection.add(monitors_[i].projection);
  }
  return {std::move(monitors), std::move(projection), monitor::Listeners(std::move(models), message.name)};
}

void QuickMonitors::observe(std::uint32_t number, const Message& message, bool varies) {
  const auto hear = [&](Route& route) {
    if (route.monitors.empty()) return;
    route.listeners.hear(message);
    Heard heard{.number = number, .message = message, .varies = varies, .route = route, .made = {}};
    for (std::size_t which = 0; which < route.monitors.size(); ++which) observe(which, heard);
  };
  if (number == kOnce) {
    Route once = route_of(message);
    return hear(once);
  }
  if (number >= routes_.size()) routes_.resize(number + 1);
  if (!routes_[number]) routes_[number] = std::make_unique<Route>(route_of(message));
  hear(*routes_[number]);
}

std::vector<QuickMonitors::Step>& QuickMonitors::steps_of(std::uint32_t core, std::uint32_t number) {
  const auto [place, is_new] =
      number_of_steps_.try_emplace(std::uint64_t{core} << 32U | number, static_cast<std::uint32_t>(steps_.size()));
  return is_new ? steps_.emplace_back() : steps_[*place];
}

// What an observation that varies enables. Nothing: it must be looked at more closely.
std::optional<std::vector<scxml::TransitionIndex>> QuickMonitors::enabled(std::size_t which, Heard& heard) {
  const std::uint32_t i = heard.route.monitors[which];
  const Of& of = monitors_[i];
  if (of.reads.elsewhere()) return std::nullopt;
  const monitor::Core& core = *kept_[*watches_[i].core];
  auto enabled = heard.route.listeners.enabled(which, core);
  if (!enabled) enabled = scxml::enabled_by(of.model.chart(), core.session, heard.event(), heard.message.time);
  const auto in_content = [&](scxml::TransitionIndex t) { return of.reads.in_content(t); };
  if (!enabled || std::any_of(enabled->begin(), enabled->end(), in_content)) return std::nullopt;
  return enabled;
}

void QuickMonitors::observe(std::size_t which, Heard& heard) {
  const std::uint32_t i = heard.route.monitors[which];
  Watch& watch = watches_[i];
  if (watch.verdict != monitor::Verdict::kUndecided) return;
  watch.seen = true;
  if (!watch.core) {
    step_as_it_is(which, heard, watch);
    watch.core = intern(i, watch.state, heard.message.time);
    return;
  }
  if (heard.number == kOnce) return execute(which, heard, nullptr, std::nullopt);
  std::optional<std::vector<scxml::TransitionIndex>> enables;
  if (heard.varies) {
    enables = enabled(which, heard);
    if (!enables) {
      const std::size_t before = kept_.size();
      execute(which, heard, nullptr, std::nullopt);
      // Of one that keeps what it sees, hardly a state comes again.
      constexpr std::uint64_t kTriedMin = 500;
      Of& of = monitors_[i];
      of.fresh += kept_.size() - before;
      if (++of.once > kTriedMin && of.fresh * 2 > of.once) of.remembers = false;
      return;
    }
  }
  std::vector<Step>& known = steps_of(*watch.core, heard.number);
  for (const Step& step : known) {
    if (step.enabled != enables) continue;
    watch.core = step.next;
    decide(i, watch, step.verdict);
    return;
  }
  execute(which, heard, &known, std::move(enables));
}

// @param known  Where the step is kept; null: nowhere.
void QuickMonitors::execute(std::size_t which, Heard& heard, std::vector<Step>* known,
                            std::optional<std::vector<scxml::TransitionIndex>> enabled) {
  const std::uint32_t i = heard.route.monitors[which];
  Watch& watch = watches_[i];
  Watch stepped;
  stepped.state = *kept_[*watch.core];
  step_as_it_is(which, heard, stepped);
  const auto next = intern(i, stepped.state, heard.message.time);
  if (next && known != nullptr && go_well_) known->push_back({std::move(enabled), *next, stepped.verdict});
  watch.verdict = stepped.verdict;
  watch.core = next;
  if (!next) watch.state = std::move(stepped.state);
}

void QuickMonitors::step_as_it_is(std::size_t which, Heard& heard, Watch& watch) {
  const std::uint32_t i = heard.route.monitors[which];
  monitor::Core& core = watch.state;
  monitor::Stepped stepped;
  if (core.session.next_timer() < heard.message.time)
    stepped = monitor::step_timers(monitors_[i].model, core, heard.message.time - Duration(1));
  if (stepped.verdict == monitor::Verdict::kUndecided && core.session.running())
    stepped = heard.route.listeners.step(which, core);
  decide(i, watch, stepped.verdict);
  if (core.failure()) go_well_ = false;
}

// That something has been put to the test is no decision.
void QuickMonitors::decide(std::uint32_t i, Watch& watch, monitor::Verdict verdict) {
  if (verdict == monitor::Verdict::kUndecided) return;
  watch.verdict = verdict;
  if (monitors_[i].is_test) return;
  ++decided_;
  if (verdict != monitor::Verdict::kSatisfied) go_well_ = false;
}

// Nothing: time decides something, or the chart asks for more than what is observed.
std::optional<std::uint32_t> QuickMonitors::intern(std::uint32_t i, const monitor::Core& core, TimePoint now) {
  if (!monitors_[i].remembers || core.failure() || core.session.next_timer() != kNever) return std::nullopt;
  std::string form = fmt::format("{}\n", i);
  if (!monitor::encode(monitors_[i].model, core, now, form)) return std::nullopt;
  const auto [found, is_new] = number_of_core_.try_emplace(std::move(form), static_cast<std::uint32_t>(kept_.size()));
  if (is_new) kept_.push_back(std::make_unique<const monitor::Core>(core));
  return found->second;
}

void QuickMonitors::finish(TimePoint now) {
  for (std::uint32_t i = 0; i < monitors_.size(); ++i) {
    Watch& watch = watches_[i];
    if (watch.core || watch.verdict != monitor::Verdict::kUndecided) continue;
    decide(i, watch, monitor::step_timers(monitors_[i].model, watch.state, now).verdict);
    if (watch.state.failure()) go_well_ = false;
  }
}

std::vector<runtime::MonitorReport> QuickMonitors::reports() const {
  std::vector<runtime::MonitorReport> reports;
  std::size_t test = models_.size();
  for (std::uint32_t i = 0; i < models_.size(); ++i) {
    const Watch& watch = watches_[i];
    runtime::MonitorReport& report = reports.emplace_back();
    report.name = models_[i].name();
    report.verdict = watch.verdict;
    monitor::State state;
    state.verdict = watch.verdict;
    state.trail.seen = watch.seen ? 1 : 0;
    if (models_[i].test() != nullptr && watches_[test++].verdict == monitor::Verdict::kUndecided)
      state.trail.test.emplace();
    report.vacuity = monitor::vacuity(models_[i], state);
  }
  return reports;
}

}  // namespace sentree::campaign
