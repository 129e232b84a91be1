#include "sentree/monitor/oracle/evaluator.h"

#include <algorithm>
#include <cmath>

namespace sentree::monitor::oracle {

namespace {

using Kind = Condition::Kind;

enum class Truth { kFalse, kUnknown, kTrue };

Truth truth(bool value) { return value ? Truth::kTrue : Truth::kFalse; }
Truth negate(Truth t) { return t == Truth::kUnknown ? t : truth(t == Truth::kFalse); }
Truth both(Truth a, Truth b) { return std::min(a, b); }
Truth either(Truth a, Truth b) { return std::max(a, b); }

// A value, or nothing: unknown.
using Known = std::optional<Value>;

const Value* follow(const Value* value, const std::vector<std::string>& path, std::size_t from = 0) {
  for (std::size_t i = from; value != nullptr && i < path.size(); ++i) value = value->find(path[i]);
  return value;
}

class Trace {
 public:
  Trace(const Requirement& r, const std::vector<Message>& messages, TimePoint end) : r_(r), end_(end) {
    // Only what the requirement mentions counts as an observation.
    const std::vector<Source> sources = sources_of(r);
    for (const Message& message : messages) {
      const bool mentioned =
          std::any_of(sources.begin(), sources.end(), [&](const Source& s) { return matches(s, message); });
      if (mentioned) at_.push_back(&message);
    }
    // Ticks that the requirement does not speak of only count: they say nothing, and nothing begins with them.
    std::vector<Source> spoken_of;
    for (const ConditionPtr* c : {&r.p, &r.q, &r.r, &r.scope.open, &r.scope.close, &r.assuming}) {
      if (*c) collect_sources(**c, spoken_of);
    }
    const bool speaks_of_ticks = std::any_of(spoken_of.begin(), spoken_of.end(),
                                             [](const Source& s) { return s.observation == "mission.tick"; });
    int ticks = 0;
    for (std::size_t i = 0; i < at_.size(); ++i) {
      const bool tick = at_[i]->name == "mission.tick";
      if (tick) ++ticks;
      ticks_.push_back(ticks);
      counts_.push_back(tick && !speaks_of_ticks);
    }
    bool open = r.scope.kind == Scope::Kind::kGlobally || r.scope.kind == Scope::Kind::kBefore;
    for (std::size_t i = 0; i < at_.size(); ++i) {
      if (counts_[i]) {
        in_scope_.push_back(open);
        broken_.push_back(i > 0 && broken_[i - 1]);
        continue;
      }
      const auto holds = [&](const ConditionPtr& c) { return c && eval(*c, i) == Truth::kTrue; };
      switch (r.scope.kind) {
        case Scope::Kind::kGlobally: break;
        case Scope::Kind::kBefore: open = open && !holds(r.scope.close); break;
        case Scope::Kind::kAfter: open = open || holds(r.scope.open); break;
        case Scope::Kind::kBetween:
        case Scope::Kind::kAfterUntil: open = !holds(r.scope.close) && (open || holds(r.scope.open)); break;
        case Scope::Kind::kWhile: open = holds(r.scope.open); break;
      }
      in_scope_.push_back(open);
      broken_.push_back(r.assuming && eval(*r.assuming, i) == Truth::kFalse);
    }
  }

  std::vector<Outcome> run() {
    std::vector<Outcome> outcomes;
    int from = 0;
    TimePoint start{};
    for (bool first = true;; first = false) {
      first_ = first;
      auto found = decide(from, start);
      if (!found || found->at > end_) return outcomes;
      outcomes.push_back({found->violated, found->at, found->silent ? 0 : at_[found->position]->sequence});
      if (!found->violated || !r_.re_arming) return outcomes;
      start = found->at;
      from = found->position + 1;
      if (r_.pattern == Pattern::kAlways || r_.pattern == Pattern::kNever) {
        // The same violation lasts until the condition is restored.
        while (from < size() && bad(from)) ++from;
        ++from;
      }
    }
  }

 private:
  struct Found {
    bool violated;
    TimePoint at;
    int position;  // of silence: the last observation before it
    bool silent = false;
  };

  [[nodiscard]] int size() const { return static_cast<int>(at_.size()); }
  [[nodiscard]] TimePoint time(int i) const { return at_[static_cast<std::size_t>(i)]->time; }
  [[nodiscard]] bool in_scope(int i) const { return in_scope_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool broken(int i) const { return broken_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool active(int i) const { return in_scope(i) && !broken(i); }
  [[nodiscard]] Truth is(const ConditionPtr& c, int i) { return eval(*c, static_cast<std::size_t>(i)); }
  [[nodiscard]] bool holds(const ConditionPtr& c, int i) { return is(c, i) == Truth::kTrue; }
  [[nodiscard]] bool fails(const ConditionPtr& c, int i) { return is(c, i) == Truth::kFalse; }
  [[nodiscard]] bool only_counts(int i) const { return counts_[static_cast<std::size_t>(i)]; }
  // The observation before, which says something; -1: none.
  [[nodiscard]] int before(int i) const {
    for (--i; i >= 0 && only_counts(i);) --i;
    return i;
  }
  [[nodiscard]] int ticks(int i) const { return i < 0 ? 0 : ticks_[static_cast<std::size_t>(i)]; }

  // ---- Conditions ----

  static Known member(const Condition& c, const Message& message) {
    const std::string& first = c.path[0];
    if (first == "source") return Value(message.source);
    if (first == "target") return Value(message.target);
    if (first == "tick") return Value(static_cast<std::int64_t>(message.tick));
    const Value* value = follow(&message.data, c.path);
    return value == nullptr || value->is_null() ? Known() : Known(*value);
  }

  static bool matches(const Source& source, const Message& message) {
    if (source.observation != message.name) return false;
    if (!source.from.empty() && source.from != message.source) return false;
    return !source.where || condition(
                                *source.where, [&](const Condition& c) { return member(c, message); },
                                [](const Condition&) { return Truth::kUnknown; }) == Truth::kTrue;
  }

  [[nodiscard]] Known value_of(const Condition& c, std::size_t i) const {
    for (std::size_t k = i + 1; k-- > 0;) {
      if (!matches(*c.source, *at_[k])) continue;
      const Value* root = &at_[k]->data;
      if (c.source->kind == Source::Kind::kReply) root = root->find("result");
      if (c.source->kind == Source::Kind::kRequest) root = root->find("args");
      const Value* value = follow(root, c.path);
      return value == nullptr || value->is_null() ? Known() : Known(*value);
    }
    return std::nullopt;
  }

  Truth eval(const Condition& c, std::size_t i) {
    return condition(
        c, [&](const Condition& value) { return value_of(value, i); },
        [&](const Condition& momentary) { return momentary_of(momentary, i); });
  }

  Truth momentary_of(const Condition& c, std::size_t i) {
    if (c.kind == Kind::kEvent) return truth(matches(*c.source, *at_[i]));
    if (c.kind == Kind::kUpdated) {
      std::vector<Source> sources;
      collect_sources(*c.operands[0], sources);
      return truth(std::any_of(sources.begin(), sources.end(), [&](const Source& s) { return matches(s, *at_[i]); }));
    }
    const Condition& inner = *c.operands[0];
    const bool up = c.kind == Kind::kRises;
    Truth now = eval(inner, i);
    const int last = this->before(static_cast<int>(i));
    Truth before = last < 0 ? Truth::kUnknown : eval(inner, static_cast<std::size_t>(last));
    if (!up) {
      now = negate(now);
      before = negate(before);
    }
    return both(negate(before), now);
  }

  template <class Values, class Momentary>
  static Known value(const Condition& c, const Values& values, const Momentary& momentary) {
    switch (c.kind) {
      case Kind::kNumber: return Value(c.number);
      case Kind::kText: return Value(c.text);
      case Kind::kTruth: return Value(c.number != 0);
      case Kind::kDefined: return value(*c.operands[0], values, momentary);
      case Kind::kValue:
      case Kind::kMember: return values(c);
      default: break;
    }
    const Known a = value(*c.operands[0], values, momentary);
    if (!a || !a->is_number()) return std::nullopt;
    if (c.kind == Kind::kNegate) return Value(-a->number());
    const Known b = value(*c.operands[1], values, momentary);
    if (!b || !b->is_number()) return std::nullopt;
    switch (c.kind) {
      case Kind::kAdd: return Value(a->number() + b->number());
      case Kind::kSubtract: return Value(a->number() - b->number());
      case Kind::kMultiply: return Value(a->number() * b->number());
      default: return Value(a->number() / b->number());
    }
  }

  template <class Values, class Momentary>
  static Truth condition(const Condition& c, const Values& values, const Momentary& momentary) {
    const auto part = [&](std::size_t i) { return condition(*c.operands[i], values, momentary); };
    switch (c.kind) {
      case Kind::kDefined: return part(0);
      case Kind::kEvent:
      case Kind::kUpdated:
      case Kind::kRises:
      case Kind::kFalls: return momentary(c);
      case Kind::kNot: return negate(part(0));
      case Kind::kAnd: return both(part(0), part(1));
      case Kind::kOr: return either(part(0), part(1));
      case Kind::kImplies: return either(negate(part(0)), part(1));
      case Kind::kTruth:
      case Kind::kValue:
      case Kind::kMember: {
        const Known known = value(c, values, momentary);
        return known && known->as_bool() ? truth(*known->as_bool()) : Truth::kUnknown;
      }
      default: break;
    }
    const Known a = value(*c.operands[0], values, momentary);
    const Known b = value(*c.operands[1], values, momentary);
    if (!a || !b) return Truth::kUnknown;
    if (a->is_number() && b->is_number()) {
      const double x = a->number();
      const double y = b->number();
      if (std::isnan(x) || std::isnan(y)) return Truth::kUnknown;
      switch (c.kind) {
        case Kind::kEqual: return truth(x == y);
        case Kind::kNotEqual: return truth(x != y);
        case Kind::kLess: return truth(x < y);
        case Kind::kLessEqual: return truth(x <= y);
        case Kind::kGreater: return truth(x > y);
        default: return truth(x >= y);
      }
    }
    if (a->type() != b->type()) return Truth::kUnknown;
    const bool equal = *a == *b;
    return truth(c.kind == Kind::kEqual ? equal : !equal);
  }

  // ---- Bounds ----

  // Before the observation j: the bound that began with i has ended in silence.
  [[nodiscard]] bool timed_out(TimePoint began, TimePoint now) const {
    return r_.bound && r_.bound->unit == Bound::Unit::kTime && now > began + r_.bound->time;
  }
  [[nodiscard]] bool ticked_out(int i, int j) const {
    return r_.bound && r_.bound->unit == Bound::Unit::kTicks && ticks(j) - ticks(i) > r_.bound->count;
  }
  [[nodiscard]] bool used_up(int i, int j) const {
    return r_.bound && r_.bound->unit == Bound::Unit::kEvents && j - i >= r_.bound->count;
  }
  // j is within the bound that began with i.
  [[nodiscard]] bool within(int i, int j) const {
    if (!r_.bound) return true;
    switch (r_.bound->unit) {
      case Bound::Unit::kTime: return time(j) <= time(i) + r_.bound->time;
      case Bound::Unit::kTicks: return ticks(j) - ticks(i) <= r_.bound->count;
      case Bound::Unit::kEvents: return j - i <= r_.bound->count;
    }
    return false;
  }
  [[nodiscard]] int last_at(TimePoint when) const {
    int i = -1;
    while (i + 1 < size() && time(i + 1) <= when) ++i;
    return i;
  }
  [[nodiscard]] Found silence(TimePoint began) const {
    const TimePoint when = began + r_.bound->time;
    return {true, when, last_at(when), true};
  }
  [[nodiscard]] bool is_timed() const { return r_.bound && r_.bound->unit == Bound::Unit::kTime; }

  static void earlier(std::optional<Found>& best, const std::optional<Found>& other) {
    if (!other) return;
    if (!best || other->at < best->at || (other->at == best->at && other->position < best->position) ||
        (other->at == best->at && other->position == best->position && best->silent && !other->silent)) {
      best = other;
    }
  }

  // Between … and … a violation counts when the segment is closed from which it is owed, which is open at observation
  // i.
  std::optional<Found> told(const std::optional<Found>& found, int i) {
    if (!found || !found->violated || r_.scope.kind != Scope::Kind::kBetween) return found;
    int closes = i;
    while (closes < size() && in_scope(closes)) ++closes;
    if (closes == size()) return std::nullopt;
    return found->position >= closes ? *found : here(closes);
  }
  // One that can only happen before its segment closes, or as it does.
  std::optional<Found> told_of_present(const std::optional<Found>& found) {
    return found ? told(found, found->position) : found;
  }

  // ---- Patterns ----

  bool bad(int i) { return active(i) && (r_.pattern == Pattern::kAlways ? fails(r_.p, i) : holds(r_.p, i)); }

  std::optional<Found> decide(int from, TimePoint start) {
    if (r_.pattern == Pattern::kEventually) return told_of_present(existence(from, start));
    if (r_.pattern == Pattern::kAtLeastEvery) return told_of_present(recurrence(from, start));
    if (r_.pattern == Pattern::kPrecedes) return told_of_present(precedence(from));
    std::optional<Found> best;
    for (int i = from; i < size(); ++i) earlier(best, told(violation_from(i, from), i));
    if (r_.scope.kind == Scope::Kind::kBefore) {
      for (int j = from; j < size(); ++j) {
        if (in_scope(j)) continue;
        bool open = false;
        bool runs_out = false;
        for (int i = from; i < j; ++i) {
          open = open || owed(i, j);
          runs_out = runs_out || (owed(i, j - 1) && ticked_out(i, j) && !broken(j));
        }
        // A tick that only counts ends what its window was, and nothing else.
        if (open || (only_counts(j) && !runs_out)) continue;
        earlier(best, Found{false, time(j), j});
        break;
      }
    }
    return best;
  }

  // The violation of what begins with observation i.
  std::optional<Found> violation_from(int i, int from) {
    if (only_counts(i)) return std::nullopt;
    switch (r_.pattern) {
      case Pattern::kAlways:
      case Pattern::kNever: return bad(i) ? std::optional(here(i)) : std::nullopt;
      case Pattern::kImmediately:
        return active(i) && holds(r_.p, i) && fails(r_.q, i) ? std::optional(here(i)) : std::nullopt;
      case Pattern::kRespond: return response(i);
      case Pattern::kKeepFor: return active(i) && holds(r_.p, i) ? stays(i, i, r_.q, false) : std::nullopt;
      case Pattern::kKeepUntil: return active(i) && holds(r_.p, i) ? stays(i, i, r_.q, false) : std::nullopt;
      case Pattern::kNotFor: return active(i) && holds(r_.p, i) ? stays(i, i + 1, r_.q, true) : std::nullopt;
      case Pattern::kHoldsFor:
        return active(i) && before(i) >= 0 && fails(r_.p, before(i)) && holds(r_.p, i) ? stays(i, i + 1, r_.p, false)
                                                                                       : std::nullopt;
      case Pattern::kAtMost: return too_many(i, from) ? std::optional(here(i)) : std::nullopt;
      default: return std::nullopt;
    }
  }

  [[nodiscard]] Found here(int i) const { return {true, time(i), i}; }

  std::optional<Found> response(int i) {
    if (!active(i) || !holds(r_.p, i) || holds(r_.q, i)) return std::nullopt;
    for (int j = i + 1; j < size(); ++j) {
      if (timed_out(time(i), time(j))) return silence(time(i));
      if (only_counts(j)) {
        if (ticked_out(i, j)) return here(j);
        continue;
      }
      if (broken(j)) return std::nullopt;
      if (ticked_out(i, j)) return here(j);
      if (holds(r_.q, j)) return std::nullopt;
      if (used_up(i, j)) return here(j);
    }
    return is_timed() ? std::optional(silence(time(i))) : std::nullopt;
  }

  // From j on, as long as the bound that began with i lasts, the condition must not fail (not hold, if forbidden).
  std::optional<Found> stays(int i, int j, const ConditionPtr& condition, bool forbidden) {
    for (; j < size() && (r_.pattern == Pattern::kKeepUntil || within(i, j)); ++j) {
      if (only_counts(j)) continue;
      if (j > i && broken(j)) return std::nullopt;
      if (r_.pattern == Pattern::kKeepUntil && holds(r_.r, j)) return std::nullopt;
      if (forbidden ? holds(condition, j) : fails(condition, j)) return here(j);
    }
    return std::nullopt;
  }

  // What began with i is still owed after observation j.
  bool owed(int i, int j) {
    if (only_counts(i) || !active(i)) return false;
    const auto dropped_before = [&] {
      for (int k = i + 1; k < j; ++k) {
        if (broken(k)) return true;
      }
      return false;
    };
    switch (r_.pattern) {
      case Pattern::kRespond: {
        if (!holds(r_.p, i)) return false;
        for (int k = i; k <= j; ++k) {
          if (k > i && k < j && broken(k)) return false;
          if (holds(r_.q, k) && !(k == j && broken(k))) return false;
        }
        return true;
      }
      case Pattern::kKeepUntil: {
        if (!holds(r_.p, i)) return false;
        for (int k = i; k <= j; ++k) {
          if (holds(r_.r, k) && !(k == j && broken(k))) return false;
        }
        return !dropped_before();
      }
      case Pattern::kKeepFor:
      case Pattern::kNotFor:
      case Pattern::kHoldsFor: {
        const bool begins = r_.pattern == Pattern::kHoldsFor
                                ? before(i) >= 0 && fails(r_.p, before(i)) && holds(r_.p, i)
                                : holds(r_.p, i);
        if (!begins || dropped_before()) return false;
        if (broken(j) && (within(i, j) || !is_timed())) return !ended_before(i, j);
        return within(i, j) && !used_up(i, j);
      }
      default: return false;
    }
  }
  // The bound that began with i was over before the observation j.
  bool ended_before(int i, int j) {
    for (int k = i + 1; k < j; ++k) {
      if (!within(i, k) || used_up(i, k)) return true;
    }
    return false;
  }

  bool occurs(int i) {
    if (only_counts(i) || !active(i) || !holds(r_.p, i)) return false;
    return is_momentary(*r_.p) || before(i) < 0 || !holds(r_.p, before(i));
  }
  bool too_many(int j, int from) {
    if (!occurs(j)) return false;
    std::int64_t count = 0;
    for (int i = r_.bound ? 0 : from; i < j; ++i) {
      if (!r_.bound && !active(i)) count = 0;
      if (occurs(i) && within(i, j)) ++count;
    }
    return count >= r_.times;
  }

  std::optional<Found> precedence(int from) {
    const bool for_good = !r_.bound && !r_.scope.can_reopen();
    for (int j = from; j < size(); ++j) {
      if (only_counts(j)) continue;
      if (r_.scope.kind == Scope::Kind::kBefore && !in_scope(j)) return Found{false, time(j), j};
      if (!active(j)) continue;
      if (for_good && holds(r_.p, j)) return Found{false, time(j), j};
      if (!holds(r_.q, j)) continue;
      bool prepared = false;
      for (int i = j; i >= from && active(i) && !prepared; --i)
        prepared = !only_counts(i) && holds(r_.p, i) && within(i, j);
      if (!prepared) return here(j);
    }
    return std::nullopt;
  }

  std::optional<Found> existence(int from, TimePoint start) {
    const bool from_start = r_.scope.kind == Scope::Kind::kGlobally || r_.scope.kind == Scope::Kind::kBefore;
    const bool closes = r_.scope.kind == Scope::Kind::kBefore || r_.scope.can_reopen();
    bool open = from_start;
    bool met = false;
    TimePoint began = start;
    int began_at = from - 1;
    for (int j = from; j < size(); ++j) {
      if (only_counts(j)) {
        if (open && ticked_out(began_at, j)) return here(j);
        continue;
      }
      if (met) {
        met = active(j);
        continue;
      }
      if (open) {
        if (timed_out(began, time(j))) return silence(began);
        if (broken(j)) {
          open = false;
          continue;
        }
        if (ticked_out(began_at, j)) return here(j);
        if (closes && !in_scope(j)) return here(j);
      } else if (!active(j)) {
        continue;
      }
      if (holds(r_.p, j)) {
        if (!r_.scope.can_reopen()) return Found{false, time(j), j};
        met = true;
        open = false;
      } else if (!open) {
        open = true;
        began = time(j);
        began_at = j;
      } else if (used_up(began_at, j)) {
        return here(j);
      }
    }
    return open && is_timed() ? std::optional(silence(began)) : std::nullopt;
  }

  std::optional<Found> recurrence(int from, TimePoint start) {
    const bool lasts = !is_momentary(*r_.p);
    const bool from_start = r_.scope.kind == Scope::Kind::kGlobally || r_.scope.kind == Scope::Kind::kBefore;
    // After a violation it begins again at once, but between … and … that is told outside.
    bool open = from_start || (!first_ && r_.scope.kind != Scope::Kind::kBetween);
    bool holding = false;
    TimePoint last = start;
    int last_position = from - 1;
    for (int j = from; j < size(); ++j) {
      if (only_counts(j)) {
        if (open && !holding && ticked_out(last_position, j)) return here(j);
        continue;
      }
      if (open && !holding && timed_out(last, time(j))) return silence(last);
      if (r_.scope.kind == Scope::Kind::kBefore && !in_scope(j)) return Found{false, time(j), j};
      if (!active(j)) {
        open = false;
        holding = false;
        continue;
      }
      const bool now = holds(r_.p, j);
      if (open && !holding && ticked_out(last_position, j)) return here(j);
      if (!open || now || holding) {
        last = time(j);
        last_position = j;
      } else if (used_up(last_position, j)) {
        return here(j);
      }
      holding = lasts && now;
      open = true;
    }
    return open && !holding && is_timed() ? std::optional(silence(last)) : std::nullopt;
  }

  const Requirement& r_;
  TimePoint end_;
  bool first_ = true;
  std::vector<const Message*> at_;
  std::vector<int> ticks_;
  std::vector<bool> counts_;  // only that
  std::vector<bool> in_scope_;
  std::vector<bool> broken_;
};

}  // namespace

std::vector<Outcome> evaluate(const Requirement& requirement, const std::vector<Message>& trace, TimePoint end) {
  return Trace(requirement, trace, end).run();
}

}  // namespace sentree::monitor::oracle
