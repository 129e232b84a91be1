#include "sentree/scxml/detail/interpreter.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "sentree/base/assert.h"
#include "sentree/scxml/guards.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {
namespace {

// Scratch memory of this thread, so that a step in the steady state allocates nothing. A step inside a step (from a
// hook) takes a second one.
class ScratchPool {
 public:
  std::unique_ptr<Scratch> take() {
    if (free_.empty()) return std::make_unique<Scratch>();
    auto scratch = std::move(free_.back());
    free_.pop_back();
    return scratch;
  }
  void give(std::unique_ptr<Scratch> scratch) {
    if (free_.size() < kKeptMax) free_.push_back(std::move(scratch));
  }

 private:
  static constexpr std::size_t kKeptMax = 8;
  std::vector<std::unique_ptr<Scratch>> free_;
};

thread_local ScratchPool scratch_pool;

// The bits of word `i` that lie in [begin, end).
std::uint64_t range_mask(std::size_t i, StateIndex begin, StateIndex end) {
  const std::size_t low = i * 64;
  std::uint64_t mask = ~std::uint64_t{0};
  if (begin > low) mask &= begin - low >= 64 ? 0 : ~std::uint64_t{0} << (begin - low);
  if (end < low + 64) mask &= end <= low ? 0 : ~std::uint64_t{0} >> (low + 64 - end);
  return mask;
}

bool any_in_range(const StateSet& set, StateIndex begin, StateIndex end) {
  for (std::size_t i = begin / 64; i < set.words() && i * 64 < end; ++i) {
    if ((set.word(i) & range_mask(i, begin, end)) != 0) return true;
  }
  return false;
}

}  // namespace

Interpreter::Interpreter(Run& run, const Chart& chart, Session& session, Session* parent)
    : run_(run),
      chart_(chart),
      model_(chart.model()),
      session_(session),
      parent_(parent),
      observer_(run.host.observer),
      scratch_(scratch_pool.take()) {
  if (model_.data_model == DataModelKind::kEcmaScript)
    data_ = &ecma_model_.emplace(*this, session);
  else
    data_ = &null_model_.emplace(*this);
  Scratch& s = *scratch_;
  if (s.exit_set.words() * 64 < model_.states.size() || s.exit_set.words() != session.configuration_.words()) {
    s.exit_set = s.entry_set = s.default_entry = s.to_invoke = StateSet(model_.states.size());
  }
}

Interpreter::~Interpreter() {
  data_->finish();
  scratch_pool.give(std::move(scratch_));
}

void Interpreter::start(const Map& data) {
  initialize_datamodel(0, &data);
  if (!model_.late_binding) {
    for (StateIndex s = 1; s < model_.states.size(); ++s) initialize_datamodel(s, nullptr);
  }
  for (const ExpressionId script : model_.scripts) {
    if (auto done = data_->run(script); !done) raise_error(std::move(done.error()));
  }
  scratch_->enabled.assign(1, model_.state_code[0].initial);
  enter_states();
  run_to_completion();
}

void Interpreter::initialize_datamodel(StateIndex state, const Map* overrides) {
  for (const std::uint32_t slot : model_.state_code[state].variables) {
    const Variable& variable = model_.variables[slot];
    const Value* given = overrides ? overrides->find(variable.id) : nullptr;
    if (given) {
      data_->bind_value(slot, *given);
    } else if (variable.expr != kNoExpression) {
      if (auto bound = data_->bind(slot, variable.expr); !bound) raise_error(std::move(bound.error()));
    } else {
      if (!variable.failure.empty())
        raise_error({Severity::kError, "scxml.script", variable.failure, chart_.span(variable.place)});
      data_->bind_value(slot, variable.content);
    }
  }
}

void Interpreter::process_external_event(const Event& event) {
  if (!running()) return;
  take(event);
  if (!session_.invocations_.empty()) apply_finalize_and_autoforward(event);
  select_transitions(event);
  if (!scratch_->enabled.empty()) {
    run_.info.enabled |= parent_ == nullptr;
    microstep();
  }
  run_to_completion();
}

void Interpreter::process_platform_event(const Event& event) {
  if (!running()) return;
  take(event);
  select_transitions(event);
  if (!scratch_->enabled.empty()) {
    run_.info.enabled |= parent_ == nullptr;
    microstep();
  }
  run_to_completion();
}

std::optional<std::vector<TransitionIndex>> Interpreter::enabled_by(const Event& event) {
  data_->set_event(&event);
  select_transitions(event);
  data_->set_event(nullptr);
  if (!running() || !session_.internal_.empty()) return std::nullopt;
  return scratch_->enabled;
}

void Interpreter::cancel() {
  if (running()) exit_interpreter(SessionStatus::kCancelled);
}

void Interpreter::take(const Event& event) {
  data_->set_event(&event);
  if (observer_) observer_->event(chart_, session_.id(), event);
}

// Of a chart that does not come to rest: the rounds whose states are named.
constexpr std::uint32_t kRoundsToldOf = 64;

// Appendix D, mainEventLoop, up to the wait for an external event.
void Interpreter::run_to_completion() {
  ++run_.info.macrosteps;
  std::uint32_t rounds = 0;
  StateSet lately;
  Event event;
  while (running()) {
    // SCXML 3.12.2: eventless transitions first, then internal events, until neither is left.
    if (model_.has_eventless)
      select_eventless_transitions();
    else
      scratch_->enabled.clear();
    if (scratch_->enabled.empty()) {
      if (session_.internal_.empty()) {
        if (!scratch_->has_to_invoke) break;
        invoke_entered_states();
        continue;
      }
      event = session_.internal_.pop();
      take(event);
      select_transitions(event);
      if (scratch_->enabled.empty() && !failures_.empty()) tell_unhandled(event);
    }
    // An event that enables nothing counts too: conditions that fail raise an error each time they are tried.
    if (++rounds + kRoundsToldOf > run_.host.limits.microsteps_max) {
      if (lately.words() == 0) lately = session_.configuration_;
      for (std::size_t i = 0; i < lately.words(); ++i) lately.word(i) |= session_.configuration_.word(i);
      if (rounds > run_.host.limits.microsteps_max) {
        fail_endless(lately, event);
        break;
      }
    }
    if (!scratch_->enabled.empty()) microstep();
  }
  if (observer_) observer_->stable(chart_, session_.id());
  if (session_.status_ == SessionStatus::kFinished) exit_interpreter(SessionStatus::kFinished);
  data_->set_event(nullptr);
}

void Interpreter::tell_unhandled(const Event& event) {
  const Value* const message = event.data ? event.data->find("message") : nullptr;
  if (message == nullptr || !event_matches("error", event.name)) return;
  const auto why = std::find_if(failures_.begin(), failures_.end(), [&](const Diagnostic& failure) {
    return message->text() == failure.message || message->text() == message_of(failure);
  });
  if (why == failures_.end()) return;
  observer_->unhandled(chart_, session_.id(), *why);
  failures_.erase(why);
}

// `lately`: the states of the last rounds.
void Interpreter::fail_endless(const StateSet& lately, const Event& last) {
  constexpr std::size_t kNamedMax = 8;
  std::string states;
  std::size_t named = 0;
  Place place;
  lately.for_each([&](StateIndex s) {
    if (!model_.states[s].is_atomic() || ++named > kNamedMax) return;
    if (named == 1) place = model_.states[s].place;
    states +=
        (named > 1 ? ", " : "") + (model_.states[s].id.empty() ? "?" : fmt::format("\"{}\"", model_.states[s].id));
  });
  if (named > kNamedMax) states += ", …";
  std::string message = fmt::format("the chart does not come to rest in {}: more than {} microsteps in one macrostep",
                                    states, run_.host.limits.microsteps_max);
  if (!scratch_->enabled.empty()) {
    place = model_.transitions[scratch_->enabled.front()].place;
  } else {
    const Value* why = last.data ? last.data->find("message") : nullptr;
    message +=
        fmt::format("; the last event is {}{}", last.name, why != nullptr ? fmt::format(": {}", why->text()) : "");
  }
  fail_session("scxml.endless-macrostep", std::move(message), place);
}

void Interpreter::fail_session(std::string code, std::string message, const Place& place) {
  give_up(session_, {Severity::kError, std::move(code), std::move(message), chart_.span(place)});
}

void Interpreter::select_eventless_transitions() {
  scratch_->enabled.clear();
  const StateSet& configuration = session_.configuration_;
  for (std::size_t i = 0; i < configuration.words(); ++i) {
    for (std::uint64_t word = configuration.word(i) & model_.atomic.word(i); word != 0; word &= word - 1) {
      select_for_state(static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))), nullptr);
    }
  }
  if (scratch_->enabled.size() > 1) remove_conflicting_transitions();
}

void Interpreter::select_transitions(const Event& event) {
  scratch_->enabled.clear();
  DescriptorTable::Matches matches;
  model_.descriptors.match(event.name, matches);
  if (matches.count == 0) return;
  const StateSet& configuration = session_.configuration_;
  for (std::size_t i = 0; i < configuration.words(); ++i) {
    for (std::uint64_t word = configuration.word(i) & model_.atomic.word(i); word != 0; word &= word - 1) {
      select_for_state(static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))), &matches);
    }
  }
  if (scratch_->enabled.size() > 1) remove_conflicting_transitions();
}

// The loop over [state] + ancestors of Appendix D, for one atomic state. Null matches: eventless transitions.
void Interpreter::select_for_state(StateIndex atomic, const DescriptorTable::Matches* matches) {
  for (StateIndex s = atomic; s != kNoState; s = model_.states[s].parent) {
    for (const TransitionIndex t : model_.states[s].transitions) {
      const TransitionCode& code = model_.transition_code[t];
      if (matches == nullptr) {
        if (!code.eventless) continue;
      } else if (code.eventless || std::none_of(code.descriptors.begin(), code.descriptors.end(),
                                                [&](DescriptorId id) { return matches->contains(id); })) {
        continue;
      }
      if (!condition_match(code)) continue;
      auto& enabled = scratch_->enabled;
      if (std::find(enabled.begin(), enabled.end(), t) == enabled.end()) enabled.push_back(t);
      return;
    }
  }
}

bool Interpreter::condition_match(const TransitionCode& transition) {
  if (transition.condition == kNoExpression) return true;
  auto result = data_->condition(transition.condition);
  // SCXML 5.9.1: a condition that cannot be evaluated is false, and error.execution is raised.
  const bool holds = result.value_or(false);
  if (GuardObserver* observer = ObserveGuards::present())
    observer->guard(chart_, static_cast<TransitionIndex>(&transition - model_.transition_code.data()), holds);
  if (!result) raise_error(std::move(result.error()));
  return holds;
}

void Interpreter::remove_conflicting_transitions() {
  // The common case of regions that move on side by side: domains that follow one another in the document are disjoint.
  StateIndex end = 0;
  bool disjoint = true;
  for (const TransitionIndex t : scratch_->enabled) {
    const StateIndex domain = transition_domain(t);
    if (domain == kNoState) continue;
    disjoint = disjoint && domain >= end;
    end = model_.states[domain].end;
  }
  if (disjoint) return;
  auto& filtered = scratch_->filtered;
  filtered.clear();
  for (const TransitionIndex t1 : scratch_->enabled) {
    const StateIndex domain1 = transition_domain(t1);
    bool preempted = false;
    std::size_t kept = 0;
    // Exit sets are the active states below the domains, so two of them intersect if one domain is, or is inside, the
    // other.
    const auto conflicts = [&](TransitionIndex t2) {
      const StateIndex domain2 = transition_domain(t2);
      if (domain1 == kNoState || domain2 == kNoState) return false;
      return domain1 == domain2 || model_.is_descendant(domain1, domain2) || model_.is_descendant(domain2, domain1);
    };
    for (const TransitionIndex t2 : filtered) {
      if (conflicts(t2) && !model_.is_descendant(model_.transitions[t1].source, model_.transitions[t2].source)) {
        preempted = true;
        break;
      }
    }
    if (preempted) continue;
    for (const TransitionIndex t2 : filtered) {
      if (!conflicts(t2)) filtered[kept++] = t2;
    }
    filtered.resize(kept);
    filtered.push_back(t1);
  }
  std::swap(scratch_->enabled, filtered);
}

void Interpreter::microstep() {
  ++run_.info.microsteps;
  if (observer_) {
    for (const TransitionIndex t : scratch_->enabled) observer_->transition(chart_, session_.id(), t);
  }
  exit_states();
  execute_transition_content();
  enter_states();
}

void Interpreter::exit_states() {
  compute_exit_set();
  Scratch& s = *scratch_;
  const std::size_t words = s.exit_set.words();
  if (model_.has_history) s.exit_set.for_each([&](StateIndex state) { record_history(state); });
  // SCXML 3.13, exit order: reverse document order puts descendants before ancestors.
  for (std::size_t i = words; i-- > 0;) {
    for (std::uint64_t word = s.exit_set.word(i); word != 0;) {
      const auto bit = static_cast<unsigned>(63 - std::countl_zero(word));
      word &= ~(std::uint64_t{1} << bit);
      const auto state = static_cast<StateIndex>(i * 64 + bit);
      const StateCode& code = model_.state_code[state];
      if (!code.onexit.empty()) execute_blocks(code.onexit);
      if (!session_.invocations_.empty()) cancel_invocations_of(state);
      session_.configuration_.erase(state);
      s.to_invoke.erase(state);
      if (observer_) observer_->exited(chart_, session_.id(), state);
    }
  }
}

void Interpreter::compute_exit_set() {
  Scratch& s = *scratch_;
  s.exit_set.clear();
  for (const TransitionIndex t : s.enabled) {
    const StateIndex domain = transition_domain(t);
    if (domain == kNoState) continue;
    const StateIndex end = model_.states[domain].end;
    for (std::size_t i = (domain + 1) / 64; i < s.exit_set.words() && i * 64 < end; ++i) {
      s.exit_set.word(i) |= session_.configuration_.word(i) & range_mask(i, domain + 1, end);
    }
  }
}

void Interpreter::record_history(StateIndex state) {
  for (const StateIndex history : model_.state_code[state].history) {
    std::vector<StateIndex> value;
    if (model_.states[history].kind == StateKind::kHistoryDeep) {
      session_.configuration_.for_each([&](StateIndex s0) {
        if (model_.states[s0].is_atomic() && model_.is_descendant(s0, state)) value.push_back(s0);
      });
    } else {
      for (const StateIndex child : model_.states[state].children) {
        if (!model_.states[child].is_history() && is_active(child)) value.push_back(child);
      }
    }
    auto& values = session_.history_.edit();
    auto entry = std::find_if(values.begin(), values.end(), [&](const auto& e) { return e.first >= history; });
    if (entry == values.end() || entry->first != history) entry = values.insert(entry, {history, {}});
    entry->second = std::move(value);
  }
}

const std::vector<StateIndex>* Interpreter::history_value(StateIndex history) const {
  for (const auto& [state, value] : *session_.history_) {
    if (state == history) return &value;
  }
  return nullptr;
}

void Interpreter::execute_transition_content() {
  for (const TransitionIndex t : scratch_->enabled) {
    const Block& content = model_.transition_code[t].content;
    if (!content.empty()) execute(content);
  }
}

void Interpreter::enter_states() {
  compute_entry_set();
  Scratch& s = *scratch_;
  const std::size_t words = s.entry_set.words();
  for (std::size_t i = 0; i < words; ++i) {
    for (std::uint64_t word = s.entry_set.word(i); word != 0 && session_.status_ != SessionStatus::kFailed;
         word &= word - 1) {
      enter_state(static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))));
    }
  }
}

void Interpreter::enter_state(StateIndex state) {
  Scratch& s = *scratch_;
  const StateCode& code = model_.state_code[state];
  session_.configuration_.insert(state);
  if (observer_) observer_->entered(chart_, session_.id(), state);
  if (!code.invokes.empty()) {
    s.to_invoke.insert(state);
    s.has_to_invoke = true;
  }
  if (model_.late_binding && !session_.initialized_->contains(state)) {
    session_.initialized_.edit().insert(state);
    initialize_datamodel(state, nullptr);
  }
  if (!code.onentry.empty()) execute_blocks(code.onentry);
  if (s.default_entry.contains(state) && code.initial != kNoTransition) {
    const Block& content = model_.transition_code[code.initial].content;
    if (!content.empty()) execute(content);
  }
  for (const auto& [parent, transition] : s.default_history_content) {
    if (parent == state) execute(model_.transition_code[transition].content);
  }
  if (model_.states[state].kind == StateKind::kFinal) enter_final(state);
}

void Interpreter::enter_final(StateIndex state) {
  const StateCode& code = model_.state_code[state];
  const StateIndex parent = model_.states[state].parent;
  std::optional<Value> data;
  if (code.donedata) {
    if (auto payload = payload_data(*code.donedata, false)) data = *std::move(payload);
  }
  if (parent == 0) {
    session_.status_ = SessionStatus::kFinished;
    if (data || *session_.done_data_) session_.done_data_.edit() = std::move(data);
    return;
  }
  raise({.name = model_.state_code[parent].done_event, .type = EventType::kPlatform, .data = std::move(data)});
  const StateIndex grandparent = model_.states[parent].parent;
  if (model_.states[grandparent].kind == StateKind::kParallel && is_in_final_state(grandparent)) {
    raise({.name = model_.state_code[grandparent].done_event, .type = EventType::kPlatform});
  }
}

bool Interpreter::is_in_final_state(StateIndex state) const {
  const State& s = model_.states[state];
  const auto child_is_final = [&](StateIndex child) {
    return model_.states[child].kind == StateKind::kFinal && is_active(child);
  };
  if (s.kind == StateKind::kCompound) return std::any_of(s.children.begin(), s.children.end(), child_is_final);
  if (s.kind != StateKind::kParallel) return false;
  return std::all_of(s.children.begin(), s.children.end(),
                     [&](StateIndex child) { return model_.states[child].is_history() || is_in_final_state(child); });
}

void Interpreter::compute_entry_set() {
  Scratch& s = *scratch_;
  s.entry_set.clear();
  s.default_entry.clear();
  s.default_history_content.clear();
  for (const TransitionIndex t : s.enabled) {
    const std::vector<StateIndex>& targets = model_.transitions[t].targets;
    if (targets.empty()) continue;
    for (const StateIndex target : targets) add_descendant_states_to_enter(target);
    const StateIndex ancestor = transition_domain(t);
    if (!model_.transition_code[t].dynamic) {
      for (const StateIndex target : targets) add_ancestor_states_to_enter(target, ancestor);
      continue;
    }
    std::vector<StateIndex> effective;
    effective_targets(t, effective);
    for (const StateIndex target : effective) add_ancestor_states_to_enter(target, ancestor);
  }
}

void Interpreter::add_descendant_states_to_enter(StateIndex state) {
  const State& s = model_.states[state];
  if (s.is_history()) {
    const std::vector<StateIndex>* value = history_value(state);
    const TransitionIndex fallback = model_.state_code[state].initial;
    if (!value) scratch_->default_history_content.emplace_back(s.parent, fallback);
    const std::vector<StateIndex>& targets = value ? *value : model_.transitions[fallback].targets;
    for (const StateIndex target : targets) add_descendant_states_to_enter(target);
    for (const StateIndex target : targets) add_ancestor_states_to_enter(target, s.parent);
    return;
  }
  scratch_->entry_set.insert(state);
  if (s.kind == StateKind::kCompound) {
    scratch_->default_entry.insert(state);
    const std::vector<StateIndex>& targets = model_.transitions[model_.state_code[state].initial].targets;
    for (const StateIndex target : targets) add_descendant_states_to_enter(target);
    for (const StateIndex target : targets) add_ancestor_states_to_enter(target, state);
  } else if (s.kind == StateKind::kParallel) {
    add_regions_to_enter(state);
  }
}

void Interpreter::add_ancestor_states_to_enter(StateIndex state, StateIndex ancestor) {
  for (StateIndex s = model_.states[state].parent; s != ancestor && s != kNoState; s = model_.states[s].parent) {
    scratch_->entry_set.insert(s);
    if (model_.states[s].kind == StateKind::kParallel) add_regions_to_enter(s);
  }
}

void Interpreter::add_regions_to_enter(StateIndex parallel) {
  for (const StateIndex child : model_.states[parallel].children) {
    if (model_.states[child].is_history()) continue;
    if (!any_in_range(scratch_->entry_set, child + 1, model_.states[child].end)) add_descendant_states_to_enter(child);
  }
}

void Interpreter::effective_targets(TransitionIndex transition, std::vector<StateIndex>& targets) {
  const auto add = [&](StateIndex target) {
    if (std::find(targets.begin(), targets.end(), target) == targets.end()) targets.push_back(target);
  };
  for (const StateIndex target : model_.transitions[transition].targets) {
    if (!model_.states[target].is_history()) {
      add(target);
    } else if (const std::vector<StateIndex>* value = history_value(target)) {
      for (const StateIndex state : *value) add(state);
    } else {
      // A default that is itself a history state is refused when the chart is loaded, so this goes one level deep.
      effective_targets(model_.state_code[target].initial, targets);
    }
  }
}

StateIndex Interpreter::transition_domain(TransitionIndex transition) {
  const TransitionCode& code = model_.transition_code[transition];
  if (!code.dynamic) return code.domain;
  std::vector<StateIndex> targets;
  effective_targets(transition, targets);
  const Transition& t = model_.transitions[transition];
  const auto holds_all = [&](StateIndex s) {
    return std::all_of(targets.begin(), targets.end(),
                       [&](StateIndex target) { return model_.is_descendant(target, s); });
  };
  if (t.internal && model_.states[t.source].kind == StateKind::kCompound && holds_all(t.source)) return t.source;
  StateIndex domain = t.source == 0 ? 0 : model_.states[t.source].parent;
  while (domain != 0 && (model_.states[domain].kind != StateKind::kCompound || !holds_all(domain)))
    domain = model_.states[domain].parent;
  return domain;
}

// Appendix D, exitInterpreter.
void Interpreter::exit_interpreter(SessionStatus status) {
  data_->set_event(nullptr);
  session_.internal_.clear();
  std::string final_id;
  const StateSet active = session_.configuration_;
  std::vector<StateIndex> states;
  active.for_each([&](StateIndex s) { states.push_back(s); });
  for (auto s = states.rbegin(); s != states.rend(); ++s) {
    execute_blocks(model_.state_code[*s].onexit);
    cancel_invocations_of(*s);
    if (model_.states[*s].kind == StateKind::kFinal && model_.states[*s].parent == 0)
      final_id = model_.states[*s].id;
    else
      session_.configuration_.erase(*s);
    if (observer_) observer_->exited(chart_, session_.id(), *s);
  }
  if (session_.status_ != SessionStatus::kFailed) session_.status_ = status;
  session_.internal_.clear();
  session_.external_.clear();
  session_.timers_.reset();
  if (parent_ == nullptr) {
    run_.effects.emplace_back(Done{std::move(final_id), *session_.done_data_});
  } else if (status == SessionStatus::kFinished) {
    parent_->external_.push({.name = "done.invoke." + session_.identity_->invokeid,
                             .invokeid = session_.identity_->invokeid,
                             .data = *session_.done_data_});
  }
}

}  // namespace sentree::scxml
