#include "sentree/monitor/monitor.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <variant>

#include <fmt/format.h>

#include "sentree/base/encoder.h"
#include "sentree/monitor/detail/model.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/monitor/quick.h"
#include "sentree/scxml/encode.h"
#include "sentree/scxml/step.h"

namespace sentree::monitor {

namespace {

// Catches the entry of a deciding state, also of one that the same macrostep leaves again, and of what is remembered of
// other states.
class EntryWatch final : public scxml::Observer {
 public:
  EntryWatch(const Model::Parts& parts, Core& core, const Tracing& tracing, TimePoint now)
      : parts_(parts), core_(core), tracing_(tracing), now_(now) {}

  void entered(const scxml::Chart& chart, std::string_view, scxml::StateIndex state) override {
    if (!(chart == parts_.spec.chart)) return;
    entered_any = true;
    if (tracing_.trail != nullptr) tracing_.trail->entered_by.edit()[state] = tracing_.during;
    if (parts_.pending[state]) core_.since = now_;
    if (stepped.verdict != Verdict::kUndecided || parts_.decides[state] == Verdict::kUndecided) return;
    stepped.verdict = parts_.decides[state];
    stepped.state = chart.states()[state].id;
  }

  // SCXML drops the event, and a monitor that goes on as if nothing had happened says nothing that one may trust.
  void unhandled(const scxml::Chart&, std::string_view, const Diagnostic& why) override {
    if (!failed_) failed_ = why;
  }

  // What is over is not owed any more.
  Stepped end() {
    if (failed_ && core_.session.running()) {
      failed_->code = "monitor.script";
      failed_->message += "; no transition takes the error, and what the monitor would say without is not known";
      scxml::give_up(core_.session, *failed_);
    }
    if (stepped.verdict != Verdict::kUndecided) core_.verdict = stepped.verdict;
    if (core_.since) {
      bool pending = false;
      core_.session.configuration().for_each([&](scxml::StateIndex s) { pending = pending || parts_.pending[s]; });
      if (!pending) core_.since.reset();
    }
    return std::move(stepped);
  }

  Stepped stepped;
  bool entered_any = false;

 private:
  const Model::Parts& parts_;
  Core& core_;
  const Tracing& tracing_;
  TimePoint now_;
  std::optional<Diagnostic> failed_;
};

using PlainMembers = std::array<scxml::PlainValue, kPlainMembersMax>;

// Of who reads an observation alone.
PlainWay plain_way(const Model& model, const Message& message, PlainMembers& members) {
  const auto& plain = Access::parts(model).plain;
  const auto known = plain.find(message.name);
  if (known == plain.end()) return {};
  known->second.reader.read(message, members.data());
  return {&known->second.plan, members.data()};
}

scxml::Host renaming_host(scxml::ExecutionWatch* watch) {
  scxml::Host host;
  host.watch = watch;
  host.processors.push_back({"rename", ""});
  return host;
}

Stepped deliver(const Model& model, Core& core, const scxml::Event& event, TimePoint now, const Tracing& tracing,
                scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  EntryWatch entries(parts, core, tracing, now);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::step(parts.spec.chart, core.session, event, now, effects, host);
  return entries.end();
}

// What the renaming chart sends in answer to an event; nothing: nothing, or an error.
std::optional<Value> renaming_answer(const Model::Parts& parts, Core& core, const scxml::Event& event, TimePoint now,
                                     const scxml::Host& host) {
  scxml::Effects effects;
  scxml::step(*parts.renaming, core.renaming, event, now, effects, host);
  for (scxml::Effect& effect : effects) {
    if (auto* send = std::get_if<scxml::OutgoingSend>(&effect)) return std::move(send->data).value_or(Value(Map()));
  }
  return std::nullopt;
}

// Whether rename `i`, whose event has these data now, comes; remembers them.
bool comes(const Model::Parts& parts, Core& core, std::size_t i, const Value& data, const Message& message,
           const scxml::Host& host) {
  if (!parts.last_of[i]) return true;
  const Map* members = data.as_map();
  const Value& value = members != nullptr && members->size() == 1 ? members->begin()->second : data;
  const std::optional<Value> last = std::exchange(core.last[*parts.last_of[i]], value);
  const Rename& rename = parts.spec.renames[i];
  if (rename.when.empty()) return true;
  if (rename.when == "changed") return !(last && *last == value);
  scxml::Event event;
  event.name = fmt::format("when{}", i);
  Map facts = std::move(*event_data(message).as_map());
  facts["value"] = value;
  if (last)
    facts["last"] = *last;
  else
    facts.erase("last");
  event.data = Value(std::move(facts));
  return renaming_answer(parts, core, event, message.time, host).has_value();
}

Stepped deliver_renamed(const Model& model, Core& core, const Message& message, const Tracing& tracing,
                        scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  const std::vector<Rename>& renames = parts.spec.renames;
  const scxml::Host host = renaming_host(watch);
  const auto fits = [&](const Rename& rename) {
    return is_one_of(message.name, rename.on) && (rename.from.empty() || is_one_of(message.source, rename.from));
  };
  Stepped stepped;
  for (std::size_t i = 0; i < renames.size() && stepped.verdict == Verdict::kUndecided; ++i) {
    const Rename& rename = renames[i];
    if (!fits(rename)) continue;
    const bool is_taken = std::any_of(renames.begin(), renames.begin() + static_cast<std::ptrdiff_t>(i),
                                      [&](const Rename& other) { return other.event == rename.event && fits(other); });
    if (is_taken) continue;
    scxml::Event event;
    event.name = fmt::format("rename{}", i);
    event.data = event_data(message);
    auto data = renaming_answer(parts, core, event, message.time, host);
    if (!data || !comes(parts, core, i, *data, message, host)) continue;
    scxml::Event renamed;
    renamed.name = rename.event;
    renamed.data = std::move(data);
    stepped = deliver(model, core, renamed, message.time, tracing, watch);
  }
  return stepped;
}

bool is_over(const Model& model, const Core& core) {
  if (!core.session.running() || core.verdict == Verdict::kSatisfied) return true;
  return core.verdict == Verdict::kViolated && !model.re_arming();
}

void remember(const Model& model, State& state, const Observation& observation, scxml::ExecutionWatch* watch) {
  Trail& trail = state.trail;
  std::vector<Observation>* history = &trail.history.edit();
  if (history->size() >= std::min(trail.reduce_at, kHistoryMax)) {
    if (history->size() >= trail.reduce_at) reduce_history(model, state, watch);
    if (trail.history->size() >= kHistoryMax) trail.forget_all_but(kHistoryMax / 2);
    history = &trail.history.edit();
  }
  history->push_back(observation);
}

Decision decide(const Model& model, State& state, const Stepped& stepped, std::optional<TimePoint> since, TimePoint at,
                const Message* deciding, scxml::ExecutionWatch* watch) {
  Decision decision{.verdict = stepped.verdict, .at = at, .state = stepped.state};
  if (deciding != nullptr) decision.deciding = *deciding;
  decision.since = since;
  decision.started = state.trail.started;
  decision.witness_complete = state.trail.history_complete;
  if (stepped.verdict == Verdict::kViolated) decision.number = ++state.trail.violations;
  find_witness(model, state.trail, decision, watch);
  if (is_over(model, state)) state.trail.history.reset();
  return decision;
}

// One instant: what a timer sends without delay is due at the instant of that timer.
Stepped fire_due(const Model& model, Core& core, const Tracing& tracing, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  const TimePoint due = core.session.next_timer();
  EntryWatch entries(parts, core, tracing, due);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::step_timers(parts.spec.chart, core.session, due, effects, host);
  return entries.end();
}

// What has been put to the test needs to be watched no more.
void test(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch) {
  const Model& test = *model.test();
  Core& core = *state.trail.test;
  (void)step_timers(test, core, message.time - Duration(1), watch);
  (void)step(test, core, message, watch);
  if (core.verdict == Verdict::kViolated) state.trail.test.reset();
}

void advance_into(const Model& model, State& state, TimePoint now, Decisions& decisions, scxml::ExecutionWatch* watch) {
  while (!is_over(model, state) && state.session.next_timer() <= now) {
    const TimePoint due = state.session.next_timer();
    const std::optional<TimePoint> since = state.since;
    const Stepped stepped = fire_due(model, state, {&state.trail, nullptr}, watch);
    if (stepped.verdict != Verdict::kUndecided)
      decisions.push_back(decide(model, state, stepped, since, due, nullptr, watch));
  }
}

}  // namespace

void Trail::forget_all_but(std::size_t latest) {
  if (history->size() <= latest) return;
  history = CopyOnWrite(std::vector(history->end() - static_cast<std::ptrdiff_t>(latest), history->end()));
  history_complete = false;
}

Model without_witnesses(const Model& model) {
  Model::Parts parts = Access::parts(model);
  parts.forgoes_witnesses = true;
  Model quick = model;
  Access::exchange(quick, std::move(parts));
  return quick;
}

bool keeps_observations(const Model& model) { return !Access::parts(model).forgoes_witnesses; }

Core begin(const Model& model, TimePoint now, const Tracing& tracing, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  Core core;
  EntryWatch entries(parts, core, tracing, now);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::start(parts.spec.chart, core.session, {.data = {}, .session_id = parts.spec.name}, now, effects, host);
  if (parts.renaming) {
    core.last.resize(parts.lasts);
    scxml::start(*parts.renaming, core.renaming, {.data = {}, .session_id = "renaming"}, now, effects,
                 renaming_host(watch));
  }
  entries.end();
  core.verdict = Verdict::kUndecided;  // nothing has been observed yet
  return core;
}

Stepped step(const Model& model, Core& core, const Message& message, Shared* shared, PlainWay& plainly,
             const Tracing& tracing, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  if (plainly.plan != nullptr) {
    EntryWatch entries(parts, core, tracing, message.time);
    plainly.taken = plainly.plan->step(core.session, plainly.members, message.time, entries);
    if (plainly.taken) return entries.entered_any ? entries.end() : Stepped();
  }
  if (parts.renaming) return deliver_renamed(model, core, message, tracing, watch);
  Shared own(message, parts.projection);
  return deliver(model, core, (shared != nullptr ? *shared : own).event(), message.time, tracing, watch);
}

Stepped step_alone(const Model& model, Core& core, const Message& message, const Tracing& tracing,
                   scxml::ExecutionWatch* watch) {
  PlainMembers members;
  PlainWay plainly = plain_way(model, message, members);
  return step(model, core, message, nullptr, plainly, tracing, watch);
}

Stepped step_timers(const Model& model, Core& core, TimePoint until, const Tracing& tracing,
                    scxml::ExecutionWatch* watch) {
  Stepped stepped;
  TimePoint since = core.session.next_timer();
  std::size_t rung = 0;
  while (core.session.running() && core.session.next_timer() <= until && stepped.verdict == Verdict::kUndecided) {
    const TimePoint due = core.session.next_timer();
    if (due - since >= std::chrono::seconds(1)) {
      since = due;
      rung = 0;
    }
    stepped = fire_due(model, core, tracing, watch);
    if (++rung > MonitorSet::kRungMax) give_up_ringing(model, core, due);
  }
  return stepped;
}

Core begin(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) { return begin(model, now, {}, watch); }

Stepped step(const Model& model, Core& core, const Message& message, scxml::ExecutionWatch* watch) {
  if (is_over(model, core) || !model.listens_to(message.name)) return {};
  return step_alone(model, core, message, {}, watch);
}

Stepped step_timers(const Model& model, Core& core, TimePoint until, scxml::ExecutionWatch* watch) {
  return is_over(model, core) ? Stepped() : step_timers(model, core, until, {}, watch);
}

Result<void> encode(const Model& model, const Core& core, TimePoint now, std::string& out) {
  const Model::Parts& parts = Access::parts(model);
  const std::size_t before = out.size();
  out.push_back(static_cast<char>(core.verdict));
  if (is_over(model, core)) {
    out.push_back(static_cast<char>(core.session.status() == scxml::SessionStatus::kFailed));
    return {};
  }
  auto encoded = scxml::encode(parts.spec.chart, core.session, now, out, parts.overwritten);
  if (encoded && parts.renaming) encoded = scxml::encode(*parts.renaming, core.renaming, now, out, parts.renamed);
  if (!encoded) {
    out.resize(before);
    return encoded;
  }
  Encoder encoder(out);
  for (const std::optional<Value>& last : core.last) {
    encoder.byte(last ? 1 : 0);
    if (last) encoder.value(*last);
  }
  return encoded;
}

State start(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) {
  State state;
  state.trail.entered_by.edit().resize(model.chart().states().size());
  static_cast<Core&>(state) = begin(model, now, {&state.trail, nullptr}, watch);
  state.trail.beginning = state.session.configuration();
  state.trail.started = now;
  if (model.test() != nullptr) state.trail.test = begin(*model.test(), now, watch);
  return state;
}

TimePoint next_timer(const Model& model, const Core& core) {
  return is_over(model, core) ? kNever : core.session.next_timer();
}

Decisions observe(const Model& model, State& state, const Observation& observation, Shared* shared, PlainWay& plainly,
                  scxml::ExecutionWatch* watch) {
  // Stands for all that are not kept: which states were entered is known, not by what.
  static const Observation kSomething = std::make_shared<const Message>();
  Decisions decisions;
  const Message& message = *observation;
  if (state.trail.test) test(model, state, message, watch);
  if (is_over(model, state)) return decisions;
  if (state.session.next_timer() < message.time) {
    advance_into(model, state, message.time - Duration(1), decisions, watch);
    if (is_over(model, state)) return decisions;
  }
  ++state.trail.seen;
  const bool keeps = keeps_observations(model);
  if (keeps)
    remember(model, state, observation, watch);
  else
    state.trail.history_complete = false;
  const std::optional<TimePoint> since = state.since;
  const Stepped stepped =
      step(model, state, message, shared, plainly, {&state.trail, keeps ? observation : kSomething}, watch);
  if (stepped.verdict != Verdict::kUndecided)
    decisions.push_back(decide(model, state, stepped, since, message.time, &message, watch));
  const Model::Parts& parts = Access::parts(model);
  // A chart that is back in its beginning, and keeps no data from one observation to the next, has forgotten
  // everything.
  if (parts.forgets && state.session.timers().empty() && !state.trail.history->empty() &&
      state.session.configuration() == state.trail.beginning) {
    state.trail.history.overwrite().clear();
    state.trail.history_complete = true;
  }
  return decisions;
}

Decisions observe(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch) {
  if ((is_over(model, state) && !state.trail.test) || !model.listens_to(message.name)) return {};
  PlainMembers members;
  PlainWay plainly = plain_way(model, message, members);
  // What is not kept need not be copied.
  const Observation observation =
      keeps_observations(model) ? std::make_shared<const Message>(message) : Observation(Observation(), &message);
  return observe(model, state, observation, nullptr, plainly, watch);
}

Decisions advance(const Model& model, State& state, TimePoint now, scxml::ExecutionWatch* watch) {
  Decisions decisions;
  advance_into(model, state, now, decisions, watch);
  return decisions;
}

Listeners::Listeners(std::vector<Model> models, const std::string& observation) {
  scxml::PlainPaths paths;
  for (Model& model : models) {
    const Model::Parts& parts = Access::parts(model);
    auto plan = parts.renaming ? std::nullopt : scxml::PlainPlan::make(parts.spec.chart, observation, paths);
    listeners_.push_back({std::move(model), std::move(plan)});
  }
  reader_ = Reader(paths);
}

std::optional<std::vector<scxml::TransitionIndex>> Listeners::enabled(std::size_t which, const Core& core) {
  const auto& plan = listeners_[which].plan;
  return plan ? plan->enabled(core.session, members()) : std::nullopt;
}

Stepped Listeners::step(std::size_t which, Core& core) {
  const auto& [model, plan] = listeners_[which];
  PlainWay plainly;
  if (plan) plainly = {&*plan, members()};
  return monitor::step(model, core, *message_, nullptr, plainly, {}, nullptr);
}

Decisions Listeners::observe(std::size_t which, State& state) {
  const auto& [model, plan] = listeners_[which];
  PlainWay plainly;
  if (plan) plainly = {&*plan, members()};
  const Observation observation =
      keeps_observations(model) ? std::make_shared<const Message>(*message_) : Observation(Observation(), message_);
  return monitor::observe(model, state, observation, nullptr, plainly, nullptr);
}

std::optional<std::string> veto(const Model& model, const Core& core, const Message& message,
                                scxml::ExecutionWatch* watch) {
  if (core.failure()) return "it was given up and cannot decide: " + core.failure()->message;
  if (core.verdict == Verdict::kViolated && !model.re_arming()) return "it is violated already";
  if (!core.session.running() || !model.listens_to(message.name)) return std::nullopt;
  Core copy = core;
  Stepped stepped = step_timers(model, copy, message.time - Duration(1), {}, watch);
  if (stepped.verdict == Verdict::kUndecided && copy.session.running())
    stepped = step_alone(model, copy, message, {}, watch);
  if (stepped.verdict == Verdict::kViolated) return fmt::format("it would enter \"{}\"", stepped.state);
  if (copy.failure()) return "it cannot decide: " + copy.failure()->message;
  return std::nullopt;
}

namespace {

// Whether something inside a state decides, or leads to what does.
bool matters(const Model& model, scxml::StateIndex region) {
  const scxml::Chart& chart = model.chart();
  const auto decides = [&](scxml::StateIndex s) { return Access::parts(model).decides[s] != Verdict::kUndecided; };
  for (scxml::StateIndex s = region; s < chart.states()[region].end; ++s) {
    if (decides(s)) return true;
    for (const scxml::TransitionIndex t : chart.states()[s].transitions) {
      const auto& targets = chart.transitions()[t].targets;
      if (std::any_of(targets.begin(), targets.end(), decides)) return true;
    }
  }
  return false;
}

// The innermost active states; of a <parallel>, of the regions that matter, with the region.
std::string active_in(const Model& model, const scxml::Session& session) {
  constexpr std::size_t kNamedMax = 4;
  const auto states = model.chart().states();
  struct Place {
    std::string text;
    bool matters = true;
  };
  std::vector<Place> places;
  session.configuration().for_each([&](scxml::StateIndex active) {
    if (!states[active].is_atomic()) return;
    Place place;
    scxml::StateIndex region = active;
    for (; region != 0 && states[states[region].parent].kind != scxml::StateKind::kParallel;
         region = states[region].parent) {
      if (place.text.empty()) place.text = states[region].id;
    }
    if (region != 0) {
      place.matters = matters(model, region);
      const std::string& id = states[region].id;
      if (!id.empty()) place.text += place.text.empty() ? id : " of " + id;
    }
    if (place.text.empty()) place.text = "?";
    places.push_back(std::move(place));
  });
  const auto is_quiet = [](const Place& place) { return !place.matters; };
  if (!std::all_of(places.begin(), places.end(), is_quiet)) std::erase_if(places, is_quiet);
  std::string text;
  for (std::size_t i = 0; i < std::min(places.size(), kNamedMax); ++i) text += (i > 0 ? ", " : "") + places[i].text;
  if (places.size() > kNamedMax) text += ", …";
  return text.empty() ? "?" : text;
}

}  // namespace

std::string Standing::text() const {
  std::string text = (pending ? "pending: " : "holds so far: ") + says;
  const auto time = [](TimePoint t) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.3f s", seconds(t));
    return std::string(buffer);
  };
  if (since) text += " since " + time(*since);
  if (deadline) text += ", until " + time(*deadline);
  if (!counted.empty()) text += ", " + counted;
  return text;
}

Standing standing(const Model& model, const Core& state) {
  Standing standing;
  const scxml::Chart& chart = model.chart();
  const Origin* origin = model.origin();
  if (origin == nullptr) {
    standing.says = "in state " + active_in(model, state.session);
    return standing;
  }
  for (const Situation& situation : origin->situations) {
    const auto index = chart.find(situation.state);
    if (!index || !state.session.is_active(*index)) continue;
    standing.pending = situation.role == Situation::Role::kPending || situation.role == Situation::Role::kBreached;
    standing.says = situation.says;
    if (situation.role != Situation::Role::kPending) continue;
    standing.since = state.since;
    if (!state.session.timers().empty()) standing.deadline = state.session.timers().front().due;
    const auto& bound = origin->requirement.bound;
    if (!bound || bound->unit == Bound::Unit::kTime) continue;
    const Map data = state.session.data(chart);
    const Value* count = data.find(bound->unit == Bound::Unit::kTicks ? "ticks" : "observations");
    if (count != nullptr)
      standing.counted = fmt::format("{} of {}", static_cast<std::int64_t>(count->number()), bound->text());
  }
  return standing;
}

std::string vacuity(const Model& model, const State& state) {
  if (state.verdict == Verdict::kViolated || state.trail.violations > 0) return {};
  if (model.origin() == nullptr ? state.verdict != Verdict::kUndecided : !state.trail.test) return {};
  if (state.trail.seen == 0) return "never got any event it waits for";
  if (model.origin() == nullptr) return {};
  const Requirement& of = model.origin()->requirement;
  const std::string where = of.scope.kind != Scope::Kind::kGlobally || of.assuming ? " where it applies" : "";
  switch (of.pattern) {
    case Pattern::kRespond: return fmt::format("was never triggered: {} never held{}", to_text(*of.p), where);
    case Pattern::kPrecedes: return fmt::format("was never triggered: {} never held{}", to_text(*of.q), where);
    case Pattern::kHoldsFor: return fmt::format("was never triggered: {} never became true{}", to_text(*of.p), where);
    case Pattern::kImmediately:
    case Pattern::kKeepFor:
    case Pattern::kKeepUntil:
    case Pattern::kNotFor:
      return fmt::format("was never triggered: {} never held{} while {} was known", to_text(*of.p), where,
                         to_text(*of.q));
    default: return fmt::format("was never put to the test: {} was never known{}", to_text(*of.p), where);
  }
}

}  // namespace sentree::monitor
