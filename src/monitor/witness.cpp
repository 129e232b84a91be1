// Which observations a verdict needs, and which may be forgotten.
#include <algorithm>
#include <set>
#include <unordered_set>

#include "sentree/monitor/detail/model.h"

namespace sentree::monitor {

namespace {

using Selection = std::vector<Observation>;

// Whether a fresh replay of `messages` decides as `decision` did: at the last of them, or in silence after it.
bool decides_alike(const Model& model, TimePoint started, const Selection& messages, const Decision& decision,
                   scxml::ExecutionWatch* watch) {
  Core replay = begin(model, started, {}, watch);
  // Earlier violations of a monitor that goes on are other stories.
  const auto is_earlier = [&](const Stepped& stepped) {
    return model.re_arming() && stepped.verdict == Verdict::kViolated;
  };
  const auto is_same = [&](const Stepped& stepped, std::optional<TimePoint> since) {
    return stepped.verdict == decision.verdict && stepped.state == decision.state && since == decision.since;
  };
  for (std::size_t i = 0; i < messages.size(); ++i) {
    for (;;) {
      const Stepped timed = step_timers(model, replay, messages[i]->time - Duration(1), {}, watch);
      if (timed.verdict == Verdict::kUndecided) break;
      if (!is_earlier(timed)) return false;
    }
    if (!replay.session.running()) return false;
    const std::optional<TimePoint> since = replay.since;
    const Stepped stepped = step_alone(model, replay, *messages[i], {}, watch);
    const bool last = i + 1 == messages.size() && decision.deciding;
    if (last) return is_same(stepped, since) && messages[i]->sequence == decision.deciding->sequence;
    if (stepped.verdict != Verdict::kUndecided && !is_earlier(stepped)) return false;
  }
  if (decision.deciding) return false;
  for (;;) {
    if (!replay.session.running() || replay.session.next_timer() > decision.at) return false;
    const TimePoint due = replay.session.next_timer();
    const std::optional<TimePoint> since = replay.since;
    const Stepped timed = step_timers(model, replay, due, {}, watch);
    if (timed.verdict == Verdict::kUndecided) continue;
    if (due == decision.at && is_same(timed, since)) return true;
    if (!is_earlier(timed)) return false;
  }
}

// The same state of affairs, however it came about.
bool is_equivalent(const Model& model, const Core& a, const Core& b, TimePoint now) {
  std::string of_a;
  std::string of_b;
  return a.since == b.since && encode(model, a, now, of_a) && encode(model, b, now, of_b) && of_a == of_b;
}

// Observations of one key say the same thing again and again; the last of them counts.
struct ObservedKey {
  const Message* message;
  const Value* args;
  friend bool operator==(const ObservedKey& a, const ObservedKey& b) {
    if (a.message->name != b.message->name || a.message->source != b.message->source) return false;
    return a.args == nullptr || b.args == nullptr ? a.args == b.args : *a.args == *b.args;
  }
};
ObservedKey key_of(const Message& message) { return {&message, message.data.find("args")}; }
struct ObservedKeyHash {
  std::size_t operator()(const ObservedKey& key) const {
    return hash_combine(hash_combine(hash_bytes(key.message->name), hash_bytes(key.message->source)),
                        key.args != nullptr ? key.args->hash() : 0);
  }
};

// The last observation of each key among the first `count`.
void keep_last(const std::vector<Observation>& history, std::size_t count, std::set<std::size_t>& kept) {
  // A few keys are found by comparing, those that came lately first: that costs a fraction of a key's hash.
  constexpr std::size_t kComparedMax = 16;
  std::vector<ObservedKey> few;
  std::unordered_set<ObservedKey, ObservedKeyHash> many;
  for (std::size_t i = count; i-- > 0;) {
    const ObservedKey key = key_of(*history[i]);
    const auto known = std::find(few.begin(), few.end(), key);
    if (known != few.end()) {
      std::swap(*known, few.front());
      continue;
    }
    const bool is_new = few.size() < kComparedMax || many.insert(key).second;
    if (few.size() < kComparedMax) few.push_back(key);
    if (is_new) kept.insert(i);
  }
}

// Leaves out what can be left out. False: there was more to try than kWitnessReplayedMax allows.
bool shorten(const Model& model, TimePoint started, Selection& kept, const Decision& decision,
             scxml::ExecutionWatch* watch) {
  // Delta debugging (Zeller and Hildebrandt 2002), removal of chunks only: ends when no single one can go.
  std::size_t chunk = std::max<std::size_t>(kept.size() / 2, 1);
  std::size_t replayed = 0;
  while (!kept.empty()) {
    bool removed = false;
    for (std::size_t begin = 0; begin < kept.size();) {
      replayed += kept.size();
      if (replayed > kWitnessReplayedMax) return false;
      const auto from = kept.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto to = kept.begin() + static_cast<std::ptrdiff_t>(std::min(begin + chunk, kept.size()));
      Selection shorter(kept.begin(), from);
      shorter.insert(shorter.end(), to, kept.end());
      if (decides_alike(model, started, shorter, decision, watch)) {
        kept = std::move(shorter);
        removed = true;
      } else {
        begin += chunk;
      }
    }
    if (chunk == 1 && !removed) break;
    if (chunk > 1) chunk /= 2;
  }
  return true;
}

}  // namespace

void reduce_history(const Model& model, State& state, scxml::ExecutionWatch* watch) {
  Trail& trail = state.trail;
  if (!trail.history_complete) return;
  // A guess: what set the present values, what led into the present states, and with what values; and the ticks since.
  // It is taken only if a replay of it leads to the same state of affairs.
  std::set<std::size_t> kept;
  const std::vector<Observation>& history = *trail.history;
  keep_last(history, history.size(), kept);
  std::size_t newest_entry = history.size();
  for (std::size_t s = 0; s < trail.entered_by->size(); ++s) {
    if (!state.session.is_active(static_cast<scxml::StateIndex>(s)) || !(*trail.entered_by)[s]) continue;
    const auto entry = std::find(history.begin(), history.end(), (*trail.entered_by)[s]);
    if (entry == history.end()) continue;
    const auto index = static_cast<std::size_t>(entry - history.begin());
    kept.insert(index);
    keep_last(history, index, kept);
    newest_entry = index;
  }
  for (std::size_t i = newest_entry; i < history.size(); ++i) {
    if (history[i]->name == "mission.tick") kept.insert(i);
  }
  Core replay = begin(model, trail.started, {}, watch);
  bool same = true;
  for (const std::size_t index : kept) {
    const Observation& observation = history[index];
    for (;;) {
      const Stepped timed = step_timers(model, replay, observation->time - Duration(1), {}, watch);
      if (timed.verdict == Verdict::kUndecided) break;
      if (!model.re_arming()) same = false;
    }
    const Stepped stepped = step_alone(model, replay, *observation, {}, watch);
    if (stepped.verdict != Verdict::kUndecided && !model.re_arming()) same = false;
    if (!same) break;
  }
  if (same && is_equivalent(model, replay, state, history.back()->time)) {
    std::vector<Observation> reduced;
    for (const std::size_t index : kept) reduced.push_back(history[index]);
    trail.history = CopyOnWrite(std::move(reduced));
  }
  trail.reduce_at = std::max<std::size_t>(kReduceMin, 2 * trail.history->size());
}

void find_witness(const Model& model, const Trail& trail, Decision& decision, scxml::ExecutionWatch* watch) {
  Selection kept = *trail.history;
  decision.witness_minimal = trail.history_complete && shorten(model, trail.started, kept, decision, watch);
  for (const Observation& observation : kept) decision.witness.push_back(*observation);
}

}  // namespace sentree::monitor
