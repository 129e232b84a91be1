#include "sentree/monitor/monitor.h"

#include <algorithm>
#include <charconv>
#include <variant>

#include "sentree/monitor/model.h"
#include "sentree/scxml/step.h"

namespace sentree::monitor {

namespace {

// Catches the entry of a deciding state, also of one that the same macrostep leaves again.
class EntryWatch final : public scxml::Observer {
 public:
  explicit EntryWatch(const Model::Parts& parts) : parts_(parts) {}

  void entered(const scxml::Chart& chart, std::string_view, scxml::StateIndex state) override {
    if (verdict != Verdict::kUndecided || !(chart == parts_.spec.chart)) return;
    const scxml::State& entered_state = chart.states()[state];
    if (std::find(parts_.violated.begin(), parts_.violated.end(), state) != parts_.violated.end()) {
      verdict = Verdict::kViolated;
    } else if (entered_state.kind == scxml::StateKind::kFinal && entered_state.parent == 0) {
      if (entered_state.id == "violated") verdict = Verdict::kViolated;
      if (entered_state.id == "satisfied") verdict = Verdict::kSatisfied;
    }
    if (verdict != Verdict::kUndecided) state_id = entered_state.id;
  }

  Verdict verdict = Verdict::kUndecided;
  std::string state_id;

 private:
  const Model::Parts& parts_;
};

struct Stepped {
  Verdict verdict = Verdict::kUndecided;
  std::string state;
};

// What the chart's step did, and whether it had to be given up.
Stepped judge(State& state, const EntryWatch& entries) {
  if (state.session.status() == scxml::SessionStatus::kFailed) state.failure = state.session.failure();
  return {entries.verdict, entries.state_id};
}

scxml::Host host_with(EntryWatch& entries, scxml::ExecutionWatch* watch) {
  scxml::Host host;
  host.observer = &entries;
  host.watch = watch;
  return host;
}

Stepped fire_timers(const Model& model, State& state, TimePoint up_to, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  EntryWatch entries(parts);
  const scxml::Host host = host_with(entries, watch);
  scxml::Effects effects;
  // One instant at a time: what a timer sends without delay is due at the instant of that timer.
  while (state.session.running() && state.session.next_timer() <= up_to && entries.verdict == Verdict::kUndecided) {
    scxml::step_timers(parts.spec.chart, state.session, state.session.next_timer(), effects, host);
    effects.clear();
  }
  return judge(state, entries);
}

Stepped deliver(const Model& model, State& state, std::string name, Value data, TimePoint time,
                scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  EntryWatch entries(parts);
  const scxml::Host host = host_with(entries, watch);
  scxml::Effects effects;
  scxml::Event event;
  event.name = std::move(name);
  event.data = std::move(data);
  scxml::step(parts.spec.chart, state.session, event, time, effects, host);
  return judge(state, entries);
}

scxml::Host renaming_host(scxml::ExecutionWatch* watch) {
  scxml::Host host;
  host.watch = watch;
  host.processors.push_back({"rename", ""});
  return host;
}

Stepped deliver_renamed(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
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
        stepped =
            deliver(model, state, parts.spec.renames[i].event, send->data.value_or(Value(Map())), message.time, watch);
      }
    }
  }
  return stepped;
}

// Timers before the message, then the message itself; the history stays.
Stepped feed(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch) {
  Stepped stepped = fire_timers(model, state, message.time - Duration(1), watch);
  if (stepped.verdict != Verdict::kUndecided || !state.session.running()) return stepped;
  if (Access::parts(model).renaming) return deliver_renamed(model, state, message, watch);
  return deliver(model, state, message.name, event_data(message), message.time, watch);
}

void remember(State& state, const Message& message) {
  if (state.history.size() >= kHistoryMax) {
    state.history.erase(state.history.begin(), state.history.begin() + kHistoryMax / 2);
    state.history_complete = false;
  }
  state.history.push_back(message);
}

Decision decide(const Model& model, State& state, const Stepped& stepped, TimePoint at, const Message* deciding,
                scxml::ExecutionWatch* watch) {
  Decision decision{.verdict = stepped.verdict, .at = at, .state = stepped.state, .deciding = {}, .witness = {}};
  if (deciding != nullptr) decision.deciding = *deciding;
  decision.witness_complete = state.history_complete;
  decision.witness = minimal_witness(model, state, decision, watch);
  state.verdict = stepped.verdict;
  state.history.clear();
  return decision;
}

State begin(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) {
  const Model::Parts& parts = Access::parts(model);
  scxml::Host host;
  host.watch = watch;
  State state;
  scxml::Effects effects;
  scxml::start(parts.spec.chart, state.session, {.data = {}, .session_id = parts.spec.name}, now, effects, host);
  if (parts.renaming) {
    scxml::start(*parts.renaming, state.renaming, {.data = {}, .session_id = "renaming"}, now, effects,
                 renaming_host(watch));
  }
  if (state.session.status() == scxml::SessionStatus::kFailed) state.failure = state.session.failure();
  state.started = now;
  return state;
}

using Selection = std::vector<const Message*>;

// Whether a fresh replay of `messages` decides as `decision` did, and not before its last message.
bool decides_alike(const Model& model, TimePoint started, const Selection& messages, const Decision& decision,
                   scxml::ExecutionWatch* watch) {
  State replay = begin(model, started, watch);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const Stepped stepped = feed(model, replay, *messages[i], watch);
    if (stepped.verdict == Verdict::kUndecided) continue;
    return stepped.verdict == decision.verdict && stepped.state == decision.state && i + 1 == messages.size() &&
           messages[i]->time == decision.at;
  }
  if (decision.deciding) return false;
  if (fire_timers(model, replay, decision.at - Duration(1), watch).verdict != Verdict::kUndecided) return false;
  const Stepped stepped = fire_timers(model, replay, decision.at, watch);
  return stepped.verdict == decision.verdict && stepped.state == decision.state;
}

}  // namespace

State start(const Model& model, TimePoint now, scxml::ExecutionWatch* watch) {
  State state = begin(model, now, watch);
  state.initial = state.session;
  return state;
}

TimePoint next_timer(const State& state) {
  return state.verdict == Verdict::kUndecided && state.session.running() ? state.session.next_timer() : kNever;
}

std::optional<Decision> observe(const Model& model, State& state, const Message& message,
                                scxml::ExecutionWatch* watch) {
  if (state.verdict != Verdict::kUndecided || !state.session.running() || !model.listens_to(message.name))
    return std::nullopt;
  if (state.session.next_timer() < message.time) {
    if (auto decision = advance(model, state, message.time - Duration(1), watch)) return decision;
  }
  remember(state, message);
  const Stepped stepped = feed(model, state, message, watch);
  if (stepped.verdict != Verdict::kUndecided) return decide(model, state, stepped, message.time, &message, watch);
  // Back at the beginning, what was observed so far can no longer matter.
  if (state.session.configuration() == state.initial.configuration() && state.session == state.initial) {
    state.history.clear();
    state.history_complete = true;
  }
  return std::nullopt;
}

std::optional<Decision> advance(const Model& model, State& state, TimePoint now, scxml::ExecutionWatch* watch) {
  while (state.verdict == Verdict::kUndecided && state.session.running() && state.session.next_timer() <= now) {
    const TimePoint due = state.session.next_timer();
    const Stepped stepped = fire_timers(model, state, due, watch);
    if (stepped.verdict != Verdict::kUndecided) return decide(model, state, stepped, due, nullptr, watch);
  }
  return std::nullopt;
}

std::optional<std::string> veto(const Model& model, const State& state, const Message& message,
                                scxml::ExecutionWatch* watch) {
  if (state.failure) return "it was given up and cannot decide: " + state.failure->message;
  if (state.verdict == Verdict::kViolated) return "it is violated already";
  if (!state.session.running() || !model.listens_to(message.name)) return std::nullopt;
  State copy;
  copy.session = state.session;
  copy.renaming = state.renaming;
  const Stepped stepped = feed(model, copy, message, watch);
  if (stepped.verdict == Verdict::kViolated) return "it would enter \"" + stepped.state + "\"";
  if (copy.failure) return "it cannot decide: " + copy.failure->message;
  return std::nullopt;
}

std::vector<Message> minimal_witness(const Model& model, const State& state, const Decision& decision,
                                     scxml::ExecutionWatch* watch) {
  if (!state.history_complete) return state.history;
  Selection kept;
  for (const Message& message : state.history) kept.push_back(&message);
  // Delta debugging (Zeller and Hildebrandt 2002), removal of chunks only: ends when no single one can go.
  std::size_t chunk = std::max<std::size_t>(kept.size() / 2, 1);
  while (!kept.empty()) {
    bool removed = false;
    for (std::size_t begin = 0; begin < kept.size();) {
      const auto from = kept.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto to = kept.begin() + static_cast<std::ptrdiff_t>(std::min(begin + chunk, kept.size()));
      Selection shorter(kept.begin(), from);
      shorter.insert(shorter.end(), to, kept.end());
      if (decides_alike(model, state.started, shorter, decision, watch)) {
        kept = std::move(shorter);
        removed = true;
      } else {
        begin += chunk;
      }
    }
    if (chunk == 1 && !removed) break;
    if (chunk > 1) chunk /= 2;
  }
  std::vector<Message> witness;
  for (const Message* message : kept) witness.push_back(*message);
  return witness;
}

}  // namespace sentree::monitor
