#include "sentree/verify/detail/vacuity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {

namespace {

using monitor::Condition;
using monitor::Pattern;
using monitor::Requirement;
using monitor::Source;

// Which truth values a condition can have where some of what it speaks of is never seen (Kleene).
struct Possible {
  bool yes = true;
  bool no = true;
};

// That an event never comes is what is asked for, and may be so.
bool speaks_of_events(const Condition& condition) {
  if (condition.kind == Condition::Kind::kEvent) return true;
  return !condition.operands.empty() && std::all_of(condition.operands.begin(), condition.operands.end(),
                                                    [](const auto& operand) { return speaks_of_events(*operand); });
}
bool is_ruled_out(const Requirement& of) {
  const bool forbids = of.pattern == Pattern::kNever || of.pattern == Pattern::kAtMost ||
                       (of.pattern == Pattern::kAlways && monitor::inside(*of.p).kind == Condition::Kind::kNot);
  return forbids && speaks_of_events(*of.p);
}

// What a condition needs of observations: that they come, and of a value that they have it.
struct Needed {
  Source source;
  std::vector<std::string> path;  // from the data on
  bool is_value = false;
  std::string text;
};

void collect_needed(const Condition& condition, bool is_value, std::vector<Needed>& needed) {
  if (condition.source) {
    Needed one{*condition.source, {}, is_value && condition.kind == Condition::Kind::kValue, ""};
    if (one.is_value) {
      one.path = condition.path;
      if (one.source.kind == Source::Kind::kReply) one.path.insert(one.path.begin(), "result");
      if (one.source.kind == Source::Kind::kRequest) one.path.insert(one.path.begin(), "args");
      one.text = monitor::to_text(condition);
    }
    needed.push_back(std::move(one));
  }
  // "updated" asks for the observation alone.
  const bool is_value_below = is_value && condition.kind != Condition::Kind::kUpdated;
  for (const auto& operand : condition.operands) collect_needed(*operand, is_value_below, needed);
}
std::vector<Needed> needed_by(const Condition& condition) {
  std::vector<Needed> needed;
  collect_needed(condition, true, needed);
  return needed;
}

// What is no number can be compared with nothing.
bool has(const Value& data, const std::vector<std::string>& path) {
  const Value* value = &data;
  for (const std::string& name : path) {
    value = value->find(name);
    if (value == nullptr) return false;
  }
  return !value->is_null() && !(value->as_double() != nullptr && std::isnan(*value->as_double()));
}

class Looking {
 public:
  Looking(const Graph& graph, const monitor::Model& model, const MonitorMemory& memory)
      : graph_(graph), model_(model), memory_(memory) {}

  Vacuity operator()() {
    const monitor::Origin* origin = model_.origin();
    const bool may_be_silent =
        origin != nullptr && !origin->requirement.scope.open && is_ruled_out(origin->requirement);
    if (!memory_.ever_heard() && !may_be_silent) return {"no observation that it waits for is ever made", {}};
    if (origin == nullptr) return {};
    const Requirement& of = origin->requirement;
    Vacuity out;
    look_for_unseen(of, out);
    if (out.why.empty()) out.why = why_not_decided(of);
    if (out.why.empty() && !(memory_.ever_inside() && opens(of))) out.why = "its scope never begins";
    if (out.why.empty() && of.scope.kind == monitor::Scope::Kind::kBetween && !is_ever(of, of.scope.close))
      out.why = "its scope never ends, and only what is closed counts";
    if (out.why.empty() && !is_ever_assumed(of)) out.why = "what it assumes never holds";
    if (out.why.empty() && !is_ever_triggered(of)) out.why = "it is never triggered";
    return out;
  }

 private:
  // Those that the source means, as its `where` decides of each.
  const std::vector<const Message*>& seen(const Source& source) {
    const auto [known, is_new] = seen_.try_emplace(source.text());
    if (!is_new) return known->second;
    for (const Message& message : graph_.observations) {
      if (message.name == source.observation && (source.from.empty() || message.source == source.from))
        known->second.push_back(&message);
    }
    if (!source.where || known->second.empty()) return known->second;
    auto event = std::make_shared<Condition>();
    event->kind = Condition::Kind::kEvent;
    event->source = source;
    Requirement never;
    never.name = "seen";
    never.pattern = Pattern::kNever;
    never.p = std::move(event);
    never.span = source.span;
    const auto made = monitor::Model::make(never);
    if (!made.ok()) return known->second;
    std::erase_if(known->second, [&](const Message* message) {
      monitor::Core core = monitor::begin(*made.value, message->time);
      return monitor::step(*made.value, core, *message).verdict != monitor::Verdict::kViolated;
    });
    return known->second;
  }

  // What is never observed of it, as the requirement has it; empty: it is.
  std::string unseen(const Needed& needed) {
    const std::vector<const Message*>& messages = seen(needed.source);
    if (messages.empty()) return needed.source.text();
    const bool comes = !needed.is_value || std::any_of(messages.begin(), messages.end(), [&](const Message* message) {
      return has(event_data(*message), needed.path);
    });
    return comes ? "" : needed.text;
  }

  // Of a condition that is wanted nothing is ever seen.
  void look_for_unseen(const Requirement& of, Vacuity& out) {
    for (const auto& condition : {of.scope.open, of.scope.close, of.p, of.q, of.r, of.assuming}) {
      if (!condition) continue;
      const std::vector<Needed> needed = needed_by(*condition);
      std::vector<std::string> missing;
      for (const Needed& one : needed) {
        if (std::string text = unseen(one); !text.empty()) missing.push_back(std::move(text));
      }
      const bool can_be_wanting = condition != of.scope.close && condition != of.r && condition != of.assuming &&
                                  !(condition == of.p && is_ruled_out(of));
      if (can_be_wanting && !needed.empty() && missing.size() == needed.size() && out.why.empty())
        out.why = fmt::format("{} is never seen", missing.front());
      for (std::string& text : missing) {
        auto& all = out.never_seen;
        if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(std::move(text));
      }
    }
  }

  // What is not known decides nothing: without a value that never comes nothing may be left that violates it.
  [[nodiscard]] std::string why_not_decided(const Requirement& of) {
    unseen_.clear();
    bool is_decided = true;
    switch (of.pattern) {
      case Pattern::kAlways: is_decided = possible(*of.p).no; break;
      case Pattern::kNever:
      case Pattern::kAtMost: is_decided = possible(*of.p).yes; break;
      case Pattern::kImmediately:
      case Pattern::kKeepFor:
      case Pattern::kKeepUntil: is_decided = possible(*of.p).yes && possible(*of.q).no; break;
      case Pattern::kNotFor: is_decided = possible(*of.p).yes && possible(*of.q).yes; break;
      case Pattern::kPrecedes: is_decided = possible(*of.q).yes; break;
      case Pattern::kRespond: is_decided = possible(*of.p).yes; break;
      case Pattern::kHoldsFor: {
        const Possible p = possible(*of.p);
        is_decided = p.yes && p.no;
        break;
      }
      case Pattern::kEventually:
      case Pattern::kAtLeastEvery: break;  // silence violates it
    }
    return is_decided || unseen_.empty() ? ""
                                         : fmt::format("{} is never seen, and nothing violates it without", unseen_);
  }

  [[nodiscard]] Possible possible(const Condition& condition) {
    using Kind = Condition::Kind;
    const auto operand = [&](std::size_t i) { return possible(*condition.operands[i]); };
    switch (condition.kind) {
      case Kind::kDefined: return operand(0);
      case Kind::kNot: {
        const Possible of = operand(0);
        return {.yes = of.no, .no = of.yes};
      }
      case Kind::kAnd:
      case Kind::kOr:
      case Kind::kImplies: {
        Possible a = operand(0);
        const Possible b = operand(1);
        if (condition.kind == Kind::kImplies) std::swap(a.yes, a.no);
        return condition.kind == Kind::kAnd ? Possible{.yes = a.yes && b.yes, .no = a.no || b.no}
                                            : Possible{.yes = a.yes || b.yes, .no = a.no && b.no};
      }
      case Kind::kEvent: return {};  // one that does not come is known not to hold
      case Kind::kUpdated:
      case Kind::kRises:
      case Kind::kFalls: return {.yes = is_known(condition), .no = true};
      default: {
        const bool known = is_known(condition);
        return {.yes = known, .no = known};
      }
    }
  }

  // All values that it speaks of are seen.
  [[nodiscard]] bool is_known(const Condition& condition) {
    for (const Needed& needed : needed_by(condition)) {
      std::string text = unseen(needed);
      if (text.empty()) continue;
      unseen_ = std::move(text);
      return false;
    }
    return true;
  }

  // What holds *while* something does has no memory of it: whether that is ever so is a question of its own.
  [[nodiscard]] bool opens(const Requirement& of) const {
    return of.scope.kind != monitor::Scope::Kind::kWhile || is_ever(of, of.scope.open);
  }

  // Before it is known whether the assumption holds, it interrupts nothing.
  [[nodiscard]] bool is_ever_assumed(const Requirement& of) const {
    if (!of.assuming || is_ever(of, of.assuming)) return true;
    if (of.pattern == Pattern::kEventually || of.pattern == Pattern::kAtLeastEvery) return true;  // silence violates it
    const auto join = [](Condition::Kind kind, std::vector<monitor::ConditionPtr> operands) {
      auto joined = std::make_shared<Condition>();
      joined->kind = kind;
      joined->operands = std::move(operands);
      return monitor::ConditionPtr(std::move(joined));
    };
    std::vector<Source> sources;
    for (const auto& condition : {of.p, of.q}) {
      if (condition) monitor::collect_sources(*condition, sources);
    }
    monitor::ConditionPtr any;
    for (const Source& source : sources) {
      auto event = std::make_shared<Condition>();
      event->kind = Condition::Kind::kEvent;
      event->source = source;
      event->source->where = nullptr;
      any = any ? join(Condition::Kind::kOr, {any, event}) : monitor::ConditionPtr(std::move(event));
    }
    Requirement early;
    early.scope.kind = monitor::Scope::Kind::kBefore;
    early.scope.close =
        join(Condition::Kind::kOr, {of.assuming, join(Condition::Kind::kNot, {of.assuming})});  // it is known
    early.p = any;
    return !any || is_violated(of, std::move(early));
  }

  // Where it applies. What has no trigger asks for something from the beginning.
  [[nodiscard]] bool is_ever_triggered(const Requirement& of) const {
    Requirement never;
    switch (of.pattern) {
      case Pattern::kRespond:
      case Pattern::kKeepFor:
      case Pattern::kKeepUntil:
      case Pattern::kNotFor:
      case Pattern::kHoldsFor:
        if (memory_.ever_owed()) return true;
        never.p = of.p;
        break;
      case Pattern::kImmediately: never.p = of.p; break;
      case Pattern::kPrecedes: never.p = of.q; break;
      default: return true;
    }
    never.scope = of.scope;
    never.assuming = of.assuming;
    return is_violated(of, std::move(never));
  }

  [[nodiscard]] bool is_ever(const Requirement& of, const monitor::ConditionPtr& condition) const {
    Requirement never;
    never.p = condition;
    return is_violated(of, std::move(never));
  }
  // Whether something comes that is asked for never to come. True if that cannot be asked.
  [[nodiscard]] bool is_violated(const Requirement& of, Requirement never) const {
    never.name = of.name;
    never.pattern = Pattern::kNever;
    never.span = of.span;
    const auto made = monitor::Model::make(never);
    if (!made.ok()) return true;
    JudgeOptions options;
    options.probabilities = false;
    return judge(graph_, *made.value, options).finding != Finding::kHolds;
  }

  const Graph& graph_;
  const monitor::Model& model_;
  const MonitorMemory& memory_;
  std::string unseen_;                                       // some value, that never comes
  std::map<std::string, std::vector<const Message*>> seen_;  // by the text of a source
};

}  // namespace

Vacuity vacuity(const Graph& graph, const monitor::Model& model, const MonitorMemory& memory) {
  return Looking(graph, model, memory)();
}

}  // namespace sentree::verify
