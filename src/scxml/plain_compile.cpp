// Plans of plain steps, made of charts.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "sentree/scxml/detail/plain_plan.h"
#include "sentree/scxml/expression.h"

namespace sentree::scxml {

namespace {

using PlainNative = NativeCode::Op;
using namespace plain;

// Members that objects inherit: that a map lacks them does not make them undefined.
bool may_be_inherited(std::string_view name) {
  return name.starts_with("__") || name == "constructor" || name == "hasOwnProperty" || name == "isPrototypeOf" ||
         name == "propertyIsEnumerable" || name == "toLocaleString" || name == "toString" || name == "valueOf";
}

// A bit of each kind that `typeof` names so.
std::uint32_t kinds_named(std::string_view type) {
  std::uint32_t kinds = 0;
  for (const PlainKind kind : {PlainKind::kUndefined, PlainKind::kNull, PlainKind::kBool, PlainKind::kNumber,
                               PlainKind::kText, PlainKind::kObject}) {
    if (type_name(kind) == type) kinds |= 1U << static_cast<unsigned>(kind);
  }
  return kinds;
}

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
      if (event.onentry[s].end != 0 || blocks(model_.state_code[s].onentry, event.onentry[s])) continue;
      // Where another transition leads there too, it is found out again.
      event.onentry[s] = {};
      return false;
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
  Operand left() { return constant(PlainValue::of(PlainKind::kUnknown)); }

  Operand expression(ExpressionId id) {
    const NativeCode& code = model_.expressions[id].native;
    return code.empty() ? left() : translate(code, static_cast<std::uint32_t>(code.nodes.size() - 1));
  }

  // The path below `_event.data`; nothing: it is something else.
  static std::optional<std::string> path_of(const NativeCode& code, std::uint32_t at) {
    const NativeCode::Node& node = code.nodes[at];
    if (node.op == PlainNative::kEventField && static_cast<EventField>(node.a) == EventField::kData)
      return std::string();
    if (node.op != PlainNative::kMember) return std::nullopt;
    auto before = path_of(code, node.a);
    const std::string& name = code.strings[node.b];
    if (!before || may_be_inherited(name) || name.starts_with('$')) return std::nullopt;
    return before->empty() ? name : fmt::format("{}.{}", *before, name);
  }

  // The path that is read first, whatever the rest of the expression does; nothing: none is known.
  static std::optional<std::string> first_path(const NativeCode& code, std::uint32_t at) {
    for (;;) {
      if (auto path = path_of(code, at)) return path;
      const NativeCode::Node& node = code.nodes[at];
      const bool is_operator = node.op == PlainNative::kNot || node.op == PlainNative::kTypeof ||
                               (node.op >= PlainNative::kAdd && node.op <= PlainNative::kOr);
      if (!is_operator) return std::nullopt;
      at = node.a;
    }
  }
  // `x && …` where what follows reads a member of `x` first: that is unknown unless `x` is an object, which is true.
  bool is_needless(const NativeCode& code, const NativeCode::Node& both) const {
    if (event_ != 0) return false;
    const auto outer = path_of(code, both.a);
    const auto inner = outer && !outer->empty() ? first_path(code, both.b) : std::nullopt;
    return inner && inner->starts_with(*outer + ".");
  }

  Operand translate(const NativeCode& code, std::uint32_t at) {
    const NativeCode::Node& node = code.nodes[at];
    switch (node.op) {
      case PlainNative::kUndefined: return constant(PlainValue::of(PlainKind::kUndefined));
      case PlainNative::kNull: return constant(PlainValue::of(PlainKind::kNull));
      case PlainNative::kTrue: return constant(PlainValue::of(true));
      case PlainNative::kFalse: return constant(PlainValue::of(false));
      case PlainNative::kNumber: return constant(PlainValue::of(node.number));
      case PlainNative::kString: return constant(PlainValue::of(std::string_view(code.strings[node.a])));
      case PlainNative::kVariable: return variable(node.a);
      case PlainNative::kIn: {
        const auto state = content_.chart.find(code.strings[node.a]);
        return state ? add({.op = PlainOp::kIn, .a = *state}) : constant(PlainValue::of(false));
      }
      case PlainNative::kMember: {
        const auto path = event_ == 0 ? path_of(code, at) : std::nullopt;
        return path ? (kMembers | paths_.add(*path)) : left();
      }
      case PlainNative::kEventField:
        if (static_cast<EventField>(node.a) != EventField::kName) return left();
        return constant(PlainValue::of(event_name()));
      case PlainNative::kNot: return unary(PlainOp::kNot, code, node);
      case PlainNative::kNegate: return unary(PlainOp::kNegate, code, node);
      case PlainNative::kPlus: return unary(PlainOp::kPlus, code, node);
      case PlainNative::kTypeof: return unary(PlainOp::kTypeof, code, node);
      case PlainNative::kAdd: return binary(PlainOp::kAdd, code, node);
      case PlainNative::kSubtract: return binary(PlainOp::kSubtract, code, node);
      case PlainNative::kMultiply: return binary(PlainOp::kMultiply, code, node);
      case PlainNative::kDivide: return binary(PlainOp::kDivide, code, node);
      case PlainNative::kModulo: return binary(PlainOp::kModulo, code, node);
      case PlainNative::kLess: return binary(PlainOp::kLess, code, node);
      case PlainNative::kLessEqual: return binary(PlainOp::kLessEqual, code, node);
      case PlainNative::kGreater: return binary(PlainOp::kGreater, code, node);
      case PlainNative::kGreaterEqual: return binary(PlainOp::kGreaterEqual, code, node);
      case PlainNative::kEqual: return equality(PlainOp::kEqual, code, node);
      case PlainNative::kNotEqual: return equality(PlainOp::kNotEqual, code, node);
      case PlainNative::kStrictEqual: return equality(PlainOp::kStrictEqual, code, node);
      case PlainNative::kStrictNotEqual: return equality(PlainOp::kStrictNotEqual, code, node);
      case PlainNative::kAnd:
        return is_needless(code, node) ? translate(code, node.b) : binary(PlainOp::kAnd, code, node);
      case PlainNative::kOr: return binary(PlainOp::kOr, code, node);
      case PlainNative::kConditional: {
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
  // `typeof x === 'number'` compares no texts.
  Operand equality(PlainOp op, const NativeCode& code, const NativeCode::Node& node) {
    const NativeCode::Node& kind = code.nodes[node.a];
    const NativeCode::Node& name = code.nodes[node.b];
    if (kind.op != PlainNative::kTypeof || name.op != PlainNative::kString) return binary(op, code, node);
    const bool differs = op == PlainOp::kNotEqual || op == PlainOp::kStrictNotEqual;
    const auto mask = kinds_named(code.strings[name.a]);
    return add({.op = PlainOp::kHasKind, .a = translate(code, kind.a), .b = differs ? ~mask : mask});
  }

  PlainPlan::Content& content_;
  const Model& model_;
  PlainPaths& paths_;
  std::size_t event_ = 0;
};

}  // namespace

std::uint32_t PlainPaths::add(std::string path) {
  const auto found = std::find(paths_.begin(), paths_.end(), path);
  if (found != paths_.end()) return static_cast<std::uint32_t>(found - paths_.begin());
  paths_.push_back(std::move(path));
  return static_cast<std::uint32_t>(paths_.size() - 1);
}

std::vector<std::vector<std::string>> PlainPaths::members() const {
  std::vector<std::vector<std::string>> all;
  for (const std::string& path : paths_) {
    std::vector<std::string>& members = all.emplace_back();
    for (std::size_t begin = 0; begin <= path.size();) {
      const std::size_t dot = std::min(path.find('.', begin), path.size());
      members.push_back(path.substr(begin, dot - begin));
      begin = dot + 1;
    }
  }
  return all;
}

std::optional<PlainPlan> PlainPlan::make(const Chart& chart, std::string_view event, PlainPaths& paths) {
  auto content = std::make_shared<Content>(chart);
  if (!PlainCompiler(*content, paths).run(event)) return std::nullopt;
  return PlainPlan(std::move(content));
}

}  // namespace sentree::scxml
