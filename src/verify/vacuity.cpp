#include "sentree/verify/detail/vacuity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/monitor/tested.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {

namespace {

using monitor::Condition;
using monitor::Pattern;
using monitor::Requirement;
using monitor::Source;

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
      one.path = monitor::path_in_data(condition);
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
    if (origin == nullptr) {
      if (memory_.ever_heard()) return {};
      return {"no observation that it waits for is ever made", {}};
    }
    Vacuity out;
    std::string unseen = look_for_unseen(origin->requirement, out);
    if (model_.test() != nullptr && !is_violated(*model_.test()))
      out.why = why_not_tested(origin->requirement, std::move(unseen), out.never_seen);
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

  // What of a condition that is wanted comes first, if nothing of it is ever seen; empty: something is.
  std::string look_for_unseen(const Requirement& of, Vacuity& out) {
    std::string first;
    for (const auto& condition : {of.scope.open, of.scope.close, of.p, of.q, of.r, of.assuming}) {
      if (!condition) continue;
      const std::vector<Needed> needed = needed_by(*condition);
      std::vector<std::string> missing;
      for (const Needed& one : needed) {
        if (std::string text = unseen(one); !text.empty()) missing.push_back(std::move(text));
      }
      const bool is_wanted = condition != of.scope.close && condition != of.r && condition != of.assuming &&
                             !(condition == of.p && monitor::is_ruled_out(of));
      if (is_wanted && first.empty() && !needed.empty() && missing.size() == needed.size()) first = missing.front();
      for (std::string& text : missing) {
        auto& all = out.never_seen;
        if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(std::move(text));
      }
    }
    return first;
  }

  // Of one that nothing puts to the test.
  [[nodiscard]] std::string why_not_tested(const Requirement& of, std::string unseen,
                                           const std::vector<std::string>& never_seen) const {
    if (!memory_.ever_heard()) return "no observation that it waits for is ever made";
    if (!unseen.empty()) return fmt::format("{} is never seen", unseen);
    const Requirement& asked = model_.test()->origin()->requirement;
    const monitor::ConditionPtr& told = asked.q ? asked.q : asked.p;
    if (!never_seen.empty() && told != of.p && told != of.q && !is_ever(of, told, asked.q == nullptr))
      return fmt::format("{} is never seen, and nothing violates it without", never_seen.front());
    if (of.scope.open && !is_ever_open(of)) return "its scope never begins";
    if (of.scope.kind == monitor::Scope::Kind::kBetween && !is_ever(of, of.scope.close))
      return "its scope never ends, and only what is closed counts";
    if (of.assuming && !is_ever(of, of.assuming)) return "what it assumes never holds";
    return is_triggered(of.pattern) ? "it is never triggered" : "what could violate it never comes where it applies";
  }

  static bool is_triggered(Pattern pattern) {
    switch (pattern) {
      case Pattern::kAlways:
      case Pattern::kNever:
      case Pattern::kAtMost:
      case Pattern::kEventually:
      case Pattern::kAtLeastEvery: return false;
      default: return true;
    }
  }

  [[nodiscard]] bool is_ever_open(const Requirement& of) const {
    if (of.scope.kind == monitor::Scope::Kind::kAfter || of.scope.kind == monitor::Scope::Kind::kWhile)
      return is_ever(of, of.scope.open);
    // As the scope itself has it, also while nothing is known of what closes it: nothing holds in it.
    auto nothing = std::make_shared<Condition>();
    nothing->kind = Condition::Kind::kTruth;
    Requirement never;
    never.name = of.name;
    never.span = of.span;
    never.scope = of.scope;
    never.scope.kind = monitor::Scope::Kind::kAfterUntil;
    never.pattern = Pattern::kAlways;
    never.p = std::move(nothing);
    const auto made = monitor::Model::make(never);
    return !made.ok() || is_violated(*made.value);
  }
  // @param as  The truth value that is looked for.
  [[nodiscard]] bool is_ever(const Requirement& of, monitor::ConditionPtr condition, bool as = true) const {
    Requirement never;
    never.name = of.name;
    never.span = of.span;
    never.pattern = as ? Pattern::kNever : Pattern::kAlways;
    never.p = std::move(condition);
    const auto made = monitor::Model::make(never);
    return !made.ok() || is_violated(*made.value);
  }
  // Whether something comes that is asked for never to come. True if that cannot be told.
  [[nodiscard]] bool is_violated(const monitor::Model& model) const {
    JudgeOptions options;
    options.probabilities = options.vacuity = false;
    return judge(graph_, model, options).finding != Finding::kHolds;
  }

  const Graph& graph_;
  const monitor::Model& model_;
  const MonitorMemory& memory_;
  std::map<std::string, std::vector<const Message*>> seen_;  // by the text of a source
};

}  // namespace

Vacuity vacuity(const Graph& graph, const monitor::Model& model, const MonitorMemory& memory) {
  return Looking(graph, model, memory)();
}

}  // namespace sentree::verify
