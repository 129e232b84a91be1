#include "sentree/scxml/plain.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "sentree/scxml/expression.h"
#include "sentree/scxml/guards.h"
#include "sentree/scxml/model.h"

namespace sentree::scxml {

namespace plain {

enum class PlainOp : std::uint8_t {
  kIn,  // a: state
  kNot,
  kNegate,
  kPlus,
  kTypeof,  // a
  kAnd,
  kOr,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kEqual,
  kNotEqual,
  kStrictEqual,
  kStrictNotEqual,  // a, b
  kConditional,     // a ? b : c
};

// What an expression, or a part of one, is: a value that lies somewhere, or a node. Where: the two highest bits.
using Operand = std::uint32_t;
constexpr unsigned kPlaceBits = 30;
constexpr Operand kPlaceMask = (1U << kPlaceBits) - 1;
constexpr Operand kConstants = 0U << kPlaceBits;
constexpr Operand kMembers = 1U << kPlaceBits;    // of the event
constexpr Operand kVariables = 2U << kPlaceBits;  // by slot
constexpr Operand kNodes = 3U << kPlaceBits;
constexpr Operand kAlways = 0xFFFFFFFFU;

struct PlainNode {
  PlainOp op = PlainOp::kIn;
  Operand a = 0;
  Operand b = 0;
  Operand c = 0;
};

struct PlainAction {
  enum class What : std::uint8_t {
    kAssign,  // a: slot, b: expression
    kRaise,   // a: event of the plan
    kUnless,  // a: expression, b: where to go on if it does not hold
    kGoTo,    // b
    kSend,    // a: of the plan's timers
    kCancel,  // a: of the plan's ids
  };
  What what = What::kAssign;
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

struct Range {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

struct Candidate {
  TransitionIndex transition = 0;
  Operand condition = kAlways;
  bool plain = false;
  Range actions;
  StateIndex domain = kNoState;  // kNoState: it leads nowhere
  Range entered;                 // of the plan's paths: the states from below the domain to an atomic one
};

// What an event of one name may enable.
struct PlainEvent {
  std::string name;
  std::vector<Range> of_state;  // candidates of an atomic state and its ancestors, in their order
  std::vector<Candidate> candidates;
  // By state, what is executed when it is left or entered.
  std::vector<Range> onexit;
  std::vector<Range> onentry;
  std::vector<bool> may_be_left;  // by state
};

}  // namespace plain

namespace {

using Kind = PlainValue::Kind;
using Native = NativeCode::Op;
using namespace plain;

// Members that objects inherit: that a map lacks them does not make them undefined.
bool may_be_inherited(std::string_view name) {
  return name.starts_with("__") || name == "constructor" || name == "hasOwnProperty" || name == "isPrototypeOf" ||
         name == "propertyIsEnumerable" || name == "toLocaleString" || name == "toString" || name == "valueOf";
}

bool is_special(const Value& value) {
  const Map* map = value.as_map();
  return map != nullptr && map->size() == 1 && map->begin()->first.starts_with('$');
}

}  // namespace

struct PlainPlan::Content {
  explicit Content(Chart of) : chart(std::move(of)) {}

  Chart chart;  // whose texts constants borrow
  std::uint64_t fingerprint = 0;
  std::array<std::uint64_t, 2> atomic{};
  std::array<std::uint64_t, 2> restless{};  // atomic states in which eventless transitions may be enabled
  std::vector<plain::PlainEvent> events;    // the external one first, then those that are raised
  std::vector<plain::PlainNode> nodes;
  std::vector<PlainValue> constants;
  std::uint64_t read = 0;  // the slots that expressions read
  std::vector<plain::PlainAction> actions;
  std::vector<std::unique_ptr<std::string>> names;  // of events, as constants borrow them
  std::vector<StateIndex> paths;
  std::vector<Timer> timers;  // as a <send> makes them, but for when they are due
  std::vector<std::string> ids;
};

// ---- Making ----

namespace {

class PlainCompiler {
 public:
  PlainCompiler(PlainPlan::Content& content, PlainPaths& paths)
      : content_(content), model_(content.chart.model()), paths_(paths) {}

  // False: whatever state is active, the step is not plain.
  bool run(std::string_view event) {
    if (model_.states.size() > kPlainStatesMax || model_.variables.size() > kPlainVariablesMax ||
        !model_.invokes.empty() || model_.data_model == DataModelKind::kForeign || model_.obstacle)
      return false;
    content_.fingerprint = model_.fingerprint;
    for (StateIndex s = 0; s < model_.states.size(); ++s) {
      if (!model_.states[s].is_atomic()) continue;
      set(content_.atomic, s);
      for (StateIndex at = s; at != kNoState; at = model_.states[at].parent) {
        for (const TransitionIndex t : model_.states[at].transitions) {
          if (model_.transition_code[t].eventless) set(content_.restless, s);
        }
      }
    }
    add_event(event);
    for (std::size_t i = 0; i < content_.events.size(); ++i) {
      if (i >= kPlainEventsMax) return false;
      fill(i);
    }
    return true;
  }

 private:
  static void set(std::array<std::uint64_t, 2>& states, StateIndex s) {
    states[s / 64] |= std::uint64_t{1} << (s % 64);
  }

  std::uint32_t add_event(std::string_view name) {
    auto& events = content_.events;
    // The first is external: a raised one of the same name has no data.
    for (std::size_t i = 1; i < events.size(); ++i) {
      if (events[i].name == name) return static_cast<std::uint32_t>(i);
    }
    events.emplace_back().name = std::string(name);
    return static_cast<std::uint32_t>(events.size() - 1);
  }

  void fill(std::size_t event) {
    event_ = event;
    PlainEvent filled;
    filled.name = content_.events[event].name;
    DescriptorTable::Matches matches;
    model_.descriptors.match(filled.name, matches);
    filled.of_state.resize(model_.states.size());
    filled.onexit.resize(model_.states.size());
    filled.onentry.resize(model_.states.size());
    filled.may_be_left.resize(model_.states.size(), true);
    std::vector<std::optional<Candidate>> made(model_.transitions.size());
    for (StateIndex s = 0; s < model_.states.size(); ++s) {
      if (!model_.states[s].is_atomic()) continue;
      filled.of_state[s].begin = static_cast<std::uint32_t>(filled.candidates.size());
      for (StateIndex at = s; at != kNoState; at = model_.states[at].parent) {
        for (const TransitionIndex t : model_.states[at].transitions) {
          const TransitionCode& code = model_.transition_code[t];
          if (code.eventless || std::none_of(code.descriptors.begin(), code.descriptors.end(),
                                             [&](DescriptorId id) { return matches.contains(id); }))
            continue;
          if (!made[t]) made[t] = candidate(t, code, filled);
          filled.candidates.push_back(*made[t]);
        }
      }
      filled.of_state[s].end = static_cast<std::uint32_t>(filled.candidates.size());
    }
    content_.events[event] = std::move(filled);
  }

  Candidate candidate(TransitionIndex t, const TransitionCode& code, PlainEvent& event) {
    Candidate c;
    c.transition = t;
    if (code.condition != kNoExpression) c.condition = expression(code.condition);
    c.plain =
        blocks({&code.content, 1}, c.actions) && (model_.transitions[t].targets.empty() || moves(t, code, event, c));
    return c;
  }

  // Whether where it leads is known beforehand, and what is executed on the way.
  bool moves(TransitionIndex t, const TransitionCode& code, PlainEvent& event, Candidate& c) {
    const auto is_parallel = [](const State& state) { return state.kind == StateKind::kParallel; };
    if (code.dynamic || model_.has_history || model_.late_binding || model_.transitions[t].targets.size() != 1 ||
        std::any_of(model_.states.begin(), model_.states.end(), is_parallel))
      return false;
    std::vector<StateIndex> path;
    StateIndex above = c.domain = code.domain;
    for (StateIndex target = model_.transitions[t].targets.front();;) {
      const std::size_t begin = path.size();
      for (StateIndex s = target; s != above; s = model_.states[s].parent) path.push_back(s);
      std::reverse(path.begin() + static_cast<std::ptrdiff_t>(begin), path.end());
      if (model_.states[target].kind == StateKind::kAtomic) break;
      if (model_.states[target].kind != StateKind::kCompound) return false;
      const TransitionIndex initial = model_.state_code[target].initial;
      if (!model_.transition_code[initial].content.empty() || model_.transitions[initial].targets.size() != 1)
        return false;
      above = target;
      target = model_.transitions[initial].targets.front();
    }
    for (const StateIndex s : path) {
      if (event.onentry[s].end == 0 && !blocks(model_.state_code[s].onentry, event.onentry[s])) return false;
    }
    for (StateIndex s = c.domain + 1; s < model_.states[c.domain].end; ++s) {
      if (event.onexit[s].end == 0 && !blocks(model_.state_code[s].onexit, event.onexit[s]))
        event.may_be_left[s] = false;
    }
    c.entered.begin = static_cast<std::uint32_t>(content_.paths.size());
    content_.paths.insert(content_.paths.end(), path.begin(), path.end());
    c.entered.end = static_cast<std::uint32_t>(content_.paths.size());
    return true;
  }

  // SCXML 3.8 has blocks end by errors, of which there are none in a plain step.
  bool blocks(std::span<const Block> all, Range& range) {
    range.begin = static_cast<std::uint32_t>(content_.actions.size());
    const bool plain = std::all_of(all.begin(), all.end(), [&](const Block& one) { return block(one); });
    range.end = static_cast<std::uint32_t>(content_.actions.size());
    return plain;
  }

  bool block(const Block& actions) {
    return std::all_of(actions.begin(), actions.end(), [&](const Action& action) { return execute(action); });
  }

  bool execute(const Action& action) {
    auto& actions = content_.actions;
    if (const auto* assign = std::get_if<Assign>(&action.what)) {
      const auto slot = model_.expressions[assign->location].slot;
      if (!slot || assign->expr == kNoExpression) return false;
      actions.push_back({PlainAction::What::kAssign, *slot, expression(assign->expr)});
      return true;
    }
    if (const auto* raised = std::get_if<Raise>(&action.what)) {
      actions.push_back({PlainAction::What::kRaise, add_event(raised->event), 0});
      return true;
    }
    if (const auto* send = std::get_if<Send>(&action.what)) return send_later(*send, action.place);
    if (const auto* cancel = std::get_if<Cancel>(&action.what)) {
      if (cancel->sendid_expr != kNoExpression) return false;
      actions.push_back({PlainAction::What::kCancel, static_cast<std::uint32_t>(content_.ids.size()), 0});
      content_.ids.push_back(cancel->sendid);
      return true;
    }
    const auto* choice = std::get_if<If>(&action.what);
    if (choice == nullptr) return false;
    std::vector<std::size_t> to_end;
    for (const If::Branch& branch : choice->branches) {
      const std::size_t unless = actions.size();
      const bool conditional = branch.condition != kNoExpression;
      if (conditional) actions.push_back({PlainAction::What::kUnless, expression(branch.condition), 0});
      if (!block(branch.body)) return false;
      to_end.push_back(actions.size());
      actions.push_back({PlainAction::What::kGoTo, 0, 0});
      if (conditional) actions[unless].b = static_cast<std::uint32_t>(actions.size());
    }
    for (const std::size_t from : to_end) actions[from].b = static_cast<std::uint32_t>(actions.size());
    return true;
  }

  // To the session itself, with nothing but a name.
  bool send_later(const Send& send, const Place& place) {
    const auto is_constant = [](const Text& text) { return text.expr == kNoExpression; };
    const Payload& payload = send.payload;
    if (!is_constant(send.event) || !send.target.absent() || !send.type.absent() || !is_constant(send.delay) ||
        send.delay_constant <= Duration(0) || send.idlocation != kNoExpression || payload.has_content ||
        !payload.namelist.empty() || !payload.params.empty())
      return false;
    Timer timer;
    timer.event.name = send.event.constant;
    timer.event.sendid = send.id;
    timer.delay = send.delay_constant;
    timer.place = place;
    content_.actions.push_back({PlainAction::What::kSend, static_cast<std::uint32_t>(content_.timers.size()), 0});
    content_.timers.push_back(std::move(timer));
    return true;
  }

  Operand add(PlainNode node) {
    content_.nodes.push_back(node);
    return kNodes | static_cast<Operand>(content_.nodes.size() - 1);
  }
  Operand constant(PlainValue value) {
    content_.constants.push_back(value);
    return kConstants | static_cast<Operand>(content_.constants.size() - 1);
  }
  // What only the interpreter can tell.
  Operand left() { return constant(PlainValue::of(Kind::kUnknown)); }

  Operand expression(ExpressionId id) {
    const NativeCode& code = model_.expressions[id].native;
    return code.empty() ? left() : translate(code, static_cast<std::uint32_t>(code.nodes.size() - 1));
  }

  // The path below `_event.data`; nothing: it is something else.
  static std::optional<std::string> path_of(const NativeCode& code, std::uint32_t at) {
    const NativeCode::Node& node = code.nodes[at];
    if (node.op == Native::kEventField && static_cast<EventField>(node.a) == EventField::kData) return std::string();
    if (node.op != Native::kMember) return std::nullopt;
    auto before = path_of(code, node.a);
    const std::string& name = code.strings[node.b];
    if (!before || may_be_inherited(name) || name.starts_with('$')) return std::nullopt;
    return before->empty() ? name : *before + "." + name;
  }

  Operand translate(const NativeCode& code, std::uint32_t at) {
    const NativeCode::Node& node = code.nodes[at];
    switch (node.op) {
      case Native::kUndefined: return constant(PlainValue::of(Kind::kUndefined));
      case Native::kNull: return constant(PlainValue::of(Kind::kNull));
      case Native::kTrue: return constant(PlainValue::of(true));
      case Native::kFalse: return constant(PlainValue::of(false));
      case Native::kNumber: return constant(PlainValue::of(node.number));
      case Native::kString: return constant(PlainValue::of(std::string_view(code.strings[node.a])));
      case Native::kVariable: return variable(node.a);
      case Native::kIn: {
        const auto state = content_.chart.find(code.strings[node.a]);
        return state ? add({.op = PlainOp::kIn, .a = *state}) : constant(PlainValue::of(false));
      }
      case Native::kMember: {
        const auto path = event_ == 0 ? path_of(code, at) : std::nullopt;
        return path ? (kMembers | paths_.add(*path)) : left();
      }
      case Native::kEventField:
        if (static_cast<EventField>(node.a) != EventField::kName) return left();
        return constant(PlainValue::of(event_name()));
      case Native::kNot: return unary(PlainOp::kNot, code, node);
      case Native::kNegate: return unary(PlainOp::kNegate, code, node);
      case Native::kPlus: return unary(PlainOp::kPlus, code, node);
      case Native::kTypeof: return unary(PlainOp::kTypeof, code, node);
      case Native::kAdd: return binary(PlainOp::kAdd, code, node);
      case Native::kSubtract: return binary(PlainOp::kSubtract, code, node);
      case Native::kMultiply: return binary(PlainOp::kMultiply, code, node);
      case Native::kDivide: return binary(PlainOp::kDivide, code, node);
      case Native::kModulo: return binary(PlainOp::kModulo, code, node);
      case Native::kLess: return binary(PlainOp::kLess, code, node);
      case Native::kLessEqual: return binary(PlainOp::kLessEqual, code, node);
      case Native::kGreater: return binary(PlainOp::kGreater, code, node);
      case Native::kGreaterEqual: return binary(PlainOp::kGreaterEqual, code, node);
      case Native::kEqual: return binary(PlainOp::kEqual, code, node);
      case Native::kNotEqual: return binary(PlainOp::kNotEqual, code, node);
      case Native::kStrictEqual: return binary(PlainOp::kStrictEqual, code, node);
      case Native::kStrictNotEqual: return binary(PlainOp::kStrictNotEqual, code, node);
      case Native::kAnd: return binary(PlainOp::kAnd, code, node);
      case Native::kOr: return binary(PlainOp::kOr, code, node);
      case Native::kConditional: {
        const Operand a = translate(code, node.a);
        const Operand b = translate(code, node.b);
        const Operand c = translate(code, node.c);
        return add({.op = PlainOp::kConditional, .a = a, .b = b, .c = c});
      }
      default: return left();
    }
  }

  Operand variable(std::uint32_t slot) {
    content_.read |= std::uint64_t{1} << slot;
    return kVariables | slot;
  }

  // Of the external event the caller's text may go, so a descriptor's or the chart's has to be borrowed.
  [[nodiscard]] std::string_view event_name() {
    auto& kept = content_.names;
    const std::string& name = content_.events[event_].name;
    for (const auto& known : kept) {
      if (*known == name) return *known;
    }
    return *kept.emplace_back(std::make_unique<std::string>(name));
  }

  Operand unary(PlainOp op, const NativeCode& code, const NativeCode::Node& node) {
    const Operand a = translate(code, node.a);
    return add({.op = op, .a = a});
  }
  Operand binary(PlainOp op, const NativeCode& code, const NativeCode::Node& node) {
    const Operand a = translate(code, node.a);
    const Operand b = translate(code, node.b);
    return add({.op = op, .a = a, .b = b});
  }

  PlainPlan::Content& content_;
  const Model& model_;
  PlainPaths& paths_;
  std::size_t event_ = 0;
};

}  // namespace

// ---- Stepping ----

/// One plain step: it reads the session and writes down what it would set. The session changes when it has come to its
/// end.
class PlainStep {
 public:
  PlainStep(const PlainPlan::Content& plan, Session& session, const PlainValue* members, TimePoint now)
      : plan_(plan), session_(session), variables_(*session.variables_), now_(now) {
    places_ = {plan.constants.data(), members, set_.data()};
  }

  bool run() {
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
    raised_[0] = 0;
    waiting_ = 1;
    const auto is_one = [](std::uint64_t word) { return word != 0 && (word & (word - 1)) == 0; };
    const bool alone = active_[1] == 0 ? is_one(active_[0]) : active_[0] == 0 && is_one(active_[1]);
    state_ =
        static_cast<StateIndex>(active_[0] != 0 ? std::countr_zero(active_[0]) : 64 + std::countr_zero(active_[1]));
    for (std::size_t i = 0; i < waiting_; ++i) {
      const PlainEvent& event = plan_.events[raised_[i]];
      if (alone ? !take_alone(event) : !take(event)) return false;
    }
    if (is_set_ != 0) commit();
    if (entered_count_ + timing_count_ != 0) commit_moves();
    return true;
  }

  /// States that were entered, in their order.
  [[nodiscard]] std::span<const StateIndex> entered() const { return {entered_.data(), entered_count_}; }

 private:
  // Of one active atomic state there is one transition at most.
  bool take_alone(const PlainEvent& event) {
    const auto [begin, end] = event.of_state[state_];
    for (std::uint32_t c = begin; c < end; ++c) {
      const Candidate& candidate = event.candidates[c];
      bool holds = true;
      if (candidate.condition != kAlways && !condition(candidate.condition, holds)) return false;
      if (!holds) continue;
      if (!candidate.plain) return false;
      return candidate.domain == kNoState ? execute(candidate.actions) : move(event, candidate);
    }
    return true;
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
    for (std::size_t i = 0; i < active_.size(); ++i) {
      for (std::uint64_t word = active_[i]; word != 0; word &= word - 1) {
        const auto [begin, end] = event.of_state[i * 64 + static_cast<unsigned>(std::countr_zero(word))];
        for (std::uint32_t c = begin; c < end; ++c) {
          const Candidate& candidate = event.candidates[c];
          bool holds = true;
          if (candidate.condition != kAlways && !condition(candidate.condition, holds)) return false;
          if (!holds) continue;
          if (!candidate.plain || candidate.domain != kNoState) return false;
          const auto same = [&](const Candidate* other) { return other->transition == candidate.transition; };
          if (std::none_of(enabled.begin(), enabled.begin() + count, same)) {
            if (count == kEnabledMax) return false;
            enabled[count++] = &candidate;
          }
          break;
        }
      }
    }
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
          if (value.kind == Kind::kObject || (value.kind == Kind::kText && value.of_variable)) return false;
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
        default:
          if (!evaluate(node, value)) return false;
      }
    } else {
      seen = &places_[which >> kPlaceBits][which & kPlaceMask];
      if (seen->kind == Kind::kUnknown) return false;
    }
    holds = seen->kind == Kind::kBool ? seen->boolean : seen->truthy();
    return true;
  }

  // Its value; null: only the interpreter can tell. What lies somewhere is not copied.
  [[gnu::always_inline]] const PlainValue* operand(Operand which, PlainValue& made) {
    if (which >= kNodes) return evaluate(plan_.nodes[which & kPlaceMask], made) ? &made : nullptr;
    const PlainValue* value = &places_[which >> kPlaceBits][which & kPlaceMask];
    return value->kind != Kind::kUnknown ? value : nullptr;
  }

  [[nodiscard]] PlainValue variable(std::uint32_t slot) const {
    const std::optional<Value>& value = variables_[slot];
    if (!value) return PlainValue::of(Kind::kUndefined);
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
    switch (node.op) {
      case PlainOp::kIn: out = PlainValue::of((configuration_[node.a / 64] >> (node.a % 64) & 1U) != 0); return true;
      case PlainOp::kAnd: return value_of(node.a, out) && (!out.truthy() || value_of(node.b, out));
      case PlainOp::kOr: return value_of(node.a, out) && (out.truthy() || value_of(node.b, out));
      case PlainOp::kConditional: return value_of(node.a, out) && value_of(out.truthy() ? node.b : node.c, out);
      default: break;
    }
    PlainValue first;
    const PlainValue* a = operand(node.a, first);
    if (a == nullptr) return false;
    if (node.op <= PlainOp::kTypeof) return unary(node.op, *a, out);
    PlainValue second;
    const PlainValue* b = operand(node.b, second);
    if (b == nullptr) return false;
    if (a->kind != Kind::kNumber || b->kind != Kind::kNumber) return binary(node.op, *a, *b, out);
    return numbers(node.op, a->number, b->number, out);
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

  static std::string_view type_name(Kind kind) {
    switch (kind) {
      case Kind::kBool: return "boolean";
      case Kind::kNumber: return "number";
      case Kind::kText: return "string";
      case Kind::kNull:
      case Kind::kObject: return "object";
      default: return "undefined";
    }
  }

  static bool to_number(const PlainValue& value, double& number) {
    switch (value.kind) {
      case Kind::kNumber: number = value.number; return true;
      case Kind::kUndefined: number = std::numeric_limits<double>::quiet_NaN(); return true;
      case Kind::kNull: number = 0; return true;
      case Kind::kBool: number = value.boolean ? 1 : 0; return true;
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
          case Kind::kUndefined:
          case Kind::kNull: equal = true; break;
          case Kind::kBool: equal = a.boolean == b.boolean; break;
          case Kind::kNumber: equal = a.number == b.number; break;
          case Kind::kText: equal = a.text() == b.text(); break;
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
    if (!before) return now.kind == Kind::kUndefined;
    switch (now.kind) {
      case Kind::kBool: return before->as_bool() != nullptr && *before->as_bool() == now.boolean;
      case Kind::kText: return before->as_string() != nullptr && *before->as_string() == now.text();
      case Kind::kNull: return before->is_null();
      default: return false;
    }
  }

  void commit() {
    std::vector<std::optional<Value>>* variables = nullptr;
    for (std::uint64_t left = is_set_; left != 0; left &= left - 1) {
      const auto slot = static_cast<unsigned>(std::countr_zero(left));
      const PlainValue& value = set_[slot];
      if (is_same(variables != nullptr ? (*variables)[slot] : variables_[slot], value)) continue;
      if (variables == nullptr) variables = &session_.variables_.edit();
      std::optional<Value>& variable = (*variables)[slot];
      switch (value.kind) {
        case Kind::kUndefined: variable.reset(); break;
        case Kind::kNull: variable = Value(); break;
        case Kind::kBool: variable = Value(value.boolean); break;
        case Kind::kNumber: variable = number_value(value.number); break;
        default: variable = Value(value.text()); break;
      }
    }
    if (variables != nullptr) session_.heap_.tag = 0;
  }

  void commit_moves() {
    for (std::size_t i = 0; i < session_.configuration_.words(); ++i)
      session_.configuration_.word(i) = configuration_[i];
    for (std::size_t i = 0; i < timing_count_; ++i) {
      const PlainAction& action = *timing_[i];
      if (action.what == PlainAction::What::kCancel) {
        if (!session_.timers_->empty()) session_.timers_.edit().cancel(plan_.ids[action.a]);
        continue;
      }
      Timer timer = plan_.timers[action.a];
      timer.due = add_saturating(now_, timer.delay);
      timer.sequence = session_.sequence_++;
      session_.timers_.edit().insert(std::move(timer));
    }
  }

  static constexpr std::size_t kEnteredMax = 32;
  static constexpr std::size_t kTimingMax = 16;

  const PlainPlan::Content& plan_;
  Session& session_;
  const std::vector<std::optional<Value>>& variables_;
  TimePoint now_;
  StateIndex state_ = 0;  // atomic and active, where there is only one
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

// ---- Values ----

PlainValue PlainValue::of(std::string_view text) {
  return {.kind = Kind::kText,
          .of_variable = false,
          .size = static_cast<std::uint32_t>(text.size()),
          .characters = text.data()};
}

PlainValue PlainValue::of(const Value& value) {
  switch (value.type()) {
    case Value::Type::kNull: return of(Kind::kNull);
    case Value::Type::kBool: return of(*value.as_bool());
    case Value::Type::kInt: return of(static_cast<double>(*value.as_int()));
    case Value::Type::kDouble: return of(*value.as_double());
    case Value::Type::kString:
      if (value.as_string()->size() > std::numeric_limits<std::uint32_t>::max()) return of(Kind::kUnknown);
      return of(std::string_view(*value.as_string()));
    case Value::Type::kBytes: return of(Kind::kUnknown);
    default: return of(is_special(value) ? Kind::kUnknown : Kind::kObject);
  }
}

bool PlainValue::truthy() const {
  switch (kind) {
    case Kind::kBool: return boolean;
    case Kind::kNumber: return number != 0 && !std::isnan(number);
    case Kind::kText: return size != 0;
    case Kind::kObject: return true;
    default: return false;
  }
}

std::uint32_t PlainPaths::add(std::string path) {
  const auto found = std::find(paths_.begin(), paths_.end(), path);
  if (found != paths_.end()) return static_cast<std::uint32_t>(found - paths_.begin());
  paths_.push_back(std::move(path));
  return static_cast<std::uint32_t>(paths_.size() - 1);
}

PlainValue plain_member(const Value* map, const std::vector<std::string>& members, std::uint32_t* hint) {
  const Value* value = map;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Map* entries = value != nullptr ? value->as_map() : nullptr;
    if (entries == nullptr || (i > 0 && is_special(*value))) return PlainValue::of(Kind::kUnknown);
    if (hint != nullptr && hint[i] < static_cast<std::size_t>(entries->end() - entries->begin()) &&
        entries->begin()[hint[i]].first == members[i]) {
      value = &entries->begin()[hint[i]].second;
      continue;
    }
    value = entries->find(members[i]);
    if (value == nullptr) return PlainValue::of(i + 1 == members.size() ? Kind::kUndefined : Kind::kUnknown);
    for (std::uint32_t at = 0; hint != nullptr && at < entries->size(); ++at) {
      if (&entries->begin()[at].second == value) hint[i] = at;
    }
  }
  return value != nullptr ? PlainValue::of(*value) : PlainValue::of(Kind::kUnknown);
}

// ---- Plans ----

std::optional<PlainPlan> PlainPlan::make(const Chart& chart, std::string_view event, PlainPaths& paths) {
  auto content = std::make_shared<Content>(chart);
  if (!PlainCompiler(*content, paths).run(event)) return std::nullopt;
  return PlainPlan(std::move(content));
}

bool PlainPlan::step(Session& session, const PlainValue* members, TimePoint now, Observer& observer) const {
  PlainStep step(*content_, session, members, now);
  if (!step.run()) return false;
  for (const StateIndex state : step.entered()) observer.entered(content_->chart, session.id(), state);
  return true;
}

bool PlainPlan::keeps_timers() const { return content_->timers.empty() && content_->ids.empty(); }

}  // namespace sentree::scxml
