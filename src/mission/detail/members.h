#pragma once

#include <set>
#include <string_view>
#include <utility>

#include "sentree/base/archive.h"
#include "sentree/mission/state.h"

// The members of what a run is made of, once, for saving and restoring (base/archive.h). What belongs to a chart or to
// the tree is saved with these, by save.cpp: sessions, the tree's own state, the world, the monitors. A member that is
// not listed fails mission/save_test.cpp.

namespace sentree::bt {

constexpr Status last_enumerator(Status) { return Status::kSkipped; }

}  // namespace sentree::bt

namespace sentree::project {

// A saved intervention is a table with the members of every kind, each at its default where a kind has none: the name
// of what a kind is about stands under "target". Members that no kind had at first follow.
struct SavedIntervention {
  enum class Kind : std::uint8_t { kLast = std::variant_size_v<Intervention> - 1 };
  explicit SavedIntervention(Intervention of = {}) : what(std::move(of)) {}
  Intervention what;
};
constexpr SavedIntervention::Kind last_enumerator(SavedIntervention::Kind) { return SavedIntervention::Kind::kLast; }

namespace intervention {

constexpr Breakpoint::Point last_enumerator(Breakpoint::Point) { return Breakpoint::Point::kMessage; }

// visit(column, member) for each member of an intervention.
template <class What, class Visit>
void each_column(What& what, const Visit& visit) {
  std::visit(
      [&](auto& one) {
        bool is_first = true;
        each_member(one, [&](const auto& member, auto& value) {
          const bool is_target = std::is_same_v<std::decay_t<decltype(value)>, std::string>;
          visit(std::string_view(std::exchange(is_first, false) && is_target ? "target" : member.name), value);
        });
      },
      what);
}

}  // namespace intervention

template <class S, class V>
requires archive::MaybeConst<S, SavedIntervention>
void visit_members(S& s, V&& visit) {
  auto kind = static_cast<SavedIntervention::Kind>(s.what.index());
  visit("kind", kind);
  if constexpr (!std::is_const_v<S>) s.what = every_kind()[static_cast<std::size_t>(kind)];
  std::set<std::string_view> columns;
  const auto column = [&]<class Type>(std::string_view name, Type otherwise) {
    columns.insert(name);
    bool has = false;
    intervention::each_column(s.what, [&](std::string_view of, auto& member) {
      if constexpr (std::is_same_v<std::decay_t<decltype(member)>, Type>) {
        if (of != name) return;
        has = true;
        visit(name, member);
      }
    });
    if (!has) visit(name, otherwise);
  };
  column("target", std::string());
  column("args", Value());
  column("by", Duration(0));
  column("path", std::string());
  column("value", Value());
  column("status", std::string());
  column("point", intervention::Breakpoint().point);
  column("state", std::string());
  column("count", std::uint64_t{0});
  column("id", std::uint64_t{0});
  intervention::each_column(s.what, [&](std::string_view of, auto& member) {
    if (!columns.contains(of)) visit(of, member);
  });
}

}  // namespace sentree::project

namespace sentree::mission {

constexpr Rank last_enumerator(Rank) { return Rank::kTick; }
constexpr TreePhase last_enumerator(TreePhase) { return TreePhase::kEnded; }
constexpr SkillPhase last_enumerator(SkillPhase) { return SkillPhase::kKilled; }

template <class S, class V>
requires archive::MaybeConst<S, Veto>
void visit_members(S& s, V&& visit) {
  visit("by", s.by);
  visit("reason", s.reason);
}
template <class S, class V>
requires archive::MaybeConst<S, Admission>
void visit_members(S& s, V&& visit) { visit("veto", s.veto); }
template <class S, class V>
requires archive::MaybeConst<S, Call>
void visit_members(S& s, V&& visit) {
  visit("run", s.run);
  visit("id", s.id);
  visit("service", s.service);
  visit("method", s.method);
  visit("args", s.args);
  visit("sendid", s.sendid);
  visit("session", s.session);
}
template <class S, class V>
requires archive::MaybeConst<S, CallOutcome>
void visit_members(S& s, V&& visit) {
  visit("ok", s.ok);
  visit("result", s.result);
  std::string kind(s.kind_word());
  visit("kind", kind);
  if constexpr (!std::is_const_v<S>) s.kind = idl::parse_call_error_kind(kind);
  visit("message", s.message);
}
template <class S, class V>
requires archive::MaybeConst<S, Publication>
void visit_members(S& s, V&& visit) {
  visit("topic", s.topic);
  visit("source", s.source);
  visit("args", s.args);
}
template <class S, class V>
requires archive::MaybeConst<S, Published>
void visit_members(S& s, V&& visit) { visit("what", s.what); }
template <class S, class V>
requires archive::MaybeConst<S, Refused>
void visit_members(S& s, V&& visit) {
  visit("service", s.service);
  visit("method", s.method);
  visit("id", s.id);
  visit("args", s.args);
  visit("veto", s.veto);
}
template <class S, class V>
requires archive::MaybeConst<S, Period>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, TreeTimer>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, AnswerDue>
void visit_members(S& s, V&& visit) {
  visit("leaf", s.leaf);
  visit("tick", s.tick);
  visit("when", s.when);
}
template <class S, class V>
requires archive::MaybeConst<S, Answered>
void visit_members(S& s, V&& visit) {
  visit("leaf", s.leaf);
  visit("tick", s.tick);
  visit("status", s.status);
  visit("outputs", s.outputs);
}
template <class S, class V>
requires archive::MaybeConst<S, Halted>
void visit_members(S& s, V&& visit) { visit("leaf", s.leaf); }
template <class S, class V>
requires archive::MaybeConst<S, Stop>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, HaltLimit>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, TickSkill>
void visit_members(S& s, V&& visit) {
  visit("tick", s.tick);
  visit("started", s.started);
  visit("inputs", s.inputs);
}
template <class S, class V>
requires archive::MaybeConst<S, HaltSkill>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, CancelSkill>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, KillSkill>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, RestartSkill>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, SkillTimer>
void visit_members(S& s, V&& visit) { visit("when", s.when); }
template <class S, class V>
requires archive::MaybeConst<S, Admitted>
void visit_members(S& s, V&& visit) {
  visit("call", s.call);
  visit("admission", s.admission);
}
template <class S, class V>
requires archive::MaybeConst<S, Send>
void visit_members(S& s, V&& visit) { visit("call", s.call); }
template <class S, class V>
requires archive::MaybeConst<S, Outcome>
void visit_members(S& s, V&& visit) {
  visit("call", s.call);
  visit("outcome", s.outcome);
}
template <class S, class V>
requires archive::MaybeConst<S, Finish>
void visit_members(S& s, V&& visit) {
  visit("call", s.call);
  visit("outcome", s.outcome);
  visit("vetoed_by", s.vetoed_by);
}
template <class S, class V>
requires archive::MaybeConst<S, StartModel>
void visit_members(S&, V&&) {}
template <class S, class V>
requires archive::MaybeConst<S, ServeCall>
void visit_members(S& s, V&& visit) {
  visit("leaf", s.leaf);
  visit("source", s.source);
  visit("call", s.call);
}
template <class S, class V>
requires archive::MaybeConst<S, ModelTimer>
void visit_members(S& s, V&& visit) { visit("when", s.when); }
template <class S, class V>
requires archive::MaybeConst<S, Delivery>
void visit_members(S& s, V&& visit) {
  visit("leaf", s.leaf);
  visit("what", s.what);
}
template <class S, class V>
requires archive::MaybeConst<S, Waiting>
void visit_members(S& s, V&& visit) {
  visit("when", s.when);
  visit("rank", s.rank);
  visit("order", s.order);
  visit("what", s.what);
}
template <class S, class V>
requires archive::MaybeConst<S, StandingIntervention>
void visit_members(S& s, V&& visit) {
  visit("id", s.id);
  // Not the variant as others are saved: the table.
  project::SavedIntervention what{s.what};
  visit("what", what);
  if constexpr (!std::is_const_v<S>) s.what = std::move(what.what);
  visit("used", s.used);
}

struct FaultsMembers {
  template <class S, class V>
  static void visit(S& s, V&& visit) {
    visit("entries", s.entries_);
    visit("last_id", s.last_id_);
  }
  template <class S, class V>
  static void visit_entry(S& s, V&& visit) {
    visit("standing", s.standing);
    visit("seen", s.seen);
    visit("active", s.active);
  }
  template <class S>
  static constexpr bool kIsEntry = std::is_same_v<std::remove_const_t<S>, Faults::Entry>;
};
template <class S, class V>
requires archive::MaybeConst<S, Faults>
void visit_members(S& s, V&& visit) { FaultsMembers::visit(s, visit); }
template <class S, class V>
requires FaultsMembers::kIsEntry<S>
void visit_members(S& s, V&& visit) { FaultsMembers::visit_entry(s, visit); }

template <class S, class V>
requires archive::MaybeConst<S, TreeState::Completed>
void visit_members(S& s, V&& visit) {
  visit("status", s.status);
  visit("outputs", s.outputs);
}
template <class S, class V>
requires archive::MaybeConst<S, TreeState::Leaf>
void visit_members(S& s, V&& visit) {
  visit("outstanding", s.outstanding);
  visit("call", s.call);
  visit("halt_call", s.halt_call);
  visit("asked", s.asked);
  visit("lateness_told", s.lateness_told);
  visit("late", s.late);
  visit("held", s.held);
}
template <class S, class V>
requires archive::MaybeConst<S, TreeState>
void visit_members(S& s, V&& visit) {
  visit("leaves", s.leaves);
  visit("next_tick", s.next_tick);
  visit("ticks", s.ticks);
  visit("missed", s.missed);
  visit("planned", s.planned);
  visit("given_tick", s.given_tick);
  visit("began", s.began);
  visit("timer_at", s.timer_at);
  visit("deadline", s.deadline);
  visit("deadline_timer", s.deadline_timer);
  visit("phase", s.phase);
  visit("over", s.over);
  visit("root", s.root);
  visit("reason", s.reason);
  visit("tree", s.tree);
}
template <class S, class V>
requires archive::MaybeConst<S, SkillState::Latest>
void visit_members(S& s, V&& visit) {
  visit("transition", s.transition);
  visit("event", s.event);
  visit("transitions", s.transitions);
}
template <class S, class V>
requires archive::MaybeConst<S, SkillState::Line>
void visit_members(S& s, V&& visit) {
  visit("service", s.service);
  visit("waiting", s.waiting);
  visit("not_before", s.not_before);
}
template <class S, class V>
requires archive::MaybeConst<S, SkillState::Goal>
void visit_members(S& s, V&& visit) {
  visit("service", s.service);
  visit("id", s.id);
  visit("abandoned", s.abandoned);
}
template <class S, class V>
requires archive::MaybeConst<S, SkillState>
void visit_members(S& s, V&& visit) {
  visit("phase", s.phase);
  visit("run", s.run);
  visit("tick", s.tick);
  visit("answered", s.answered);
  visit("asked", s.asked);
  visit("halt_due", s.halt_due);
  visit("ended", s.ended);
  visit("outputs", s.outputs);
  visit("trouble", s.trouble);
  visit("wake", s.wake);
  visit("not_before", s.not_before);
  visit("topics_not_before", s.topics_not_before);
  visit("latest", s.latest);
  visit("lines", s.lines);
  visit("goals", s.goals);
  visit("heard", s.heard);
  visit("session", s.session);
}
template <class S, class V>
requires archive::MaybeConst<S, ModelState::OpenCall>
void visit_members(S& s, V&& visit) {
  visit("leaf", s.leaf);
  visit("call", s.call);
  visit("due", s.due);
  visit("id", s.id);
  visit("lost", s.lost);
}
template <class S, class V>
requires archive::MaybeConst<S, ModelState>
void visit_members(S& s, V&& visit) {
  visit("open", s.open);
  visit("rng", s.rng);
  visit("fresh", s.fresh);
  visit("choices", s.choices);
  visit("wake", s.wake);
  visit("topics_not_before", s.topics_not_before);
  visit("session", s.session);
}
template <class S, class V>
requires archive::MaybeConst<S, State>
void visit_members(S& s, V&& visit) {
  visit("now", s.now);
  visit("begun", s.begun);
  visit("order", s.order);
  visit("queue", s.queue);
  visit("faults", s.faults);
  visit("down", s.down);
  visit("published", s.published);
  visit("stamp", s.stamp);
  visit("calls", s.calls);
  visit("tick", s.tick);
  visit("orders", s.orders);
  visit("tree", s.tree);
  visit("skills", s.skills);
  visit("models", s.models);
  visit("world", s.world);
  visit("monitors", s.monitors);
}

}  // namespace sentree::mission
