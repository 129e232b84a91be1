#include "sentree/monitor/monitor.h"

#include <algorithm>
#include <cstdio>
#include <variant>

#include "sentree/monitor/model.h"
#include "sentree/scxml/step.h"

namespace sentree::monitor {

namespace {

// Catches the entry of a deciding state, also of one that the same macrostep leaves again, and of what is remembered of
// other states.
class EntryWatch final : public scxml::Observer {
 public:
  EntryWatch(const Model::Parts& parts, State& state, const Observation& during, TimePoint now)
      : parts_(parts), state_(state), during_(during), now_(now) {}

  void entered(const scxml::Chart& chart, std::string_view, scxml::StateIndex state) override {
    if (!(chart == parts_.spec.chart)) return;
    state_.entered_by[state] = during_;
    if (parts_.pending[state]) state_.since = now_;
    if (stepped.verdict != Verdict::kUndecided || parts_.decides[state] == Verdict::kUndecided) return;
    stepped.verdict = parts_.decides[state];
    stepped.state = chart.states()[state].id;
  }

  Stepped stepped;

 private:
  const Model::Parts& parts_;
  State& state_;
  const Observation& during_;
  TimePoint now_;
};

// What is over is not owed any more.
void settle(const Model::Parts& parts, State& state) {
  if (state.session.status() == scxml::SessionStatus::kFailed) state.failure = state.session.failure();
  if (!state.since) return;
  const scxml::StateSet& active = state.session.configuration();
  for (std::size_t i = 0; i < parts.pending.size(); ++i) {
    if (parts.pending[i] && active.contains(static_cast<scxml::StateIndex>(i))) return;
  }
  state.since.reset();
}

Stepped deliver(const Model& model, State& state, const scxml::Event& event, const Observation& observation,
                scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  EntryWatch entries(parts, state, observation, observation->time);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::step(parts.spec.chart, state.session, event, observation->time, effects, host);
  return std::move(entries.stepped);
}

scxml::Host renaming_host(scxml::ExecutionWatch* watch) {
  scxml::Host host;
  host.watch = watch;
  host.processors.push_back({"rename", ""});
  return host;
}

Stepped deliver_renamed(const Model& model, State& state, const Observation& observation,
                        scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  const Message& message = *observation;
  const scxml::Host host = renaming_host(watch);
  Stepped stepped;
  for (std::size_t i = 0; i < parts.spec.renames.size() && stepped.verdict == Verdict::kUndecided; ++i) {
    if (parts.spec.renames[i].on != message.name) continue;
    scxml::Effects effects;
    scxml::Event event;
    event.name = "rename" + std::to_string(i);
    event.data = event_data(message);
    scxml::step(*parts.renaming, state.renaming, event, message.time, effects, host);
    for (scxml::Effect& effect : effects) {
      if (auto* send = std::get_if<scxml::OutgoingSend>(&effect)) {
        scxml::Event renamed;
        renamed.name = parts.spec.renames[i].event;
        renamed.data = send->data.value_or(Value(Map()));
        stepped = deliver(model, state, renamed, observation, watch);
      }
    }
  }
  return stepped;
}

bool is_over(const Model& model, const State& state) {
  if (!state.session.running() || state.verdict == Verdict::kSatisfied) return true;
  return state.verdict == Verdict::kViolated && !model.re_arming();
}

void remember(const Model& model, State& state, const Observation& observation, scxml::ExecutionWatch* watch) {
  if (state.history.size() >= state.reduce_at) reduce_history(model, state, watch);
  if (state.history.size() >= kHistoryMax) {
    state.history.erase(state.history.begin(), state.history.begin() + kHistoryMax / 2);
    state.history_complete = false;
  }
  state.history.push_back(observation);
}

Decision decide(const Model& model, State& state, const Stepped& stepped, std::optional<TimePoint> since, TimePoint at,
                const Message* deciding, scxml::ExecutionWatch* watch) {
  Decision decision{.verdict = stepped.verdict, .at = at, .state = stepped.state};
  if (deciding != nullptr) decision.deciding = *deciding;
  decision.since = since;
  decision.started = state.started;
  decision.witness_complete = state.history_complete;
  if (stepped.verdict == Verdict::kViolated) decision.number = ++state.violations;
  state.verdict = stepped.verdict;
  find_witness(model, state, decision, watch);
  if (is_over(model, state)) state.history.clear();
  return decision;
}

// One instant: what a timer sends without delay is due at the instant of that timer.
Stepped fire_due(const Model& model, State& state, const Observation& during, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  const TimePoint due = state.session.next_timer();
  EntryWatch entries(parts, state, during, due);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::step_timers(parts.spec.chart, state.session, due, effects, host);
  return std::move(entries.stepped);
}

void advance_into(const Model& model, State& state, TimePoint now, Decisions& decisions, scxml::ExecutionWatch* watch) {
  while (!is_over(model, state) && state.session.next_timer() <= now) {
    const TimePoint due = state.session.next_timer();
    const std::optional<TimePoint> since = state.since;
    const Stepped stepped = fire_due(model, state, nullptr, watch);
    if (stepped.verdict != Verdict::kUndecided)
      decisions.push_back(decide(model, state, stepped, since, due, nullptr, watch));
    settle(Access::parts(model), state);
  }
}

// `event` null: the chart sees the observation under other names.
Decisions observe_with(const Model& model, State& state, const Observation& observation, const scxml::Event* event,
                       scxml::ExecutionWatch* watch) {
  Decisions decisions;
  if (state.session.next_timer() < observation->time) {
    advance_into(model, state, observation->time - Duration(1), decisions, watch);
    if (is_over(model, state)) return decisions;
  }
  remember(model, state, observation, watch);
  const std::optional<TimePoint> since = state.since;
  const Stepped stepped = event != nullptr ? deliver(model, state, *event, observation, watch)
                                           : deliver_renamed(model, state, observation, watch);
  if (stepped.verdict != Verdict::kUndecided)
    decisions.push_back(decide(model, state, stepped, since, observation->time, observation.get(), watch));
  settle(Access::parts(model), state);
  const Model::Parts& parts = Access::parts(model);
  // A chart without data that is back in its beginning has forgotten everything.
  if (!parts.has_data && !parts.renaming && state.session.timers().empty() && !state.history.empty() &&
      state.session.configuration() == state.beginning) {
    state.history.clear();
    state.history_complete = true;
  }
  return decisions;
}

scxml::Event event_of(const Model& model, const Message& message) {
  scxml::Event event;
  event.name = message.name;
  event.data = Access::parts(model).projection.data(message);
  return event;
}

}  // namespace

State begin_replay(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  State state;
  state.entered_by.resize(parts.spec.chart.states().size());
  const Observation nothing;
  EntryWatch entries(parts, state, nothing, now);
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  scxml::Effects effects;
  scxml::start(parts.spec.chart, state.session, {.data = {}, .session_id = parts.spec.name}, now, effects, host);
  if (parts.renaming) {
    scxml::start(*parts.renaming, state.renaming, {.data = {}, .session_id = "renaming"}, now, effects,
                 renaming_host(watch));
  }
  state.beginning = state.session.configuration();
  state.started = now;
  settle(parts, state);
  return state;
}

Stepped replay_message(const Model& model, State& state, const Observation& observation, const scxml::Event* event,
                       scxml::ExecutionWatch* watch) {
  Stepped stepped;
  if (Access::parts(model).renaming) {
    stepped = deliver_renamed(model, state, observation, watch);
  } else if (event != nullptr) {
    stepped = deliver(model, state, *event, observation, watch);
  } else {
    stepped = deliver(model, state, event_of(model, *observation), observation, watch);
  }
  settle(Access::parts(model), state);
  return stepped;
}

Stepped replay_timers(const Model& model, State& state, TimePoint up_to, const Observation& during,
                      scxml::ExecutionWatch* watch) {
  Stepped stepped;
  while (state.session.running() && state.session.next_timer() <= up_to && stepped.verdict == Verdict::kUndecided) {
    stepped = fire_due(model, state, during, watch);
    settle(Access::parts(model), state);
  }
  return stepped;
}

State start(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) { return begin_replay(model, now, watch); }

TimePoint next_timer(const Model& model, const State& state) {
  return is_over(model, state) ? kNever : state.session.next_timer();
}

Decisions observe(const Model& model, State& state, const Observation& observation, const scxml::Event& event,
                  scxml::ExecutionWatch* watch) {
  if (is_over(model, state)) return {};
  return observe_with(model, state, observation, Access::parts(model).renaming ? nullptr : &event, watch);
}

Decisions observe(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch) {
  if (is_over(model, state) || !model.listens_to(message.name)) return {};
  const auto observation = std::make_shared<const Message>(message);
  if (Access::parts(model).renaming) return observe_with(model, state, observation, nullptr, watch);
  const scxml::Event event = event_of(model, message);
  return observe_with(model, state, observation, &event, watch);
}

Decisions advance(const Model& model, State& state, TimePoint now, scxml::ExecutionWatch* watch) {
  Decisions decisions;
  advance_into(model, state, now, decisions, watch);
  return decisions;
}

std::optional<std::string> veto(const Model& model, const State& state, const Message& message,
                                scxml::ExecutionWatch* watch) {
  if (state.failure) return "it was given up and cannot decide: " + state.failure->message;
  if (state.verdict == Verdict::kViolated && !model.re_arming()) return "it is violated already";
  if (!state.session.running() || !model.listens_to(message.name)) return std::nullopt;
  State copy;
  copy.session = state.session;
  copy.renaming = state.renaming;
  copy.entered_by.resize(state.entered_by.size());
  const auto observation = std::make_shared<const Message>(message);
  Stepped stepped = replay_timers(model, copy, message.time - Duration(1), nullptr, watch);
  if (stepped.verdict == Verdict::kUndecided && copy.session.running())
    stepped = replay_message(model, copy, observation, nullptr, watch);
  if (stepped.verdict == Verdict::kViolated) return "it would enter \"" + stepped.state + "\"";
  if (copy.failure) return "it cannot decide: " + copy.failure->message;
  return std::nullopt;
}

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

Standing standing(const Model& model, const State& state) {
  Standing standing;
  const scxml::Chart& chart = model.chart();
  const Origin* origin = model.origin();
  if (origin == nullptr) {
    standing.says = "in state ";
    const std::string* innermost = nullptr;
    state.session.configuration().for_each([&](scxml::StateIndex index) {
      if (!chart.states()[index].id.empty()) innermost = &chart.states()[index].id;
    });
    standing.says += innermost != nullptr ? *innermost : "?";
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
      standing.counted = std::to_string(static_cast<std::int64_t>(count->number())) + " of " + bound->text();
  }
  return standing;
}

}  // namespace sentree::monitor
