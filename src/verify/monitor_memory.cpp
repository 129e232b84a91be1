#include "sentree/verify/monitor_memory.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

namespace sentree::verify {

using monitor::Core;
using monitor::Verdict;

namespace {

// Whether something can be owed for ever. Of what must be kept the end need not come.
bool can_owe_for_ever(const monitor::Model& model) {
  if (model.origin() == nullptr) return false;
  const monitor::Requirement& of = model.origin()->requirement;
  if (of.bound) return false;
  // Between two events what must be there when the segment closes is not owed afterwards.
  return of.pattern == monitor::Pattern::kRespond ||
         (of.pattern == monitor::Pattern::kEventually && of.scope.kind != monitor::Scope::Kind::kBetween);
}

bool is_set(const Map& data, std::string_view name) {
  const Value* const value = data.find(name);
  return value != nullptr && value->as_bool() != nullptr && *value->as_bool();
}

// Between two events only what is closed counts.
bool counts(const monitor::Model& model, const Core& core) {
  return model.origin()->requirement.scope.kind != monitor::Scope::Kind::kBetween ||
         is_set(core.session.data(model.chart()), "from_closed");
}

}  // namespace

bool owes_without_bound(const monitor::Model& model, const Core& core) {
  return core.verdict == Verdict::kUndecided && can_owe_for_ever(model) && monitor::standing(model, core).pending &&
         counts(model, core);
}

bool is_to_come(const monitor::Model& model, const Core& core) {
  if (model.origin() == nullptr || core.verdict != Verdict::kUndecided) return false;
  const monitor::Requirement& of = model.origin()->requirement;
  if (!of.bound) return owes_without_bound(model, core);
  const bool comes = of.pattern == monitor::Pattern::kRespond || of.pattern == monitor::Pattern::kEventually ||
                     of.pattern == monitor::Pattern::kAtLeastEvery;
  return comes && monitor::standing(model, core).pending;
}

bool outlasts(const monitor::Model& model, Duration run, Duration period) {
  if (model.origin() == nullptr || !model.origin()->requirement.bound) return false;
  const monitor::Requirement& of = model.origin()->requirement;
  if (of.pattern == monitor::Pattern::kAtMost || of.pattern == monitor::Pattern::kPrecedes) return false;
  const monitor::Bound& bound = *of.bound;
  switch (bound.unit) {
    case monitor::Bound::Unit::kTime: return bound.time >= run;
    case monitor::Bound::Unit::kTicks: return bound.count >= run / period;
    case monitor::Bound::Unit::kEvents: return false;
  }
  return false;
}

bool leaves_open(const monitor::Model& model, Duration run, Duration period) {
  return model.origin() != nullptr &&
         (model.origin()->requirement.pattern != monitor::Pattern::kAtLeastEvery || outlasts(model, run, period));
}

MonitorMemory::MonitorMemory(const Graph& graph, const monitor::Model& model)
    : graph_(graph), model_(model), dispatch_(std::span<const monitor::Model>(&model, 1)) {}

std::optional<std::uint32_t> MonitorMemory::begin() {
  Core first = monitor::begin(model_, TimePoint{});
  return intern(std::move(first), TimePoint{}, false);
}

std::uint32_t MonitorMemory::heard(std::uint32_t sequence) {
  constexpr std::uint32_t kNobody = UINT32_MAX;
  for (std::size_t i = listened_.size(); i < graph_.observations.size(); ++i) {
    const Message& message = graph_.observations[i];
    const auto& targets = dispatch_.route(message.name).of(message.source);
    listened_.push_back(kNobody);
    if (targets.monitors.empty()) continue;
    std::string key = message.name + '|' + message.source + '|' + to_json(targets.projection.data(message));
    listened_.back() = alike_.emplace(std::move(key), static_cast<std::uint32_t>(alike_.size())).first->second;
  }
  while (of_sequence_.size() <= sequence) {
    words_.clear();
    std::vector<Seen> heard;
    for (const Seen& seen : graph_.sequences[of_sequence_.size()]) {
      if (listened_[seen.observation] == kNobody) continue;
      heard.push_back(seen);
      words_.push_back(static_cast<std::uint64_t>(seen.after.count()));
      words_.push_back(listened_[seen.observation]);
    }
    ever_heard_ = ever_heard_ || !heard.empty();
    const Hash128 hash = hash128({reinterpret_cast<const char*>(words_.data()), words_.size() * sizeof(std::uint64_t)});
    const auto [found, is_new] = known_.emplace(hash, static_cast<std::uint32_t>(heard_.size()));
    if (is_new) {
      bytes_ += 64 + heard.size() * sizeof(Seen);
      heard_.push_back(std::move(heard));
    }
    of_sequence_.push_back(found->second);
  }
  return of_sequence_[sequence];
}

// A number of its own for what is heard when the mission ends so long after a tick.
std::uint32_t MonitorMemory::cut_short(std::uint32_t heard, Duration period) {
  const auto [found, is_new] = cut_short_.emplace(std::pair(heard, period), static_cast<std::uint32_t>(heard_.size()));
  if (is_new) {
    bytes_ += 128 + heard_[heard].size() * sizeof(Seen);
    heard_.push_back(std::vector<Seen>(heard_[heard]));
  }
  return found->second;
}

std::optional<std::uint32_t> MonitorMemory::intern(Core core, TimePoint at, bool violated) {
  form_.clear();
  if (auto encoded = monitor::encode(model_, core, at, form_); !encoded) {
    error_ = encoded.error();
    return std::nullopt;
  }
  form_.push_back(violated ? 'v' : static_cast<char>(core.verdict));
  const auto [found, is_new] = core_of_.emplace(form_, static_cast<std::uint32_t>(cores_.size()));
  if (is_new) {
    const monitor::Standing standing = monitor::standing(model_, core);
    const bool undecided = core.verdict == Verdict::kUndecided;
    const bool owes = owes_without_bound(model_, core);
    const bool to_come = is_to_come(model_, core);
    const bool bounded = standing.deadline.has_value() || !standing.counted.empty();
    bytes_ += sizeof(Kept) + 6 * form_.size() + 500;
    cores_.push_back({.core = std::move(core),
                      .at = at,
                      .owes = owes,
                      .owes_until = undecided && standing.pending && bounded,
                      .to_come = to_come,
                      .violated = violated});
  }
  return found->second;
}

const MonitorMemory::Outcome* MonitorMemory::after(std::uint32_t core, std::uint32_t heard, Duration period) {
  // Most have the length of a period, or none before the first tick.
  if (period != Duration(0) && period != graph_.period) heard = cut_short(heard, period);
  const std::uint64_t key = std::uint64_t{core} << 32U | heard << 1U | (period > Duration(0) ? 1U : 0U);
  if (const std::uint32_t known = outcome_of_.find(key); known != outcome_of_.kNone) return &outcomes_[known];
  Outcome outcome;
  Core stepped = cores_[core].core;
  const TimePoint begin = cores_[core].at;
  bool violated = false;
  const auto take = [&](const monitor::Stepped& what, Duration after, const std::string& observation) {
    if (what.verdict == Verdict::kViolated && !violated) {
      violated = true;
      outcome.after = after;
      outcome.observation = observation;
      outcome.state = what.state;
    }
  };
  const auto until = [&](TimePoint time) {
    for (;;) {
      const TimePoint due = monitor::next_timer(model_, stepped);
      const monitor::Stepped what = monitor::step_timers(model_, stepped, time);
      take(what, std::min(due, time) - begin, "");
      if (what.verdict == Verdict::kUndecided || stepped.verdict != Verdict::kUndecided) return;
    }
  };
  for (const Seen& seen : heard_[heard]) {
    until(begin + seen.after - Duration(1));
    message_ = graph_.observations[seen.observation];
    message_.time = begin + seen.after;
    take(monitor::step(model_, stepped, message_), seen.after, message_.name);
    if (!owes_without_bound(model_, stepped)) outcome.discharged = true;
  }
  until(begin + period);
  if (stepped.failure()) {
    error_ = *stepped.failure();
    return nullptr;
  }
  outcome.violated = violated;
  // What cuts the mission off is heard at the instant that is not judged as a whole.
  const auto& all = heard_[heard];
  const auto to =
      intern(std::move(stepped), begin + std::max(period, all.empty() ? Duration(0) : all.back().after), violated);
  if (!to) return nullptr;
  outcome.core = *to;
  outcome.discharged = outcome.discharged || !cores_[*to].owes;
  bytes_ += sizeof(Outcome) + outcome.observation.size() + outcome.state.size();
  outcome_of_.try_emplace(key, static_cast<std::uint32_t>(outcomes_.size()));
  return &outcomes_.emplace_back(std::move(outcome));
}

const MonitorMemory::Outcome* MonitorMemory::before(std::uint32_t core, std::uint32_t heard, Duration end) {
  const auto [found, is_new] = before_.emplace(std::pair(heard, end), heard);
  const auto& all = heard_[heard];
  if (is_new && !all.empty() && all.back().after >= end) {
    std::vector<Seen> early;
    std::copy_if(all.begin(), all.end(), std::back_inserter(early), [&](const Seen& seen) { return seen.after < end; });
    bytes_ += 128 + early.size() * sizeof(Seen);
    found->second = static_cast<std::uint32_t>(heard_.size());
    heard_.push_back(std::move(early));
  }
  return after(core, found->second, end - Duration(1));
}

}  // namespace sentree::verify
