#include "sentree/monitor/synthesis.h"

#include <algorithm>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "sentree/monitor/detail/chart_text.h"
#include "sentree/monitor/detail/conjunction.h"
#include "sentree/monitor/detail/requirement_script.h"
#include "sentree/monitor/detail/windows.h"
#include "sentree/text/xml.h"

namespace sentree::monitor {

namespace {

class Synthesizer {
 public:
  using Role = Situation::Role;

  // @param present  If any, states are planned for observations of that name, as if there were no others: what it says
  //                 is looked at in itself, what others said is remembered.
  Synthesizer(const Requirement& requirement, const Typing& typing, std::string_view present = {})
      : r_(requirement),
        typing_(typing),
        script_(requirement, typing, present),
        ticks_only_count_(in_ticks() && !speaks_of_ticks()),
        present_(present) {}

  Synthesis run() {
    plan();
    if (auto direct = at_observations()) return *std::move(direct);
    return result();
  }

 private:
  // As one would draw it: the conditions are at the observations, and only what those of others need is remembered.
  // Nothing: it cannot be written so.
  [[nodiscard]] std::optional<Synthesis> at_observations() const {
    if (is_between() || in_events() || counts_always_ || (in_ticks() && !ticks_only_count_)) return std::nullopt;
    std::vector<Synthesizer> each;
    std::set<std::string> names;
    for (const Source& source : sources_of(r_)) {
      if (!names.insert(source.observation).second) continue;
      each.emplace_back(r_, typing_, source.observation).plan();
      // Of one observation alone a condition may be constant, on which states depend.
      if (!each.back().is_like(*this)) return std::nullopt;
    }
    if (each.empty()) return std::nullopt;
    std::set<std::string> kept;
    for (Synthesizer& one : each) {
      one.leave_out_what_was_seen(*this);
      one.collect_read(kept);
    }
    for (Synthesizer& one : each) {
      if (!one.look_at_present(kept)) return std::nullopt;
    }
    Synthesizer& whole = each.front();
    for (auto one = each.begin() + 1; one != each.end(); ++one) whole.take_edges(*one);
    whole.kept_ = std::move(kept);
    return whole.result();
  }

  void plan() {
    p_ = script_.holds(r_.p);
    if (r_.assuming) broken_ = script_.fails(r_.assuming);
    scope();
    active_ = js_and(in_scope_, js_not(broken_));
    body();
    if (initial_.empty()) initial_ = states_.front().id;
    if (restart_.empty()) restart_ = initial_;
  }

  [[nodiscard]] bool is_like(const Synthesizer& other) const {
    const auto same = [](const auto& these, const auto& those, auto name) {
      return std::equal(these.begin(), these.end(), those.begin(), those.end(),
                        [&](const auto& a, const auto& b) { return a.*name == b.*name; });
    };
    return initial_ == other.initial_ && restart_ == other.restart_ && same(states_, other.states_, &ChartState::id) &&
           same(data_, other.data_, &ExtraData::id) &&
           same(script_.variables(), other.script_.variables(), &Script::Variable::name) &&
           same(script_.before(), other.script_.before(), &Script::Before::name);
  }
  // A root tick that only counts.
  [[nodiscard]] bool is_count() const { return in_ticks() && present_ == "mission.tick"; }

  // The data that what is decided at this observation needs from others.
  void collect_read(std::set<std::string>& names) const {
    if (is_count()) return;
    for (const Script::Variable& variable : script_.variables()) {
      const auto is_read = [&](const Js& js) { return reads(js, variable.name); };
      const auto reads_it = [&](const ChartState& state) {
        return std::any_of(state.edges.begin(), state.edges.end(),
                           [&](const Edge& edge) { return is_read(edge.condition); });
      };
      if (!variable.is_flag() &&
          (is_read(scope_update_) || std::any_of(states_.begin(), states_.end(), reads_it) ||
           std::any_of(script_.before().begin(), script_.before().end(), [&](const Script::Before& before) {
             return is_read({before.expression, 0});
           })))
        names.insert(variable.name);
    }
  }

  // What lasts was looked at when it came: its edge cannot be taken at an observation that does not concern it, if it
  // cannot have been true already when the state was entered.
  void leave_out_what_was_seen(const Synthesizer& plain) {
    if (is_count()) return;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      for (const Edge& seen : plain.states_[i].edges) {
        if (seen.event != "observed") continue;
        if (seen.target.empty()) break;  // what follows it may not have been looked at
        if (!is_untouched(seen.condition) || !plain.is_false_on_entry(states_[i].id, seen.condition)) continue;
        // Nor one that needs that and more.
        const std::vector<Js> parts = conjuncts(seen.condition);
        std::erase_if(states_[i].edges, [&](const Edge& edge) {
          return edge.event == seen.event && are_among(parts, conjuncts(edge.condition));
        });
      }
    }
  }
  // It reads values of other observations, or whether the scope is open that this one leaves as it is, and nothing
  // else.
  [[nodiscard]] bool is_untouched(const Js& condition) {
    bool is_read = has_scope() && reads(condition, "in_scope");
    if (is_read && !leaves_scope() && scope_update_.text != "in_scope") return false;
    for (const Script::Variable& variable : script_.variables()) {
      if (!reads(condition, variable.name)) continue;
      if (variable.is_flag() || !is_false(script_.is_set(variable, present_))) return false;
      is_read = true;
    }
    const auto reads_one = [&](const auto& data, auto name) {
      return std::any_of(data.begin(), data.end(), [&](const auto& datum) { return reads(condition, datum.*name); });
    };
    return is_read && !reads_one(script_.before(), &Script::Before::name) && !reads_one(data_, &ExtraData::id) &&
           !reads(condition, "ticks");
  }
  // Whether a condition is false whenever the state is entered by an observation, as far as that can be told.
  [[nodiscard]] bool is_false_on_entry(const std::string& state, const Js& condition) const {
    const std::vector<Js> needed = conjuncts(condition);
    const auto never_before = [&](const Js& part) {
      if (part.text == (is_before() ? "!in_scope" : "in_scope")) return true;
      return std::any_of(script_.variables().begin(), script_.variables().end(),
                         [&](const Script::Variable& variable) { return is_false_of_undefined(part, variable.name); });
    };
    if (state == initial_ && std::none_of(needed.begin(), needed.end(), never_before)) return false;
    for (const ChartState& from : states_) {
      std::vector<Js> refused;
      for (const Edge& edge : from.edges) {
        const bool enters = edge.target == state || (r_.re_arming && edge.target == kViolated && state == restart_);
        if (enters && (edge.event != "observed" || !rules_out(edge.condition, refused, needed))) return false;
        if (edge.event == "observed") refused.push_back(edge.condition);
      }
    }
    return true;
  }

  // Has the edges taken at the observation itself, and notes what is kept of it. Other data are noted where a state
  // changes, for whoever explains what was decided. False: it depends on the observation whether it sets what is kept.
  [[nodiscard]] bool look_at_present(const std::set<std::string>& kept) {
    if (is_count()) {
      count_at_present();
      return true;
    }
    const Js meant = script_.is_meant(present_);
    std::vector<std::string> keeps;
    std::vector<std::string> notes;
    // The scope depends on what was before; what is before the next observation, on neither.
    if (!scope_update_.text.empty() && scope_update_.text != "in_scope")
      keeps.push_back(assign("in_scope", scope_update_.text));
    for (const Script::Before& before : script_.before()) keeps.push_back(assign(before.name, before.expression));
    for (const Script::Variable& variable : script_.variables()) {
      const Js set = script_.is_set(variable, present_);
      const bool is_kept = kept.contains(variable.name);
      if (is_kept && !is_true(set) && !is_false(set)) return false;
      if (variable.is_flag())
        notes.push_back(assign(variable.name, set.text));
      else if (is_true(set))
        (is_kept ? keeps : notes).push_back(assign(variable.name, variable.assigned));
    }
    notes.insert(notes.begin(), keeps.begin(), keeps.end());
    for (ChartState& state : states_) {
      std::erase_if(state.edges, [](const Edge& edge) { return edge.event == "ticked"; });
      for (Edge& edge : state.edges) {
        if (edge.event != "observed") continue;
        edge.event = present_;
        edge.condition = js_and(meant, without_repetition(edge.condition));
        edge.actions.insert(edge.actions.begin(), notes.begin(), notes.end());
      }
      leave_out_what_comes_too_late(state);
    }
    const auto always_changes = [&](const ChartState& state) {
      return std::any_of(state.edges.begin(), state.edges.end(),
                         [&](const Edge& edge) { return edge.event == present_ && edge.condition.text == meant.text; });
    };
    if (!keeps.empty() && !std::all_of(states_.begin(), states_.end(), always_changes))
      otherwise_.push_back({present_, meant, "", std::move(keeps)});
    return true;
  }
  // Behind a transition that is taken whenever it would be.
  void leave_out_what_comes_too_late(ChartState& state) const {
    std::vector<Edge> reached;
    for (Edge& edge : state.edges) {
      const std::vector<Js> needed = conjuncts(edge.condition);
      const auto is_first = [&](const Edge& other) {
        return other.event == edge.event && (is_true(other.condition) || are_among(conjuncts(other.condition), needed));
      };
      if (edge.event != present_ || std::none_of(reached.begin(), reached.end(), is_first))
        reached.push_back(std::move(edge));
    }
    state.edges = std::move(reached);
  }
  void count_at_present() {
    for (ChartState& state : states_) {
      std::erase_if(state.edges, [](const Edge& edge) { return edge.event == "observed"; });
      for (Edge& edge : state.edges) {
        if (edge.event == "ticked") edge.event = present_;
      }
      if (counted(state)) on(state, js_true(), "", {assign("ticks", "ticks + 1")}, present_);
    }
  }
  void take_edges(const Synthesizer& other) {
    for (std::size_t i = 0; i < states_.size(); ++i) {
      for (const Edge& edge : other.states_[i].edges) {
        if (edge.event == other.present_) states_[i].edges.push_back(edge);
      }
    }
    otherwise_.insert(otherwise_.end(), other.otherwise_.begin(), other.otherwise_.end());
  }

  Synthesis result() {
    Synthesis result;
    result.chart = write();
    for (const ChartState& state : states_) result.situations.push_back({state.id, state.role, state.says});
    for (const Script::Variable& v : script_.variables()) {
      result.data.push_back({v.name, v.shown, v.is_flag()});
      if (present_.empty() ? v.is_flag() : !kept_.contains(v.name)) result.overwritten.push_back(v.name);
    }
    for (const Script::Before& b : script_.before()) {
      if (present_.empty()) result.overwritten.push_back(b.name);
    }
    result.forgets = forgets();
    return result;
  }

  // Nothing is counted or remembered, and all values come with one and the same observation, or none is needed later.
  [[nodiscard]] bool forgets() {
    if (in_ticks() || in_events() || !data_.empty() || has_scope() || !script_.before().empty()) return false;
    if (!present_.empty()) return kept_.empty();
    const std::vector<Source> sources = sources_of(r_);
    const auto is_first = [&](const Source& source) {
      return source.observation == sources.front().observation &&
             script_.filter(source).text == script_.filter(sources.front()).text;
    };
    return !sources.empty() && std::all_of(sources.begin(), sources.end(), is_first);
  }
  [[nodiscard]] bool in_ticks() const { return r_.bound && r_.bound->unit == Bound::Unit::kTicks; }
  [[nodiscard]] bool in_events() const { return r_.bound && r_.bound->unit == Bound::Unit::kEvents; }
  [[nodiscard]] bool in_time() const { return r_.bound && r_.bound->unit == Bound::Unit::kTime; }
  [[nodiscard]] bool is_between() const { return r_.scope.kind == Scope::Kind::kBetween; }
  [[nodiscard]] bool is_before() const { return r_.scope.kind == Scope::Kind::kBefore; }
  // The requirement itself mentions root ticks: they are observations like others.
  [[nodiscard]] bool speaks_of_ticks() const {
    std::vector<Source> sources;
    for (const ConditionPtr* c : {&r_.p, &r_.q, &r_.r, &r_.scope.open, &r_.scope.close, &r_.assuming}) {
      if (*c) collect_sources(**c, sources);
    }
    return std::any_of(sources.begin(), sources.end(),
                       [](const Source& source) { return source.observation == "mission.tick"; });
  }
  // What tells that ticks have passed. A tick that only counts says nothing new of what is owed, so it triggers
  // nothing.
  [[nodiscard]] std::string late_event() const { return ticks_only_count_ ? "ticked" : "observed"; }
  // Counted: the bound has been over since the present tick; is over with the present observation.
  [[nodiscard]] Js late() const {
    if (!in_ticks()) return js_false();
    // At the tick itself it is not counted yet.
    return {fmt::format("ticks {} {}", is_count() ? ">=" : ">", r_.bound->count), 5};
  }
  [[nodiscard]] Js used_up() const {
    return in_events() ? Js{fmt::format("observations >= {}", r_.bound->count), 5} : js_false();
  }

  // What is open is remembered, in `in_scope`.
  [[nodiscard]] bool has_scope() const {
    return r_.scope.kind != Scope::Kind::kGlobally && r_.scope.kind != Scope::Kind::kWhile;
  }
  // An observation that says nothing of the conditions leaves the scope as it is: those last, and have been seen to.
  [[nodiscard]] bool leaves_scope() const {
    const auto lasts = [&](const ConditionPtr& condition) {
      if (!condition) return true;
      std::vector<Source> sources;
      collect_sources(*condition, sources);
      return !is_momentary(*condition) && !has_constant(*condition) &&
             std::none_of(sources.begin(), sources.end(),
                          [&](const Source& source) { return source.observation == present_; });
    };
    return is_count() || (!present_.empty() && lasts(r_.scope.open) && lasts(r_.scope.close));
  }
  void scope() {
    const Scope& s = r_.scope;
    if (s.kind == Scope::Kind::kGlobally) return;
    if (s.kind == Scope::Kind::kWhile) {
      in_scope_ = script_.holds(s.open);
      return;
    }
    in_scope_ = {"in_scope", 9};
    if (leaves_scope()) return;
    const Js opens = s.open ? script_.holds(s.open) : js_true();
    const Js closes = s.close ? script_.holds(s.close) : js_false();
    if (s.kind == Scope::Kind::kBefore)
      scope_update_ = js_and(in_scope_, js_not(closes));
    else
      scope_update_ = js_and(js_not(closes), js_or(in_scope_, opens));
    if (!present_.empty()) in_scope_ = scope_update_;
  }

  ChartState& add(std::string id, Role role, std::string says, bool bounded = false) {
    states_.push_back({script_.unique(std::move(id)), role, std::move(says), bounded, {}, {}});
    return states_.back();
  }
  static void on(ChartState& state, const Js& condition, std::string target, std::vector<std::string> actions = {},
                 const std::string& event = "observed") {
    if (!is_false(condition)) state.edges.push_back({event, condition, std::move(target), std::move(actions)});
  }
  void over(ChartState& state, std::string target) {
    if (in_time()) state.edges.push_back({"deadline", js_true(), std::move(target), {}});
  }
  // A violation; between … and … it is told when the segment is closed from which it is owed.
  void violate(ChartState& state, const std::string& event, const Js& condition) {
    if (is_false(condition)) return;
    if (is_between())
      state.edges.push_back({event, js_and(condition, js_and(in_scope_, js_not(from_closed_))), kBreached, {}});
    state.edges.push_back({event, condition, kViolated, {}});
  }
  // Between … and … what is owed when its segment closes stays owed, and is told when it is due from then on.
  void outlive(ChartState& state) {
    if (!is_between()) return;
    on(state, js_and(js_not(in_scope_), js_not(from_closed_)), "", {assign(kFromClosed, "true")});
    state.on_exit.push_back(assign(kFromClosed, "false"));
  }
  void may_outlive() {
    if (!is_between()) return;
    from_closed_ = {kFromClosed, 9};
    data_.push_back({kFromClosed, "false", "what is owed is from a segment that has closed"});
  }
  // One that can only happen inside the scope.
  void violate_inside(ChartState& state, const std::string& event, const Js& condition,
                      const std::vector<std::string>& actions = {}) {
    if (is_false(condition)) return;
    state.edges.push_back({event, condition, is_between() ? kBreached : kViolated, actions});
  }
  // Before …: once over, what is not owed by then holds for good.
  void settle(ChartState& state, const Js& condition = js_true(), const std::string& event = "observed") {
    if (is_before()) on(state, js_and(condition, js_not(in_scope_)), kSatisfied, {}, event);
  }

  void body() {
    switch (r_.pattern) {
      case Pattern::kAlways:
        invariant(script_.fails(r_.p), "holds_" + slug(*r_.p), "requires " + to_text(*r_.p));
        break;
      case Pattern::kNever: invariant(p_, "free_of_" + slug(*r_.p), "has not seen " + to_text(*r_.p)); break;
      case Pattern::kEventually: existence(); break;
      case Pattern::kRespond: response(); break;
      case Pattern::kImmediately: {
        ChartState& home = add("waits_for_" + slug(*r_.p), Role::kWatching, "waits for " + to_text(*r_.p));
        violate_inside(home, "observed", js_and(active_, js_and(p_, script_.fails(r_.q))));
        settle(home);
        break;
      }
      case Pattern::kKeepFor: keep_for(); break;
      case Pattern::kKeepUntil: keep_until(); break;
      case Pattern::kNotFor: not_for(); break;
      case Pattern::kPrecedes: precedence(); break;
      case Pattern::kAtLeastEvery: recurrence(); break;
      case Pattern::kAtMost: counting(); break;
      case Pattern::kHoldsFor: duration(); break;
    }
  }

  void invariant(const Js& bad, const std::string& id, const std::string& says) {
    ChartState& home = add(id, Role::kWatching, says);
    violate_inside(home, "observed", js_and(active_, bad));
    settle(home);
    if (!r_.re_arming) return;
    // One violation lasts until the condition is restored.
    ChartState& still = add("until_restored", Role::kWatching, "is violated until the condition is restored");
    on(still, js_not(js_and(active_, bad)), states_[0].id);
    restart_ = still.id;
  }

  void existence() {
    const std::string text = to_text(*r_.p);
    const bool can_wait = !is_true(active_);
    const std::string outside = can_wait && !is_before() ? outside_state() : std::string();
    const std::string due = script_.unique("owes_" + slug(*r_.p));
    const std::string met = r_.scope.can_reopen() ? script_.unique("has_seen_" + slug(*r_.p)) : kSatisfied;
    const std::string interrupted = !outside.empty() ? outside : r_.assuming ? outside_state() : "";
    if (!interrupted.empty()) {
      ChartState& state = find(interrupted);
      on(state, js_and(active_, p_), met);
      on(state, active_, due);
    }
    ChartState& owes = states_.emplace_back(ChartState{due, Role::kPending, "owes " + text, true, {}, {}});
    if (r_.assuming) on(owes, broken_, interrupted);
    violate(owes, late_event(), late());
    if (!is_true(in_scope_) && r_.scope.kind != Scope::Kind::kAfter) {
      // Due when its scope ends, if not before.
      owes.edges.push_back({"observed", js_not(in_scope_), kViolated, {}});
    }
    on(owes, p_, met);
    violate(owes, "observed", used_up());
    if (in_time()) violate(owes, "deadline", js_true());
    if (met != kSatisfied) {
      ChartState& seen = states_.emplace_back(ChartState{met, Role::kWatching, "has seen " + text, false, {}, {}});
      on(seen, js_not(active_), interrupted);
    }
    initial_ = interrupted.empty() || is_before() || r_.scope.kind == Scope::Kind::kGlobally ? due : interrupted;
  }

  void response() {
    may_outlive();
    const Js q = script_.holds(r_.q);
    const std::string owes_id = script_.unique("owes_" + slug(*r_.q));
    const std::string home_id = watching_for_trigger();
    on(find(home_id), js_and(active_, js_and(p_, js_not(q))), owes_id);
    settle(find(home_id));
    ChartState& owes =
        states_.emplace_back(ChartState{owes_id, Role::kPending, "owes " + to_text(*r_.q), true, {}, {}});
    on(owes, broken_, home_id);
    violate(owes, late_event(), late());
    settle(owes, q);
    on(owes, q, home_id);
    violate(owes, "observed", used_up());
    if (in_time()) violate(owes, "deadline", js_true());
    outlive(owes);
  }

  void keep_for() {
    const Js trigger = js_and(active_, p_);
    const Js bad = script_.fails(r_.q);
    const std::string home_id = watching_for_trigger();
    const std::string keeps_id = script_.unique("keeps_" + slug(*r_.q));
    violate_inside(find(home_id), "observed", js_and(trigger, bad));
    if (is_between()) return in_windows(home_id, keeps_id, "must keep " + to_text(*r_.q), trigger, bad);
    on(find(home_id), trigger, keeps_id);
    settle(find(home_id));
    ChartState& keeps =
        states_.emplace_back(ChartState{keeps_id, Role::kPending, "must keep " + to_text(*r_.q), true, {}, {}});
    on(keeps, broken_, home_id);
    leave(keeps, ticks_only_count_ ? late() : js_and(late(), js_not(trigger)), home_id, late_event());
    violate(keeps, "observed", bad);
    on(keeps, trigger, keeps_id);
    leave(keeps, used_up(), home_id);
    over(keeps, home_id);
  }

  void keep_until() {
    may_outlive();
    const Js end = script_.holds(r_.r);
    const Js trigger = js_and(active_, js_and(p_, js_not(end)));
    const Js bad = script_.fails(r_.q);
    const std::string home_id = watching_for_trigger();
    const std::string keeps_id = script_.unique(fmt::format("keeps_{}_until_{}", slug(*r_.q), slug(*r_.r, 24)));
    violate_inside(find(home_id), "observed", js_and(trigger, bad));
    on(find(home_id), trigger, keeps_id);
    settle(find(home_id));
    ChartState& keeps = states_.emplace_back(ChartState{
        keeps_id, Role::kPending, fmt::format("must keep {} until {}", to_text(*r_.q), to_text(*r_.r)), false, {}, {}});
    on(keeps, broken_, home_id);
    leave(keeps, end, home_id);
    violate(keeps, "observed", bad);
    outlive(keeps);
  }

  void not_for() {
    const Js trigger = js_and(active_, p_);
    const Js bad = script_.holds(r_.q);
    const std::string home_id = watching_for_trigger();
    const std::string free_id = script_.unique("must_stay_free_of_" + slug(*r_.q));
    if (is_between()) return in_windows(home_id, free_id, "must not see " + to_text(*r_.q), trigger, bad);
    on(find(home_id), trigger, free_id);
    settle(find(home_id));
    ChartState& quiet =
        states_.emplace_back(ChartState{free_id, Role::kPending, "must not see " + to_text(*r_.q), true, {}, {}});
    on(quiet, broken_, home_id);
    if (!ticks_only_count_) on(quiet, js_and(late(), trigger), free_id);
    leave(quiet, late(), home_id, late_event());
    violate(quiet, "observed", bad);
    on(quiet, trigger, free_id);
    leave(quiet, used_up(), home_id);
    over(quiet, home_id);
  }

  // Between … and …: what each trigger begins anew is owed from its own segment.
  void in_windows(const std::string& home_id, const std::string& id, const std::string& says, const Js& trigger,
                  const Js& bad) {
    may_outlive();
    const Windows windows(*r_.bound);
    for (const Windows::Datum& datum : windows.data()) data_.push_back({datum.id, datum.initial, datum.what});
    no_windows_ = windows.none();
    count_newer_ = windows.count_newer();
    find(home_id).on_entry = no_windows_;
    on(find(home_id), trigger, id, windows.begin());
    ChartState& owes = states_.emplace_back(ChartState{id, Role::kPending, says, true, {}, {}});
    owes.begins_anew = false;
    on(owes, broken_, home_id);
    // At an observation that is not counted in any more, the others are looked at without that window.
    const auto ends = [&](const Js& over, const std::string& event) {
      std::vector<std::string> again;
      if (event == "observed") again.emplace_back("<raise event=\"observed\"/>");
      std::vector<std::string> next = windows.end_oldest();
      next.insert(next.end(), again.begin(), again.end());
      on(owes, js_and(over, js_and(Windows::has_newer(), js_not(windows.newer_is_late()))), "", next, event);
      on(owes, over, home_id, again, event);
    };
    if (in_ticks()) ends(late(), late_event());
    violate(owes, "observed", bad);
    if (in_events()) ends(used_up(), "observed");
    on(owes, js_and(trigger, js_not(from_closed_)), id, windows.restart());
    on(owes, trigger, id, windows.restart_newer());
    on(owes, js_and(js_not(in_scope_), Windows::has_newer()), "", windows.close());
    on(owes, js_and(js_not(in_scope_), js_not(from_closed_)), "", {assign(kFromClosed, "true")});
    if (in_time()) ends(js_true(), "deadline");
  }

  void precedence() {
    const Js q = script_.holds(r_.q);
    const bool for_good = !r_.bound && !r_.scope.can_reopen();
    const std::string home_id =
        add("waits_for_" + slug(*r_.p), Role::kWatching, fmt::format("waits for {}, which comes first", to_text(*r_.p)))
            .id;
    const std::string ready_id = for_good ? kSatisfied : script_.unique("has_seen_" + slug(*r_.p));
    on(find(home_id), js_and(active_, p_), ready_id);
    violate_inside(find(home_id), "observed", js_and(active_, q));
    settle(find(home_id));
    if (for_good) return;
    ChartState& ready =
        states_.emplace_back(ChartState{ready_id, Role::kWatching, "has seen " + to_text(*r_.p), true, {}, {}});
    settle(ready);
    on(ready, js_not(active_), home_id);
    if (ticks_only_count_) {
      on(ready, late(), home_id, {}, late_event());
    } else {
      violate_inside(ready, "observed", js_and(late(), js_and(js_not(p_), q)));
      on(ready, js_and(late(), js_not(p_)), home_id);
    }
    if (r_.bound) on(ready, p_, ready_id);
    on(ready, used_up(), home_id);
    over(ready, home_id);
  }

  void recurrence() {
    const std::string text = to_text(*r_.p);
    const bool lasts = !is_momentary(*r_.p);
    const std::string due_id = script_.unique("owes_" + slug(*r_.p));
    const std::string holds_id = lasts ? script_.unique("holds_" + slug(*r_.p)) : due_id;
    std::string outside;
    if (!is_true(active_)) {
      outside = outside_state();
      settle(find(outside));
      if (lasts) on(find(outside), js_and(active_, p_), holds_id);
      on(find(outside), active_, due_id);
    }
    if (lasts) {
      ChartState& holds = states_.emplace_back(ChartState{holds_id, Role::kWatching, "holds: " + text, false, {}, {}});
      settle(holds);
      on(holds, js_not(active_), outside);
      on(holds, js_not(p_), due_id);
    }
    ChartState& due =
        states_.emplace_back(ChartState{due_id, Role::kPending, fmt::format("owes {} again", text), true, {}, {}});
    settle(due);
    on(due, js_not(active_), outside);
    violate_inside(due, late_event(), late());
    on(due, p_, holds_id);
    violate_inside(due, "observed", used_up());
    if (in_time()) violate_inside(due, "deadline", js_true());
    initial_ = outside.empty() || is_before() || r_.scope.kind == Scope::Kind::kGlobally ? due_id : outside;
    // Between … and … a violation is told outside.
    restart_ = is_between() ? outside : due_id;
  }

  void counting() {
    const std::string n = std::to_string(r_.times);
    Js occurs = p_;
    if (!is_momentary(*r_.p)) occurs = js_and(js_not(script_.held_before(r_.p)), p_);
    occurs = js_and(active_, occurs);
    ChartState& home = add("counts_" + slug(*r_.p), Role::kWatching, "counts " + to_text(*r_.p));
    settle(home);
    std::vector<std::string> count;
    if (!r_.bound) {
      data_.push_back({"count", "0", "occurrences in this scope"});
      violate_inside(home, "observed", js_and(occurs, {"count >= " + n, 5}));
      on(home, occurs, "", {assign("count", "count + 1")});
      if (!is_true(active_)) on(home, js_and(js_not(active_), {"count > 0", 5}), home.id);
      home.on_exit.push_back(assign("count", "0"));
    } else if (in_time()) {
      data_.push_back({"count", "0", "occurrences during the last " + r_.bound->text()});
      count = {assign("count", "count + 1"),
               fmt::format("<send event=\"forget\" delay=\"{}\"/>", delay(r_.bound->time))};
      violate_inside(home, "observed", js_and(occurs, {"count >= " + n, 5}), if_it_goes_on(count));
      on(home, occurs, "", count);
      forgets_ = true;
    } else {
      counts_always_ = true;
      const std::string clock = in_ticks() ? "ticks" : "observations";
      // What lies between occurrences, and none of their places in the run: those never come again.
      const auto gap = [](std::int64_t i) { return fmt::format("gap_{}", i); };
      std::string since = clock;
      for (std::int64_t i = 1; i < r_.times; ++i) {
        data_.push_back({gap(i), long_ago(), i == 1 ? clock + " between the last two occurrences" : "and before"});
        since += " + " + gap(i);
      }
      for (std::int64_t i = r_.times - 1; i > 1; --i) count.push_back(assign(gap(i), gap(i - 1)));
      if (r_.times > 1) count.push_back(assign(gap(1), clock));
      if (r_.times > 0) count.push_back(assign(clock, "0"));
      const Js too_many = r_.times == 0 ? js_true() : Js{fmt::format("{} <= {}", since, r_.bound->count), 5};
      violate_inside(home, "observed", js_and(occurs, too_many), if_it_goes_on(count));
      on(home, occurs, "", count);
    }
  }

  void duration() {
    may_outlive();
    auto rises = std::make_shared<Condition>();
    rises->kind = Condition::Kind::kRises;
    rises->operands = {r_.p};
    const std::string home_id = add("waits_for_" + slug(*r_.p), Role::kWatching, "waits for " + to_text(*r_.p)).id;
    const std::string holds_id = script_.unique("must_keep_" + slug(*r_.p));
    on(find(home_id), js_and(active_, script_.holds(rises)), holds_id);
    settle(find(home_id));
    ChartState& holds =
        states_.emplace_back(ChartState{holds_id, Role::kPending, "must keep " + to_text(*r_.p), true, {}, {}});
    on(holds, broken_, home_id);
    leave(holds, late(), home_id, late_event());
    violate(holds, "observed", script_.fails(r_.p));
    leave(holds, used_up(), home_id);
    over(holds, home_id);
    outlive(holds);
  }

  // More of what is counted than the bound.
  [[nodiscard]] std::string long_ago() const { return std::to_string(r_.bound->count + 1); }

  // What only matters after a violation.
  [[nodiscard]] std::vector<std::string> if_it_goes_on(const std::vector<std::string>& actions) const {
    return r_.re_arming ? actions : std::vector<std::string>();
  }
  // Back to watching; where nothing more can come, it is satisfied.
  void leave(ChartState& state, const Js& condition, const std::string& home, const std::string& event = "observed") {
    if (is_false(condition)) return;
    settle(state, condition, event);
    on(state, condition, home, {}, event);
  }

  std::string watching_for_trigger() {
    return add("waits_for_" + slug(*r_.p), Role::kWatching, "waits for " + to_text(*r_.p)).id;
  }
  std::string outside_state() {
    const std::string what = r_.scope.kind == Scope::Kind::kGlobally ? "its assumption is broken"
                             : r_.assuming                           ? "outside its scope, or its assumption is broken"
                                                                     : "outside its scope";
    return add("outside", Role::kOutside, what).id;
  }
  ChartState& find(const std::string& id) {
    return *std::find_if(states_.begin(), states_.end(), [&](const ChartState& state) { return state.id == id; });
  }

  // ---- Writing ----

  std::string write() {
    if (is_between()) {
      ChartState breached{kBreached, Role::kBreached, "is broken, if its scope ends", false, {}, {}};
      breached.edges.push_back({"observed", js_not(in_scope_), kViolated, {}});
      breached.on_entry = no_windows_;
      states_.push_back(std::move(breached));
    }
    out_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    head();
    out_ += fmt::format(
        "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"{}\" "
        "initial=\"watching\">\n",
        text::xml_escape(r_.name));
    datamodel();
    out_ += fmt::format("  <state id=\"watching\" initial=\"{}\">\n", initial_);
    observations();
    for (const ChartState& state : states_) out_ += written(state);
    out_ += "  </state>\n\n";
    if (r_.re_arming)
      out_ += fmt::format(
          "  <!-- Each entry is a violation; then it starts over. -->\n  <state id=\"violated\">\n    <transition "
          "target=\"{}\"/>\n  </state>\n",
          restart_);
    else
      out_ += "  <final id=\"violated\"/>\n";
    if (uses_satisfied()) out_ += "  <final id=\"satisfied\"/>\n";
    return out_ + "</scxml>\n";
  }

  [[nodiscard]] bool uses_satisfied() const {
    return std::any_of(states_.begin(), states_.end(), [](const ChartState& state) {
      return std::any_of(state.edges.begin(), state.edges.end(),
                         [](const Edge& edge) { return edge.target == kSatisfied; });
    });
  }

  void head() {
    out_ += fmt::format("<!--\n  Requirement {} ({}{})", r_.name, to_string(r_.importance),
                        r_.re_arming ? ", re-arming" : "");
    // Without its folder: the chart is the same wherever the project lies.
    const std::string file = r_.span.file.substr(r_.span.file.find_last_of('/') + 1);
    if (!file.empty()) out_ += fmt::format(", {}:{}", file, r_.span.line);
    out_ += "\n";
    const auto line = [&](std::string text) {
      for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at + 1))
        text.insert(at + 1, " ");
      out_ += fmt::format("  {}\n", text);
    };
    if (!r_.prose.empty()) line(fmt::format("\"{}\"", r_.prose));
    line(r_.text());
    out_ += "\n  Written from the requirement: change that, not this chart. ";
    out_ += present_.empty() || !kept_.empty()
                ? "Data are undefined until an observation sets\n"
                  "  them, and then every comparison with them is false: what has not been seen decides nothing.\n-->\n"
                : "Data of observations are those by which its state\n"
                  "  changed last; they decide nothing.\n-->\n";
  }

  void datamodel() {
    std::string inner;
    const auto data = [&](const std::string& id, const std::string& initial, const std::string& what) {
      inner += fmt::format("    <data id=\"{}\"{}/> {}\n", id,
                           initial.empty() ? "" : fmt::format(" expr=\"{}\"", initial), comment(what));
    };
    for (const Script::Variable& v : script_.variables()) data(v.name, v.is_flag() ? "false" : "", v.shown);
    for (const Script::Before& b : script_.before())
      data(b.name, "false", b.shown + ", before the present observation");
    if (has_scope()) data("in_scope", is_before() ? "true" : "false", scope_text());
    const std::string begin = counts_always_ ? long_ago() : "0";
    const std::string since = counts_always_ ? " since it occurred last" : " since it is owed";
    if (in_ticks()) data("ticks", begin, "root ticks" + since);
    if (in_events()) data("observations", begin, "observations" + since);
    for (const auto& [id, initial, what] : data_) data(id, initial, what);
    if (!inner.empty()) out_ += fmt::format("  <datamodel>\n{}  </datamodel>\n\n", inner);
  }

  [[nodiscard]] std::string scope_text() const {
    const std::string text = r_.text();
    return text.substr(0, text.find(", "));
  }

  // One transition for each name: it notes what the observation says, then tells the state below, where that has not
  // looked at it already.
  void observations() {
    if (!otherwise_.empty()) out_ += "    <!-- What is remembered where nothing else changes. -->\n";
    for (const Edge& edge : otherwise_) out_ += edge_text(edge, "    ");
    if (present_.empty()) {
      out_ += "    <!-- What is observed. -->\n";
      std::set<std::string> names;
      for (const Source& source : sources_of(r_)) {
        const std::string& name = source.observation;
        if (!names.insert(name).second) continue;
        out_ += fmt::format("    <transition event=\"{}\"{}>\n", name, condition_attribute(script_.is_meant(name)));
        note(name);
        out_ += "    </transition>\n";
      }
    }
    if (forgets_)
      out_ +=
          fmt::format("    <transition event=\"forget\">\n      {}\n    </transition>\n", assign("count", "count - 1"));
  }

  void note(const std::string& name) {
    const auto line = [&](const std::string& text) { out_ += fmt::format("      {}\n", text); };
    const bool is_tick = name == "mission.tick" && in_ticks();
    if (is_tick && ticks_only_count_) {
      line(count("ticks"));
      if (!count_newer_.empty()) line(count_newer_);
      if (!counts_always_) line("<raise event=\"ticked\"/>");
      return;
    }
    for (const Script::Before& before : script_.before()) line(assign(before.name, before.expression));
    for (const Script::Variable& variable : script_.variables()) {
      const Js set = script_.is_set(variable, name);
      if (variable.is_flag())
        line(assign(variable.name, set.text));
      else if (is_true(set))
        line(assign(variable.name, variable.assigned));
      else if (!is_false(set))
        line(fmt::format("<if cond=\"{}\">{}</if>", text::xml_escape(set.text),
                         assign(variable.name, variable.assigned)));
    }
    if (is_tick || in_events()) {
      line(count(is_tick ? "ticks" : "observations"));
      if (!count_newer_.empty()) line(count_newer_);
    }
    if (!scope_update_.text.empty()) line(assign("in_scope", scope_update_.text));
    line("<raise event=\"observed\"/>");
  }

  std::string count(const std::string& clock) const {
    std::string one_more = assign(clock, clock + " + 1");
    // Beyond the bound all numbers are the same.
    if (counts_always_) return fmt::format("<if cond=\"{} &lt;= {}\">{}</if>", clock, r_.bound->count, one_more);
    Js pending = js_false();
    for (const ChartState& state : states_) {
      if (counted(state)) pending = js_or(pending, {fmt::format("In('{}')", state.id), 9});
    }
    return fmt::format("<if cond=\"{}\">{}</if>", text::xml_escape(pending.text), one_more);
  }

  // A state in which the bound, counted in ticks or observations, runs.
  [[nodiscard]] bool counted(const ChartState& state) const {
    return state.bounded && (in_ticks() || in_events()) && !counts_always_;
  }

  [[nodiscard]] std::string written(const ChartState& state) const {
    const auto deadline = state.bounded && in_time() ? std::optional(r_.bound->time) : std::nullopt;
    return state_text(state, deadline, counted(state) ? (in_ticks() ? "ticks" : "observations") : "");
  }

  static inline const std::string kViolated = "violated";
  static inline const std::string kSatisfied = "satisfied";
  static inline const std::string kBreached = "broken_in_scope";

  struct ExtraData {
    std::string id;
    std::string initial;
    std::string what;
  };

  const Requirement& r_;
  const Typing& typing_;
  Script script_;
  const bool ticks_only_count_;
  Js p_;
  Js in_scope_ = js_true();
  Js broken_ = js_false();  // the assumption
  Js active_ = js_true();
  Js from_closed_ = js_false();  // what is owed is from a segment that has closed, between … and …
  std::vector<std::string> no_windows_;
  std::string count_newer_;
  Js scope_update_;
  const std::string present_;
  std::vector<ChartState> states_;
  std::vector<Edge> otherwise_;  // at observations by which no state changes
  std::set<std::string> kept_;   // values that other observations than their own need
  std::vector<ExtraData> data_;
  std::string initial_;
  std::string restart_;
  bool forgets_ = false;
  bool counts_always_ = false;
  std::string out_;
};

}  // namespace

Synthesis synthesize(const Requirement& requirement, const Typing& typing) {
  return Synthesizer(requirement, typing).run();
}

}  // namespace sentree::monitor
