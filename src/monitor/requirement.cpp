#include "sentree/monitor/requirement.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/base/value.h"

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;

struct OperatorText {
  Kind kind;
  std::string_view text;
  int precedence;
};
constexpr std::array<OperatorText, 13> kOperators{{{Kind::kImplies, "implies", 1},
                                                   {Kind::kOr, "or", 2},
                                                   {Kind::kAnd, "and", 3},
                                                   {Kind::kEqual, "=", 5},
                                                   {Kind::kNotEqual, "!=", 5},
                                                   {Kind::kLess, "<", 5},
                                                   {Kind::kLessEqual, "<=", 5},
                                                   {Kind::kGreater, ">", 5},
                                                   {Kind::kGreaterEqual, ">=", 5},
                                                   {Kind::kAdd, "+", 6},
                                                   {Kind::kSubtract, "-", 6},
                                                   {Kind::kMultiply, "*", 7},
                                                   {Kind::kDivide, "/", 7}}};
constexpr int kPrecedenceNot = 4;
constexpr int kPrecedencePrimary = 9;

std::string dotted(const std::vector<std::string>& path) {
  std::string text;
  for (const std::string& part : path) text += (text.empty() ? "" : ".") + part;
  return text;
}

std::string write(const Condition& condition, int around);

std::string write_call(std::string_view name, const Condition& operand) {
  return fmt::format("{}({})", name, write(operand, 0));
}

std::string write_binary(const Condition& condition, const OperatorText& op, int around) {
  // The right side of - and / needs parentheses where it is of the same precedence; of implies the left one.
  const bool right = op.kind == Kind::kImplies;
  std::string text = fmt::format("{} {} {}", write(*condition.operands[0], right ? op.precedence + 1 : op.precedence),
                                 op.text, write(*condition.operands[1], right ? op.precedence : op.precedence + 1));
  return op.precedence < around ? fmt::format("({})", text) : text;
}

std::string write(const Condition& condition, int around) {
  switch (condition.kind) {
    case Kind::kNumber: return plain_decimal(condition.number) + (condition.unit.empty() ? "" : " " + condition.unit);
    case Kind::kText: return condition.is_word ? condition.text : fmt::format("\"{}\"", condition.text);
    case Kind::kTruth: return condition.number != 0 ? "true" : "false";
    case Kind::kName:
    case Kind::kDefined: return condition.text;
    case Kind::kValue:
      return condition.source->text() + (condition.path.empty() || condition.source->kind == Source::Kind::kNode
                                             ? ""
                                             : "." + dotted(condition.path));
    case Kind::kMember: return dotted(condition.path);
    case Kind::kEvent: return fmt::format("event({})", condition.source->text());
    case Kind::kUpdated: return write(*condition.operands[0], kPrecedencePrimary) + " updated";
    case Kind::kRises: return write_call("rises", *condition.operands[0]);
    case Kind::kFalls: return write_call("falls", *condition.operands[0]);
    case Kind::kNot: {
      const std::string text = "not " + write(*condition.operands[0], kPrecedenceNot);
      return kPrecedenceNot < around ? fmt::format("({})", text) : text;
    }
    case Kind::kNegate: return "-" + write(*condition.operands[0], kPrecedencePrimary);
    default: break;
  }
  const auto op = std::find_if(kOperators.begin(), kOperators.end(),
                               [&](const OperatorText& candidate) { return candidate.kind == condition.kind; });
  const Condition& left = *condition.operands[0];
  if (condition.kind == Kind::kEqual && left.kind == Kind::kValue && left.source->kind == Source::Kind::kNode &&
      condition.operands[1]->kind == Kind::kText) {
    return fmt::format("{} in {}", left.source->text(), condition.operands[1]->text);
  }
  return write_binary(condition, *op, around);
}

std::string scope_text(const Scope& scope) {
  switch (scope.kind) {
    case Scope::Kind::kGlobally: return "globally";
    case Scope::Kind::kBefore: return "before " + to_text(*scope.close);
    case Scope::Kind::kAfter: return "after " + to_text(*scope.open);
    case Scope::Kind::kBetween: return fmt::format("between {} and {}", write(*scope.open, 4), to_text(*scope.close));
    case Scope::Kind::kAfterUntil: return fmt::format("after {} until {}", to_text(*scope.open), to_text(*scope.close));
    case Scope::Kind::kWhile: return "while " + to_text(*scope.open);
  }
  return {};
}

std::string body_text(const Requirement& r) {
  const auto text = [](const ConditionPtr& condition) { return to_text(*condition); };
  const std::string bound = r.bound ? r.bound->text() : "";
  switch (r.pattern) {
    case Pattern::kAlways: return "always " + text(r.p);
    case Pattern::kNever: return "never " + text(r.p);
    case Pattern::kEventually: return fmt::format("eventually {}{}", text(r.p), r.bound ? " within " + bound : "");
    case Pattern::kRespond:
      return fmt::format("whenever {}, {}{}", text(r.p), text(r.q), r.bound ? " within " + bound : " eventually");
    case Pattern::kImmediately: return fmt::format("whenever {}, {} immediately", text(r.p), text(r.q));
    case Pattern::kKeepFor: return fmt::format("whenever {}, keep {} for {}", text(r.p), text(r.q), bound);
    case Pattern::kKeepUntil: return fmt::format("whenever {}, keep {} until {}", text(r.p), text(r.q), text(r.r));
    case Pattern::kNotFor:
      return fmt::format("whenever {}, not {} for {}", text(r.p), write(*r.q, kPrecedenceNot), bound);
    case Pattern::kPrecedes:
      return fmt::format("{} precedes {}{}", text(r.p), text(r.q), r.bound ? " by at most " + bound : "");
    case Pattern::kAtLeastEvery: return fmt::format("{} at least every {}", text(r.p), bound);
    case Pattern::kAtMost:
      return fmt::format("{} at most {} times{}", text(r.p), r.times, r.bound ? " per " + bound : "");
    case Pattern::kHoldsFor: return fmt::format("{} holds for at least {}", text(r.p), bound);
  }
  return {};
}

}  // namespace

std::vector<std::string> path_in_data(const Condition& value) {
  std::vector<std::string> path = value.path;
  if (value.kind == Kind::kValue && value.source->kind == Source::Kind::kReply) path.insert(path.begin(), "result");
  if (value.kind == Kind::kValue && value.source->kind == Source::Kind::kRequest) path.insert(path.begin(), "args");
  return path;
}

const Condition& inside(const Condition& condition) {
  const Condition* inner = &condition;
  while (inner->kind == Kind::kDefined) inner = inner->operands[0].get();
  return *inner;
}

std::string_view to_string(Importance importance) {
  switch (importance) {
    case Importance::kInfo: return "info";
    case Importance::kMinor: return "minor";
    case Importance::kMajor: return "major";
    case Importance::kCritical: return "critical";
  }
  return "major";
}

std::string Source::text() const {
  std::string inside = fmt::format("{}.{}", service, method);
  std::string_view word = "observation";
  switch (kind) {
    case Kind::kRequest: word = "request"; break;
    case Kind::kReply: word = "reply"; break;
    case Kind::kError: word = "error"; break;
    case Kind::kLate: word = "late"; break;
    case Kind::kNode: return fmt::format("node({})", from);
    case Kind::kObservation: inside = observation; break;
  }
  if (!from.empty()) inside += " from " + from;
  if (where) inside += " where " + to_text(*where);
  return fmt::format("{}({})", word, inside);
}

bool operator==(const Source& a, const Source& b) {
  const std::string a_where = a.where ? to_text(*a.where) : "";
  const std::string b_where = b.where ? to_text(*b.where) : "";
  return a.observation == b.observation && a.from == b.from && a_where == b_where;
}

std::string to_text(const Condition& condition) { return write(condition, 0); }

bool is_momentary(const Condition& condition) {
  switch (condition.kind) {
    case Kind::kEvent:
    case Kind::kUpdated:
    case Kind::kRises:
    case Kind::kFalls: return true;
    default:
      return std::any_of(condition.operands.begin(), condition.operands.end(),
                         [](const ConditionPtr& operand) { return is_momentary(*operand); });
  }
}

bool has_constant(const Condition& condition) {
  switch (condition.kind) {
    case Kind::kDefined:
    case Kind::kNot:
    case Kind::kAnd:
    case Kind::kOr:
    case Kind::kImplies:
      return std::any_of(condition.operands.begin(), condition.operands.end(),
                         [](const ConditionPtr& operand) { return has_constant(*operand); });
    default: break;
  }
  std::vector<Source> sources;
  collect_sources(condition, sources);
  return sources.empty();
}

void collect_sources(const Condition& condition, std::vector<Source>& sources) {
  if (condition.source && std::find(sources.begin(), sources.end(), *condition.source) == sources.end())
    sources.push_back(*condition.source);
  for (const ConditionPtr& operand : condition.operands) collect_sources(*operand, sources);
}

std::string Bound::text() const {
  if (unit == Unit::kTicks) return fmt::format("{} ticks", count);
  if (unit == Unit::kEvents) return fmt::format("{} events", count);
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  const std::int64_t ns = time.count();
  if (ns % (60 * kNsPerS) == 0) return fmt::format("{} min", ns / (60 * kNsPerS));
  if (ns % kNsPerS == 0) return fmt::format("{} s", ns / kNsPerS);
  return plain_decimal(static_cast<double>(ns) / 1e6) + " ms";
}

std::string Requirement::text() const {
  return fmt::format("{}, {}{}", scope_text(scope), body_text(*this),
                     assuming ? " assuming " + to_text(*assuming) : "");
}

std::vector<Source> sources_of(const Requirement& requirement) {
  std::vector<Source> sources;
  for (const ConditionPtr* condition : {&requirement.scope.open, &requirement.scope.close, &requirement.p,
                                        &requirement.q, &requirement.r, &requirement.assuming}) {
    if (*condition) collect_sources(**condition, sources);
  }
  if (requirement.bound && requirement.bound->unit == Bound::Unit::kTicks) {
    Source tick;
    tick.observation = "mission.tick";
    if (std::find(sources.begin(), sources.end(), tick) == sources.end()) sources.push_back(std::move(tick));
  }
  return sources;
}

}  // namespace sentree::monitor
