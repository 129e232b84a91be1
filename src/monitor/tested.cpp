#include "sentree/monitor/tested.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;

ConditionPtr made_of(Kind kind, std::vector<ConditionPtr> operands) {
  auto made = std::make_shared<Condition>();
  made->kind = kind;
  made->operands = std::move(operands);
  return made;
}
ConditionPtr negation_of(ConditionPtr condition) { return made_of(Kind::kNot, {std::move(condition)}); }
// In Kleene's logic: true if it is known whether it holds, else unknown. Of an event that is always known.
ConditionPtr known(const ConditionPtr& condition) { return made_of(Kind::kOr, {condition, negation_of(condition)}); }

bool speaks_of_events(const Condition& condition) {
  if (condition.kind == Kind::kEvent) return true;
  return !condition.operands.empty() && std::all_of(condition.operands.begin(), condition.operands.end(),
                                                    [](const auto& operand) { return speaks_of_events(*operand); });
}

// True where enough of it is known for it to have that truth value, whatever it has.
ConditionPtr could_be(bool wanted, const ConditionPtr& condition) {
  const auto operand = [&](bool as, std::size_t i) { return could_be(as, condition->operands[i]); };
  switch (condition->kind) {
    case Kind::kDefined: return operand(wanted, 0);
    case Kind::kNot: return operand(!wanted, 0);
    case Kind::kAnd: return made_of(wanted ? Kind::kAnd : Kind::kOr, {operand(wanted, 0), operand(wanted, 1)});
    case Kind::kOr: return made_of(wanted ? Kind::kOr : Kind::kAnd, {operand(wanted, 0), operand(wanted, 1)});
    case Kind::kImplies: return made_of(wanted ? Kind::kOr : Kind::kAnd, {operand(!wanted, 0), operand(wanted, 1)});
    case Kind::kRises:
    case Kind::kFalls: return known(wanted ? condition->operands[0] : condition);
    // Unlike an event, it stands for a value, which must come.
    case Kind::kUpdated: return wanted ? condition : known(condition);
    default: return known(condition);
  }
}

// True where something of it comes, or is known.
ConditionPtr any_known(const ConditionPtr& condition) {
  switch (condition->kind) {
    case Kind::kDefined:
    case Kind::kNot: return any_known(condition->operands[0]);
    case Kind::kAnd:
    case Kind::kOr:
    case Kind::kImplies:
      return made_of(Kind::kOr, {any_known(condition->operands[0]), any_known(condition->operands[1])});
    case Kind::kEvent:
    case Kind::kUpdated: return condition;
    case Kind::kRises:
    case Kind::kFalls: return known(condition->operands[0]);
    default: return known(condition);
  }
}

}  // namespace

bool is_ruled_out(const Requirement& of) {
  const bool forbids = of.pattern == Pattern::kNever || of.pattern == Pattern::kAtMost ||
                       (of.pattern == Pattern::kAlways && inside(*of.p).kind == Kind::kNot);
  return forbids && speaks_of_events(*of.p);
}

std::optional<Requirement> test_of(const Requirement& requirement) {
  if (is_ruled_out(requirement) && !requirement.scope.open && !requirement.assuming) return std::nullopt;
  Requirement test = requirement;
  test.re_arming = false;
  // Of what is asked for while something lasts: the same, of whether that is known.
  const auto keep = [&](Pattern pattern, bool wanted) {
    test.pattern = pattern;
    test.q = negation_of(could_be(wanted, requirement.q));
  };
  const auto never = [&](ConditionPtr condition) {
    test.pattern = Pattern::kNever;
    test.p = std::move(condition);
    test.q = test.r = nullptr;
    test.bound.reset();
  };
  switch (requirement.pattern) {
    case Pattern::kAlways: never(could_be(false, requirement.p)); break;
    case Pattern::kNever:
    case Pattern::kAtMost: never(could_be(true, requirement.p)); break;
    case Pattern::kEventually:
    case Pattern::kAtLeastEvery: never(any_known(requirement.p)); break;
    case Pattern::kRespond: never(requirement.p); break;
    case Pattern::kPrecedes: never(requirement.q); break;
    case Pattern::kHoldsFor: never(made_of(Kind::kRises, {requirement.p})); break;
    case Pattern::kImmediately:
    case Pattern::kKeepFor:
    case Pattern::kKeepUntil: keep(requirement.pattern, false); break;
    case Pattern::kNotFor: keep(Pattern::kKeepFor, true); break;
  }
  return test;
}

}  // namespace sentree::monitor
