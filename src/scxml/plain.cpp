#include "sentree/scxml/plain.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "sentree/scxml/detail/plain_plan.h"
#include "sentree/scxml/expression.h"
#include "sentree/scxml/guards.h"

namespace sentree::scxml {

namespace {

using namespace plain;

bool is_special(const Value& value) {
  const Map* map = value.as_map();
  return map != nullptr && map->size() == 1 && map->begin()->first.starts_with('$');
}

}  // namespace

/// One plain step: it reads the session and writes down what it would set. The session changes when it has come to its
/// end.
class PlainStep {
 public:
  PlainStep(const PlainPlan::Content& plan, const Session& session, const PlainValue* members)
      : plan_(plan), session_(session), variables_(*session.variables_) {
    places_ = {plan.constants.data(), members, set_.data()};
  }

  // @param session  The one that is read.
  bool run(Session& session, TimePoint now) {
    if (!begin()) return false;
    raised_[0] = 0;
    waiting_ = 1;
    for (std::size_t i = 0; i < waiting_; ++i) {
      const PlainEvent& event = plan_.events[raised_[i]];
      if (alone_ ? !take_alone(event) : !take(event)) return false;
    }
    if (is_set_ != 0) commit(session);
    if (entered_count_ + timing_count_ != 0) commit_moves(session, now);
    return true;
  }

  // What the external event enables, if that is told by conditions alone: of transitions that lead somewhere, one may
  // keep another from being taken.
  bool enabled(std::vector<TransitionIndex>& found) {
    if (!begin()) return false;
    return for_each_enabled(plan_.events.front(), [&](const Candidate& candidate) {
      if (!alone_ && !plan_.chart.model().transitions[candidate.transition].targets.empty()) return false;
      if (std::find(found.begin(), found.end(), candidate.transition) == found.end())
        found.push_back(candidate.transition);
      return true;
    });
  }

  /// States that were entered, in their order.
  [[nodiscard]] std::span<const StateIndex> entered() const { return {entered_.data(), entered_count_}; }

 private:
  // Most of a step; a call of it and back takes a tenth of that.
  [[gnu::always_inline]] bool begin() {
    if (!session_.running() || session_.fingerprint_ != plan_.fingerprint || session_.heap_.pinned ||
        session_.heap_.data_lost || session_.timers_->size() + kTimingMax > kPlainTimersMax ||
        ObserveGuards::present() != nullptr)
      return false;
    const StateSet& configuration = session_.configuration_;
    for (std::size_t i = 0; i < configuration.words(); ++i) {
      configuration_[i] = configuration.word(i);
      active_[i] = configuration_[i] & plan_.atomic[i];
      if ((active_[i] & plan_.restless[i]) != 0) return false;
    }
    for (std::uint64_t left = plan_.read; left != 0; left &= left - 1) {
      const auto slot = static_cast<unsigned>(std::countr_zero(left));
      set_[slot] = variable(slot);
    }
    const auto is_one = [](std::uint64_t word) { return word != 0 && (word & (word - 1)) == 0; };
    alone_ = active_[1] == 0 ? is_one(active_[0]) : active_[0] == 0 && is_one(active_[1]);
    state_ =
        static_cast<StateIndex>(active_[0] != 0 ? std::countr_zero(active_[0]) : 64 + std::countr_zero(active_[1]));
    return true;
  }

  // The innermost transition that an event enables in an atomic state; null: none. False: only `step` can tell.
  [[gnu::always_inline]] bool first_enabled(const PlainEvent& event, StateIndex state, const Candidate*& first) {
    const auto [begin, end] = event.of_state[state];
    for (std::uint32_t c = begin; c < end && first == nullptr; ++c) {
      const Candidate& candidate = event.candidates[c];
      bool holds = true;
      if (candidate.condition != kAlways && !condition(candidate.condition, holds)) return false;
      if (holds) first = &candidate;
    }
    return true;
  }

  // In each active atomic state, in their order. False: only `step` can tell, or `see` says so.
  template <class See>
  bool for_each_enabled(const PlainEvent& event, See&& see) {
    for (std::size_t i = 0; i < active_.size(); ++i) {
      for (std::uint64_t word = active_[i]; word != 0; word &= word - 1) {
        const Candidate* first = nullptr;
        if (!first_enabled(event, static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))),
                           first))
          return false;
        if (first != nullptr && !see(*first)) return false;
      }
    }
    return true;
  }

  // Of one active atomic state there is one transition at most.
  bool take_alone(const PlainEvent& event) {
    const Candidate* first = nullptr;
    if (!first_enabled(event, state_, first)) return false;
    if (first == nullptr) return true;
    if (!first->plain) return false;
    return first->domain == kNoState ? execute(first->actions) : move(event, *first);
  }

  // Appendix D: from the inside out, what is on the way, and from the outside in.
  bool move(const PlainEvent& event, const Candidate& candidate) {
    const Model& model = plan_.chart.model();
    for (StateIndex s = state_; s != candidate.domain; s = model.states[s].parent) {
      if (!event.may_be_left[s] || !execute(event.onexit[s])) return false;
      configuration_[s / 64] &= ~(std::uint64_t{1} << (s % 64));
    }
    if (!execute(candidate.actions)) return false;
    for (std::uint32_t at = candidate.entered.begin; at < candidate.entered.end; ++at) {
      const StateIndex s = plan_.paths[at];
      configuration_[s / 64] |= std::uint64_t{1} << (s % 64);
      if (entered_count_ == entered_.size()) return false;
      entered_[entered_count_++] = state_ = s;
      if (!execute(event.onentry[s])) return false;
    }
    return (plan_.restless[state_ / 64] >> (state_ % 64) & 1U) == 0;
  }

  bool take(const PlainEvent& event) {
    constexpr std::size_t kEnabledMax = 8;
    std::array<const Candidate*, kEnabledMax> enabled;
    std::size_t count = 0;
    const bool told = for_each_enabled(event, [&](const Candidate& candidate) {
      if (!candidate.plain || candidate.domain != kNoState) return false;
      const auto same = [&](const Candidate* other) { return other->transition == candidate.transition; };
      if (std::any_of(enabled.begin(), enabled.begin() + count, same)) return true;
      if (count == kEnabledMax) return false;
      enabled[count++] = &candidate;
      return true;
    });
    if (!told) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (!execute(enabled[i]->actions)) return false;
    }
    return true;
  }

  bool execute(const Range& actions) {
    for (std::uint32_t at = actions.begin; at < actions.end;) {
      const PlainAction& action = plan_.actions[at++];
      switch (action.what) {
        case PlainAction::What::kAssign: {
          PlainValue value;
          if (!value_of(action.b, value)) return false;
          // What is assigned may outlive what it is borrowed of; objects are shared.
          if (value.kind == PlainKind::kObject || (value.kind == PlainKind::kText && value.of_variable)) return false;
          set_[action.a] = value;
          is_set_ |= std::uint64_t{1} << action.a;
          break;
        }
        case PlainAction::What::kRaise:
          if (waiting_ == raised_.size()) return false;
          raised_[waiting_++] = action.a;
          break;
        case PlainAction::What::kUnless: {
          bool holds = false;
          if (!condition(action.a, holds)) return false;
          if (!holds) at = action.b;
          break;
        }
        case PlainAction::What::kGoTo: at = action.b; break;
        case PlainAction::What::kSend:
        case PlainAction::What::kCancel:
          if (timing_count_ == timing_.size()) return false;
          timing_[timing_count_++] = &action;
          break;
      }
    }
    return true;
  }

  // Whether it counts as true. Most conditions are comparisons of numbers, and what joins them.
  bool condition(Operand which, bool& holds) {
    PlainValue value;
    const PlainValue* seen = &value;
    if (which >= kNodes) {
      const PlainNode& node = plan_.nodes[which & kPlaceMask];
      switch (node.op) {
        case PlainOp::kAnd: return condition(node.a, holds) && (!holds || condition(node.b, holds));
        case PlainOp::kOr: return condition(node.a, holds) && (holds || condition(node.b, holds));
        case PlainOp::kNot:
          if (!condition(node.a, holds)) return false;
          holds = !holds;
          return true;
        case PlainOp::kHasKind: return has_kind(node, holds);
        default:
          if (!evaluate(node, value)) return false;
      }
    } else {
      seen = &places_[which >> kPlaceBits][which & kPlaceMask];
      if (seen->kind == PlainKind::kUnknown) return false;
    }
    holds = seen->kind == PlainKind::kBool ? seen->boolean : seen->truthy();
    return true;
  }

  // Its value; null: only the interpreter can tell. What lies somewhere is not copied.
  [[gnu::always_inline]] const PlainValue* operand(Operand which, PlainValue& made) {
    if (which >= kNodes) return evaluate(plan_.nodes[which & kPlaceMask], made) ? &made : nullptr;
    const PlainValue* value = &places_[which >> kPlaceBits][which & kPlaceMask];
    return value->kind != PlainKind::kUnknown ? value : nullptr;
  }

  bool has_kind(const PlainNode& node, bool& holds) {
    PlainValue made;
    const PlainValue* value = operand(node.a, made);
    if (value == nullptr) return false;
    holds = (node.b >> static_cast<unsigned>(value->kind) & 1U) != 0;
    return true;
  }

  [[nodiscard]] PlainValue variable(std::uint32_t slot) const {
    const std::optional<Value>& value = variables_[slot];
    if (!value) return PlainValue::of(PlainKind::kUndefined);
    if (const double* number = value->as_double()) return PlainValue::of(*number);
    PlainValue seen = PlainValue::of(*value);
    seen.of_variable = true;
    return seen;
  }

  bool value_of(Operand which, PlainValue& out) {
    const PlainValue* value = operand(which, out);
    if (value == nullptr) return false;
    if (value != &out) out = *value;
    return true;
  }

  bool evaluate(const PlainNode& node, PlainValue& out) {
    if (node.op <= PlainOp::kOr) return choose(node, out);
    PlainValue first;
    const PlainValue* a = operand(node.a, first);
    if (a == nullptr) return false;
    if (node.op <= PlainOp::kTypeof) return unary(node.op, *a, out);
    PlainValue second;
    const PlainValue* b = operand(node.b, second);
    if (b == nullptr) return false;
    if (a->kind != PlainKind::kNumber || b->kind != PlainKind::kNumber) return binary(node.op, *a, *b, out);
    return numbers(node.op, a->number, b->number, out);
  }

  // What does not look at the values of all its operands. Apart from what does, which most nodes are.
  [[gnu::noinline]] bool choose(const PlainNode& node, PlainValue& out) {
    bool holds = false;
    switch (node.op) {
      case PlainOp::kIn: holds = (configuration_[node.a / 64] >> (node.a % 64) & 1U) != 0; break;
      case PlainOp::kAnd: return value_of(node.a, out) && (!out.truthy() || value_of(node.b, out));
      case PlainOp::kOr: return value_of(node.a, out) && (out.truthy() || value_of(node.b, out));
      case PlainOp::kConditional: return condition(node.a, holds) && value_of(holds ? node.b : node.c, out);
      default:
        if (!has_kind(node, holds)) return false;
    }
    out = PlainValue::of(holds);
    return true;
  }

  static bool unary(PlainOp op, const PlainValue& value, PlainValue& out) {
    if (op == PlainOp::kNot) {
      out = PlainValue::of(!value.truthy());
      return true;
    }
    if (op == PlainOp::kTypeof) {
      out = PlainValue::of(type_name(value.kind));
      return true;
    }
    double number = 0;
    if (!to_number(value, number)) return false;
    out = PlainValue::of(op == PlainOp::kNegate ? -number : number);
    return true;
  }

  static bool to_number(const PlainValue& value, double& number) {
    switch (value.kind) {
      case PlainKind::kNumber: number = value.number; return true;
      case PlainKind::kUndefined: number = std::numeric_limits<double>::quiet_NaN(); return true;
      case PlainKind::kNull: number = 0; return true;
      case PlainKind::kBool: number = value.boolean ? 1 : 0; return true;
      default: return false;
    }
  }

  // As ECMAScript has it, as far as it needs no conversion of texts or objects.
  static bool binary(PlainOp op, const PlainValue& a, const PlainValue& b, PlainValue& out) {
    if (op >= PlainOp::kEqual) {
      bool equal = false;
      const bool strict = op >= PlainOp::kStrictEqual;
      if (a.kind == b.kind) {
        switch (a.kind) {
          case PlainKind::kUndefined:
          case PlainKind::kNull: equal = true; break;
          case PlainKind::kBool: equal = a.boolean == b.boolean; break;
          case PlainKind::kNumber: equal = a.number == b.number; break;
          case PlainKind::kText: equal = a.text() == b.text(); break;
          default: return false;  // identity is known to the interpreter only
        }
      } else if (!strict) {
        return false;
      }
      out = PlainValue::of(equal == (op == PlainOp::kEqual || op == PlainOp::kStrictEqual));
      return true;
    }
    double x = 0;
    double y = 0;
    return to_number(a, x) && to_number(b, y) && numbers(op, x, y, out);
  }

  [[gnu::always_inline]] static bool numbers(PlainOp op, double x, double y, PlainValue& out) {
    switch (op) {
      case PlainOp::kAdd: out = PlainValue::of(x + y); return true;
      case PlainOp::kSubtract: out = PlainValue::of(x - y); return true;
      case PlainOp::kMultiply: out = PlainValue::of(x * y); return true;
      case PlainOp::kDivide: out = PlainValue::of(x / y); return true;
      case PlainOp::kModulo: out = PlainValue::of(std::fmod(x, y)); return true;
      case PlainOp::kLess: out = PlainValue::of(x < y); return true;
      case PlainOp::kLessEqual: out = PlainValue::of(x <= y); return true;
      case PlainOp::kGreater: out = PlainValue::of(x > y); return true;
      case PlainOp::kGreaterEqual: out = PlainValue::of(x >= y); return true;
      case PlainOp::kEqual:
      case PlainOp::kStrictEqual: out = PlainValue::of(x == y); return true;
      case PlainOp::kNotEqual:
      case PlainOp::kStrictNotEqual: out = PlainValue::of(x != y); return true;
      default: return false;
    }
  }

  // A datum that keeps its value stays shared with copies of the session.
  static bool is_same(const std::optional<Value>& before, const PlainValue& now) {
    if (!before) return now.kind == PlainKind::kUndefined;
    switch (now.kind) {
      case PlainKind::kBool: return before->as_bool() != nullptr && *before->as_bool() == now.boolean;
      case PlainKind::kText: return before->as_string() != nullptr && *before->as_string() == now.text();
      case PlainKind::kNull: return before->is_null();
      default: return false;
    }
  }

  void commit(Session& session) {
    std::vector<std::optional<Value>>* variables = nullptr;
    for (std::uint64_t left = is_set_; left != 0; left &= left - 1) {
      const auto slot = static_cast<unsigned>(std::countr_zero(left));
      const PlainValue& value = set_[slot];
      if (is_same(variables != nullptr ? (*variables)[slot] : variables_[slot], value)) continue;
      if (variables == nullptr) variables = &session.variables_.edit();
      std::optional<Value>& variable = (*variables)[slot];
      switch (value.kind) {
        case PlainKind::kUndefined: variable.reset(); break;
        case PlainKind::kNull: variable = Value(); break;
        case PlainKind::kBool: variable = Value(value.boolean); break;
        case PlainKind::kNumber: variable = number_value(value.number); break;
        default: variable = Value(value.text()); break;
      }
    }
    if (variables != nullptr) session.heap_.tag = 0;
  }

  void commit_moves(Session& session, TimePoint now) {
    for (std::size_t i = 0; i < session.configuration_.words(); ++i) session.configuration_.word(i) = configuration_[i];
    for (std::size_t i = 0; i < timing_count_; ++i) {
      const PlainAction& action = *timing_[i];
      if (action.what == PlainAction::What::kCancel) {
        if (!session.timers_->empty()) session.timers_.edit().cancel(plan_.ids[action.a]);
        continue;
      }
      Timer timer = plan_.timers[action.a];
      timer.due = add_saturating(now, timer.delay);
      timer.sequence = session.sequence_++;
      session.timers_.edit().insert(std::move(timer));
    }
  }

  static constexpr std::size_t kEnteredMax = 32;
  static constexpr std::size_t kTimingMax = 16;

  const PlainPlan::Content& plan_;
  const Session& session_;
  const std::vector<std::optional<Value>>& variables_;
  StateIndex state_ = 0;  // atomic and active, where there is only one
  bool alone_ = false;    // there is only one
  std::array<std::uint64_t, 2> configuration_{};
  std::array<std::uint64_t, 2> active_{};
  std::size_t entered_count_ = 0;
  std::size_t timing_count_ = 0;
  std::array<StateIndex, kEnteredMax> entered_;
  std::array<const PlainAction*, kTimingMax> timing_;  // what is done to timers
  std::array<std::uint32_t, kPlainEventsMax> raised_;
  std::size_t waiting_ = 0;
  std::array<const PlainValue*, 3> places_;  // where operands lie
  std::uint64_t is_set_ = 0;
  std::array<PlainValue, kPlainVariablesMax> set_;
};

PlainValue PlainValue::of(std::string_view text) {
  return {.kind = PlainKind::kText,
          .of_variable = false,
          .size = static_cast<std::uint32_t>(text.size()),
          .characters = text.data()};
}

PlainValue PlainValue::of(const Value& value) {
  switch (value.type()) {
    case Value::Type::kNull: return of(PlainKind::kNull);
    case Value::Type::kBool: return of(*value.as_bool());
    case Value::Type::kInt: return of(static_cast<double>(*value.as_int()));
    case Value::Type::kDouble: return of(*value.as_double());
    case Value::Type::kString:
      if (value.as_string()->size() > std::numeric_limits<std::uint32_t>::max()) return of(PlainKind::kUnknown);
      return of(std::string_view(*value.as_string()));
    case Value::Type::kBytes: return of(PlainKind::kUnknown);
    default: return of(is_special(value) ? PlainKind::kUnknown : PlainKind::kObject);
  }
}

bool PlainValue::truthy() const {
  switch (kind) {
    case PlainKind::kBool: return boolean;
    case PlainKind::kNumber: return number != 0 && !std::isnan(number);
    case PlainKind::kText: return size != 0;
    case PlainKind::kObject: return true;
    default: return false;
  }
}

PlainValue plain_member(const Value* map, const std::vector<std::string>& members, std::uint32_t* hint) {
  const Value* value = map;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Map* entries = value != nullptr ? value->as_map() : nullptr;
    if (entries == nullptr || (i > 0 && is_special(*value))) return PlainValue::of(PlainKind::kUnknown);
    if (hint != nullptr && hint[i] < static_cast<std::size_t>(entries->end() - entries->begin()) &&
        entries->begin()[hint[i]].first == members[i]) {
      value = &entries->begin()[hint[i]].second;
      continue;
    }
    value = entries->find(members[i]);
    if (value == nullptr) return PlainValue::of(i + 1 == members.size() ? PlainKind::kUndefined : PlainKind::kUnknown);
    for (std::uint32_t at = 0; hint != nullptr && at < entries->size(); ++at) {
      if (&entries->begin()[at].second == value) hint[i] = at;
    }
  }
  return value != nullptr ? PlainValue::of(*value) : PlainValue::of(PlainKind::kUnknown);
}

bool PlainPlan::step(Session& session, const PlainValue* members, TimePoint now, Observer& observer) const {
  PlainStep step(*content_, session, members);
  if (!step.run(session, now)) return false;
  for (const StateIndex state : step.entered()) observer.entered(content_->chart, session.id(), state);
  return true;
}

std::optional<std::vector<TransitionIndex>> PlainPlan::enabled(const Session& session,
                                                               const PlainValue* members) const {
  std::vector<TransitionIndex> found;
  if (!PlainStep(*content_, session, members).enabled(found)) return std::nullopt;
  return found;
}

bool PlainPlan::keeps_timers() const { return content_->timers.empty() && content_->ids.empty(); }

}  // namespace sentree::scxml
