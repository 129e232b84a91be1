#include "sentree/monitor/detail/requirement_script.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;
using Type = DataType::Kind;

constexpr int kOr = 1;
constexpr int kAnd = 2;
constexpr int kEquality = 4;
constexpr int kRelation = 5;
constexpr int kSum = 6;
constexpr int kProduct = 7;
constexpr int kUnary = 8;
constexpr int kPrimary = 9;

std::string in(const Js& js, int around) { return js.binding < around ? fmt::format("({})", js.text) : js.text; }
Js infix(const Js& a, std::string_view op, const Js& b, int binding) {
  return {fmt::format("{} {} {}", in(a, binding), op, in(b, binding + 1)), binding};
}

std::string script_text(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

// Names that would mean something else in a script.
bool is_taken_by_scripts(std::string_view name) {
  constexpr std::array<std::string_view, 16> kWords{"undefined", "NaN",       "Infinity", "In",     "Math",    "Date",
                                                    "Object",    "Array",     "String",   "Number", "Boolean", "JSON",
                                                    "eval",      "arguments", "name",     "event"};
  return scxml::is_reserved_word(name) || std::find(kWords.begin(), kWords.end(), name) != kWords.end();
}

std::string identifier(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool keep = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (keep)
      out += c;
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  if (out.empty() || (out[0] >= '0' && out[0] <= '9')) out = "v_" + out;
  return out;
}

std::string_view type_name(Type type) {
  switch (type) {
    case Type::kNumber: return "number";
    case Type::kTruth: return "boolean";
    case Type::kText: return "string";
    default: return "";
  }
}

// Whether what stands there is of the type. A number that an enumeration does not name is one of its values as well.
Js is_of(const std::string& place, const DataType& type) {
  if (!type.words.empty()) return {fmt::format("typeof {0} === 'string' || typeof {0} === 'number'", place), kOr};
  return {fmt::format("typeof {} === '{}'", place, type_name(type.kind)), kEquality};
}

}  // namespace

bool is_true(const Js& js) { return js.text == "true"; }
bool is_false(const Js& js) { return js.text == "false"; }
Js js_and(const Js& a, const Js& b) {
  if (is_false(a) || is_true(b)) return a;
  if (is_false(b) || is_true(a)) return b;
  return {fmt::format("{} && {}", in(a, kAnd), in(b, kAnd)), kAnd};
}
Js js_or(const Js& a, const Js& b) {
  if (is_true(a) || is_false(b)) return a;
  if (is_true(b) || is_false(a)) return b;
  return {fmt::format("{} || {}", in(a, kOr), in(b, kOr)), kOr};
}
Js js_not(const Js& a) {
  if (is_true(a)) return js_false();
  if (is_false(a)) return js_true();
  if (a.binding == kUnary && a.text.starts_with("!(")) return {a.text.substr(2, a.text.size() - 3), kOr};
  if (a.binding == kUnary && a.text.starts_with('!')) return {a.text.substr(1), kPrimary};
  const std::size_t equals = a.text.find(" === ");
  if (a.binding == kEquality && equals != std::string::npos && equals == a.text.rfind(" === ")) {
    std::string text = a.text;
    return {text.replace(equals + 1, 3, "!=="), kEquality};
  }
  return {"!" + in(a, kUnary), kUnary};
}

bool reads(const Js& js, std::string_view name) {
  const auto is_part = [&](std::size_t at) {
    const char c = at < js.text.size() ? js.text[at] : ' ';
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  for (std::size_t at = js.text.find(name); at != std::string::npos; at = js.text.find(name, at + 1)) {
    const bool is_member = at > 0 && (is_part(at - 1) || js.text[at - 1] == '.');
    if (!is_member && !is_part(at + name.size())) return true;
  }
  return false;
}

std::string slug(const Condition& condition, std::size_t length_max) {
  std::string text;
  const std::string written = to_text(condition);
  for (std::size_t i = 0; i < written.size(); ++i) {
    const std::string_view rest = std::string_view(written).substr(i);
    const auto word = [&](std::string_view symbol, std::string_view name) {
      if (!rest.starts_with(symbol)) return false;
      text += fmt::format(" {} ", name);
      i += symbol.size() - 1;
      return true;
    };
    if (word("event(", "") || word("!=", "is not") || word("<=", "at most") || word(">=", "at least")) continue;
    if (word("<", "below") || word(">", "above") || word("=", "is") || word("%", "percent")) continue;
    text += written[i];
  }
  std::string name = identifier(text);
  if (name.size() > length_max) {
    const std::size_t cut = name.rfind('_', length_max);
    name.resize(cut == std::string::npos || cut == 0 ? length_max : cut);
  }
  return name;
}

Script::Script(const Requirement& requirement, const Typing& typing, std::string_view present)
    : requirement_(requirement), typing_(typing), present_(present) {
  for (const char* name : {"in_scope", "ticks", "observations", "count", "watching", "violated", "satisfied",
                           "from_closed", "newer_owed", "second_timer", "ticks_of_newer", "observations_of_newer"})
    taken_.emplace_back(name);
  for (const ConditionPtr* condition : {&requirement.p, &requirement.q, &requirement.r, &requirement.scope.open,
                                        &requirement.scope.close, &requirement.assuming}) {
    if (*condition) name_values(**condition);
  }
}

std::string Script::unique(std::string name) {
  if (is_taken_by_scripts(name)) name += "_value";
  std::string candidate = name;
  for (int i = 2; std::find(taken_.begin(), taken_.end(), candidate) != taken_.end(); ++i)
    candidate = fmt::format("{}_{}", name, i);
  taken_.push_back(candidate);
  return candidate;
}

// A value or an event that has a name in the requirement keeps it in the chart.
void Script::name_values(const Condition& condition) {
  if (condition.kind == Kind::kDefined) {
    const Condition& content = *condition.operands[0];
    if (merged(condition) != nullptr) return;
    if (content.kind == Kind::kValue) (void)variable(content, identifier(condition.text));
    if (content.kind == Kind::kEvent) {
      std::string_view name = condition.text;
      if (name.starts_with("event(")) name = name.substr(6, name.size() - 7);
      (void)flag(content, identifier(name));
    }
  }
  // "x updated" asks for the observation, not for x.
  if (condition.kind == Kind::kUpdated) return;
  for (const ConditionPtr& operand : condition.operands) name_values(*operand);
}

DataType Script::type_of(const Condition& condition) const {
  const Condition& inner = inside(condition);
  switch (inner.kind) {
    case Kind::kValue:
    case Kind::kMember: {
      const auto found = typing_.find((inner.kind == Kind::kMember ? where_key_ : "") + to_text(inner));
      return found == typing_.end() ? DataType() : found->second;
    }
    case Kind::kText: return {.kind = Type::kText};
    case Kind::kTruth: return {.kind = Type::kTruth};
    default: return {.kind = Type::kNumber};
  }
}

std::string Script::raw(const Condition& value) {
  std::string place = "_event.data";
  for (const std::string& member : path_in_data(value)) place += "." + member;
  return place;
}

// Whether the observation has what the value is a member of.
Js Script::holders(const Condition& value) {
  Js guard = js_true();
  std::string place = "_event.data";
  const std::vector<std::string> path = path_in_data(value);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    place += "." + path[i];
    guard = js_and(guard, {place, kPrimary});
  }
  return guard;
}

// Whether the observation has the value.
Js Script::guard(const Condition& value) const {
  const std::string place = raw(value);
  const DataType type = type_of(value);
  Js guard =
      js_and(holders(value), type_name(type.kind).empty() ? Js{place + " !== null", kEquality} : is_of(place, type));
  return {std::move(guard.text), guard.binding == kOr ? kOr : kAnd};
}

const Script::Variable& Script::variable(const Condition& value, std::string_view name) {
  const std::string key = to_text(value);
  if (const auto known = known_.find(key); known != known_.end()) return variables_[known->second];
  known_[key] = variables_.size();
  variables_.push_back({.name = unique(std::string(name)),
                        .shown = key,
                        .assigned = type_of(value).may_be_absent
                                        ? fmt::format("{} ? {} : undefined", guard(value).text, raw(value))
                                        : raw(value),
                        .sources = {*value.source}});
  return variables_.back();
}

// A number that is computed from one observation is computed when that comes. Null: it is no such thing.
const Script::Variable* Script::merged(const Condition& defined) {
  const Condition& content = *defined.operands[0];
  if (content.kind < Kind::kNegate) return nullptr;
  const std::string key = "= " + defined.text;
  if (const auto known = known_.find(key); known != known_.end()) return &variables_[known->second];
  std::vector<Source> sources;
  collect_sources(content, sources);
  if (sources.size() != 1) return nullptr;
  // Written in place of the value's name; parts that may be missing need a variable of their own.
  bool always_there = true;
  const auto place = [&](const auto& self, const Condition& c) -> Js {
    if (c.kind == Kind::kValue) {
      always_there = always_there && !type_of(c).may_be_absent;
      return {raw(c), kPrimary};
    }
    if (c.kind == Kind::kNumber) return {plain_decimal(c.number), kPrimary};
    if (c.kind == Kind::kDefined) return self(self, *c.operands[0]);
    if (c.kind == Kind::kNegate) return {"-" + in(self(self, *c.operands[0]), kPrimary), kUnary};
    const std::string_view op = c.kind == Kind::kAdd        ? "+"
                                : c.kind == Kind::kSubtract ? "-"
                                : c.kind == Kind::kMultiply ? "*"
                                                            : "/";
    const int binding = c.kind == Kind::kAdd || c.kind == Kind::kSubtract ? kSum : kProduct;
    return infix(self(self, *c.operands[0]), op, self(self, *c.operands[1]), binding);
  };
  const Js js = place(place, content);
  if (!always_there) return nullptr;
  known_[key] = variables_.size();
  variables_.push_back({.name = unique(identifier(defined.text)),
                        .shown = to_text(content),
                        .assigned = js.text,
                        .sources = std::move(sources)});
  return &variables_.back();
}

const Script::Variable& Script::flag(const Condition& event, std::string_view name) {
  const std::string key = "! " + to_text(event);
  if (const auto known = known_.find(key); known != known_.end()) return variables_[known->second];
  std::vector<Source> sources;
  collect_sources(event, sources);
  known_[key] = variables_.size();
  variables_.push_back(
      {.name = unique(std::string(name)), .shown = to_text(event), .assigned = "", .sources = sources});
  return variables_.back();
}

Js Script::before(const Condition& condition, bool wanted) {
  Js now = truth(condition, wanted);
  if (is_true(now) || is_false(now)) return now;
  auto known = before_known_.find(now.text);
  if (known == before_known_.end()) {
    const std::string name = unique(fmt::format("{}{}_before", wanted ? "" : "not_", slug(condition, 30)));
    before_.push_back({name, now.text, (wanted ? "" : "not ") + to_text(condition)});
    known = before_known_.emplace(now.text, name).first;
  }
  return {known->second, kPrimary};
}

Js Script::held_before(const ConditionPtr& condition) { return before(*condition, true); }

Js Script::filter(const Source& source) {
  Js result = js_true();
  // A descriptor also matches longer names; those of calls, leaves and ticks have none.
  const std::size_t dot = source.observation.rfind('.');
  constexpr std::array<std::string_view, 8> kLast{"request", "reply",  "error",     "late",
                                                  "tick",    "status", "injection", "log"};
  const std::string last = dot == std::string::npos ? "" : source.observation.substr(dot + 1);
  if (std::find(kLast.begin(), kLast.end(), last) == kLast.end() || source.observation.ends_with(".tick")) {
    if (source.observation != "mission.tick")
      result = {"_event.name === " + script_text(source.observation), kEquality};
  }
  if (!source.from.empty()) result = js_and(result, {"_event.data.source === " + script_text(source.from), kEquality});
  if (source.where) {
    where_key_ = source.observation + " ";
    result = js_and(result, truth(*source.where, true));
    where_key_.clear();
  }
  return result;
}

Js Script::is_meant(const std::string& observation) {
  std::vector<std::string> filters;
  Js any = js_false();
  for (const Source& source : sources_of(requirement_)) {
    if (source.observation != observation) continue;
    const Js one = filter(source);
    if (std::find(filters.begin(), filters.end(), one.text) != filters.end()) continue;
    filters.push_back(one.text);
    any = js_or(any, one);
  }
  return any;
}

Js Script::is_set(const Variable& variable, const std::string& observation) {
  Js set = js_false();
  for (const Source& source : variable.sources) {
    if (source.observation == observation) set = js_or(set, filter(source));
  }
  return set.text == is_meant(observation).text ? js_true() : set;
}

// What the present observation says; what another one said is the variable's.
Js Script::at_present(const Variable& variable, const Js& expression) {
  return !present_.empty() && is_true(is_set(variable, present_)) ? expression : Js{variable.name, kPrimary};
}

// Whether the present observation has the values in an expression: variables are undefined where theirs did not.
Js Script::is_there(const Condition& c) const {
  const auto may_lack = [&] { return type_of(c).may_be_absent; };
  if (c.kind == Kind::kMember) return may_lack() ? holders(c) : js_true();
  if (c.kind == Kind::kValue)
    return !present_.empty() && c.source->observation == present_ && may_lack() ? guard(c) : js_true();
  if (c.kind != Kind::kDefined && c.kind < Kind::kNegate) return js_true();
  Js there = js_true();
  for (const ConditionPtr& operand : c.operands) there = js_and(there, is_there(*operand));
  return there;
}

Js Script::value(const Condition& c) {
  switch (c.kind) {
    case Kind::kNumber: return {plain_decimal(c.number), kPrimary};
    case Kind::kText: return {script_text(c.text), kPrimary};
    case Kind::kTruth: return c.number != 0 ? js_true() : js_false();
    case Kind::kDefined:
      if (const Variable* one = merged(c)) return at_present(*one, {one->assigned, one->binding});
      return value(*c.operands[0]);
    case Kind::kMember: return {raw(c), kPrimary};
    case Kind::kValue: {
      std::string name =
          c.source->service.empty() ? c.source->observation : fmt::format("{}_{}", c.source->service, c.source->method);
      if (!c.path.empty())
        name = fmt::format("{}_{}", c.source->service.empty() ? name : c.source->service, c.path.back());
      if (c.source->kind == Source::Kind::kNode) name = c.source->from + "_status";
      return at_present(variable(c, identifier(name)), {raw(c), kPrimary});
    }
    case Kind::kNegate: return {"-" + in(value(*c.operands[0]), kPrimary), kUnary};
    case Kind::kAdd: return infix(value(*c.operands[0]), "+", value(*c.operands[1]), kSum);
    case Kind::kSubtract: return infix(value(*c.operands[0]), "-", value(*c.operands[1]), kSum);
    case Kind::kMultiply: return infix(value(*c.operands[0]), "*", value(*c.operands[1]), kProduct);
    case Kind::kDivide: return infix(value(*c.operands[0]), "/", value(*c.operands[1]), kProduct);
    default: return js_false();  // refused by the check: no value
  }
}

Js Script::truth(const Condition& c, bool wanted) {
  switch (c.kind) {
    case Kind::kTruth: return (c.number != 0) == wanted ? js_true() : js_false();
    case Kind::kDefined: return truth(*c.operands[0], wanted);
    case Kind::kValue:
    case Kind::kMember: return js_and(is_there(c), {value(c).text + (wanted ? " === true" : " === false"), kEquality});
    case Kind::kEvent:
    case Kind::kUpdated: {
      std::string name;
      if (c.kind == Kind::kEvent) {
        name = identifier(c.source->observation);
      } else {
        const Condition& what = *c.operands[0];
        name = (what.kind == Kind::kDefined ? identifier(what.text) : slug(what, 30)) + "_updated";
      }
      const Variable& raised = flag(c, name);
      const Js js = present_.empty() ? Js{raised.name, kPrimary} : is_set(raised, present_);
      return wanted ? js : js_not(js);
    }
    case Kind::kRises:
    case Kind::kFalls: {
      const bool up = c.kind == Kind::kRises;
      const Condition& inner = *c.operands[0];
      if (wanted) return js_and(before(inner, !up), truth(inner, up));
      return js_or(truth(inner, !up), before(inner, up));
    }
    case Kind::kNot: return truth(*c.operands[0], !wanted);
    case Kind::kAnd:
    case Kind::kOr: {
      const Js a = truth(*c.operands[0], wanted);
      const Js b = truth(*c.operands[1], wanted);
      return (c.kind == Kind::kAnd) == wanted ? js_and(a, b) : js_or(a, b);
    }
    case Kind::kImplies: {
      const Js a = truth(*c.operands[0], !wanted);
      const Js b = truth(*c.operands[1], wanted);
      return wanted ? js_or(a, b) : js_and(a, b);
    }
    case Kind::kEqual: return equal(c, wanted);
    case Kind::kNotEqual: return equal(c, !wanted);
    default: return compare(c, wanted);
  }
}

Js Script::compare(const Condition& c, bool wanted) {
  std::string_view op;
  switch (c.kind) {
    case Kind::kLess: op = wanted ? "<" : ">="; break;
    case Kind::kLessEqual: op = wanted ? "<=" : ">"; break;
    case Kind::kGreater: op = wanted ? ">" : "<="; break;
    case Kind::kGreaterEqual: op = wanted ? ">=" : "<"; break;
    default: return js_false();  // refused by the check: no condition
  }
  return js_and(js_and(is_there(*c.operands[0]), is_there(*c.operands[1])),
                infix(value(*c.operands[0]), op, value(*c.operands[1]), kRelation));
}

Js Script::equal(const Condition& c, bool wanted) {
  const Condition& left = *c.operands[0];
  const Condition& right = *c.operands[1];
  const Js a = value(left);
  const Js b = value(right);
  const Js there = js_and(is_there(left), is_there(right));
  Type type = type_of(left).kind;
  if (type == Type::kUnknown) type = type_of(right).kind;
  if (type == Type::kNumber) {
    // Of what is no number (undefined, 0/0) neither holds; two that are undefined are equal to JavaScript.
    const auto is_literal = [](const Condition& side) { return inside(side).kind == Kind::kNumber; };
    if (wanted) {
      const Js set = is_literal(left) || is_literal(right)
                         ? there
                         : js_and(there, {fmt::format("typeof {} === 'number'", in(a, kPrimary)), kEquality});
      return js_and(set, infix(a, "===", b, kEquality));
    }
    return js_and(there, js_or(infix(a, "<", b, kRelation), infix(a, ">", b, kRelation)));
  }
  Js set = there;
  for (const Condition* side : {&left, &right}) {
    const Condition& inner = inside(*side);
    if (inner.kind != Kind::kValue && inner.kind != Kind::kMember) continue;
    const bool literal_other = inside(side == &left ? right : left).kind != Kind::kValue &&
                               inside(side == &left ? right : left).kind != Kind::kMember;
    if (wanted && literal_other) continue;  // equal to a literal: it is set
    DataType one = type_of(inner);
    one.kind = type;
    set = js_and(set, type_name(type).empty() ? Js{value(inner).text + " !== undefined", kEquality}
                                              : is_of(value(inner).text, one));
  }
  return js_and(set, infix(a, wanted ? "===" : "!==", b, kEquality));
}

}  // namespace sentree::monitor
