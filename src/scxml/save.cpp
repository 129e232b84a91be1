#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "sentree/scxml/carry.h"
#include "sentree/scxml/detail/interpreter.h"
#include "sentree/scxml/detail/session_members.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {
namespace {

constexpr int kFormat = 2;

// As text: JSON's numbers are doubles to many readers.
std::string hex(std::uint64_t word) {
  char buffer[17];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, word, 16).ptr;
  return {buffer, end};
}

std::optional<std::uint64_t> from_hex(const Value* value) {
  const std::string_view text = value ? value->text() : std::string_view();
  std::uint64_t word = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), word, 16);
  if (text.empty() || failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return word;
}

// Whether a set can be one of `model`: of its size, and of states that can be active.
bool fits(const StateSet& set, const Model& model) {
  if (set.words() != StateSet(model.states.size()).words()) return false;
  bool fits = true;
  set.for_each([&](StateIndex s) { fits = fits && s > 0 && s < model.states.size() && !model.states[s].is_history(); });
  return fits;
}

}  // namespace

struct SessionSnapshot {
  static bool is_bound(const Session& session) { return session.fingerprint_ != 0; }

  static Value save(const Session& session) {
    archive::Saver saver;
    saver.map["format"] = kFormat;
    saver.map["chart"] = hex(session.fingerprint_);
    SessionMembers::visit(session, saver);
    List invocations;
    for (const Invocation& invocation : session.invocations_) {
      Map item{{"id", invocation.id}, {"invoke", static_cast<std::int64_t>(invocation.invoke)}};
      if (invocation.child) {
        item["session"] = save(*invocation.child);
        item["file"] = invocation.child.chart().file();
        item["source"] = invocation.child.chart().source();
      }
      invocations.emplace_back(std::move(item));
    }
    saver.map["invocations"] = std::move(invocations);
    return std::move(saver.map);
  }

  static bool restore_invocation(const Chart& chart, const Value& saved, const LoadOptions& options, int depth,
                                 Invocation& invocation) {
    const auto& invokes = chart.model().invokes;
    const Value* invoke = saved.find("invoke");
    if (!invoke || !invoke->as_int() || *invoke->as_int() < 0 || !saved.find("id")) return false;
    if (static_cast<std::uint64_t>(*invoke->as_int()) >= invokes.size()) return false;
    invocation.invoke = static_cast<std::uint32_t>(*invoke->as_int());
    invocation.state = invokes[invocation.invoke].state;
    invocation.id = saved.find("id")->text();
    const Value* child = saved.find("session");
    if (!child) return true;
    const Value* source = saved.find("source");
    const Value* file = saved.find("file");
    if (!source || !file) return false;
    const auto& known = invokes[invocation.invoke].child;
    auto loaded = known && known->source() == source->text()
                      ? known
                      : load_in(folder_of(file->text()), source->text(), std::string(file->text()), options).value;
    if (!loaded) return false;
    invocation.child = ChildSession(*std::move(loaded));
    return restore(invocation.child.chart(), *child, options, depth + 1, *invocation.child);
  }

  static bool restore(const Chart& chart, const Value& saved, const LoadOptions& options, int depth, Session& session) {
    const Value* format = saved.find("format");
    const Value* invocations = saved.find("invocations");
    if (depth > kSavedDepthMax || !format || *format != Value(kFormat) || !invocations || !invocations->as_list())
      return false;
    reset_session(chart, session, {}, 1);
    std::string problem;
    SessionMembers::visit(session, archive::Restorer{&saved, {}, &problem});
    if (!problem.empty() || !is_session_of(chart.model(), session)) return false;
    for (const Value& item : *invocations->as_list()) {
      if (!restore_invocation(chart, item, options, depth, session.invocations_.emplace_back())) return false;
    }
    return true;
  }

  // What the engine takes for granted of a session; everything else that is well formed is harmless.
  static bool is_session_of(const Model& model, const Session& session) {
    const auto is_event = [](const Event& event) { return event.type <= EventType::kExternal; };
    return session.status_ <= SessionStatus::kFailed && fits(session.configuration_, model) &&
           (model.late_binding ? fits(*session.initialized_, model) : session.initialized_->empty()) &&
           session.variables_->size() == model.variables.size() &&
           std::all_of(session.internal_.begin(), session.internal_.end(), is_event) &&
           std::all_of(session.external_.begin(), session.external_.end(), is_event) &&
           std::all_of(session.timers_->begin(), session.timers_->end(),
                       [&](const Timer& timer) { return is_event(timer.event); }) &&
           std::all_of(session.history_->begin(), session.history_->end(), [&](const auto& entry) {
             const auto& [history, states] = entry;
             return history < model.states.size() && model.states[history].is_history() &&
                    std::all_of(states.begin(), states.end(), [&, parent = model.states[history].parent](StateIndex s) {
                      return s < model.states.size() && !model.states[s].is_history() && model.is_descendant(s, parent);
                    });
           });
  }

  static constexpr int kSavedDepthMax = 64;

  /// From one chart to another.
  struct Mapping {
    const Chart& before;
    const Chart& after;
    Diagnostics problems;

    // The root, and states that have no id, have no counterpart.
    std::optional<StateIndex> find(StateIndex state) const {
      const std::string& id = before.states()[state].id;
      return id.empty() ? std::nullopt : after.find(id);
    }
    void refuse(const std::string& what, const Place& place) {
      problems.push_back({Severity::kError, "scxml.cannot-carry", what, before.span(place)});
    }
    std::string named(StateIndex state) const {
      const std::string& id = before.states()[state].id;
      return id.empty() ? "a state without id" : fmt::format("state \"{}\"", id);
    }
  };

  static StateSet configuration(Mapping& mapping, const Session& session) {
    const auto states = mapping.after.states();
    StateSet active(states.size());
    session.configuration_.for_each([&](StateIndex old) {
      const auto now = mapping.find(old);
      if (!now || states[*now].is_history()) {
        if (!session.running()) return;
        mapping.refuse(mapping.named(old) + " is active, and the new chart has none of that id",
                       mapping.before.states()[old].place);
        return;
      }
      for (StateIndex s = *now; s != 0 && s != kNoState; s = states[s].parent) active.insert(s);
    });
    if (!mapping.problems.empty()) return active;
    const auto refuse = [&](StateIndex at, const std::string& what) {
      const std::string& id = states[at].id;
      mapping.problems.push_back(
          {Severity::kError, "scxml.cannot-carry",
           fmt::format("{} is active, and {}", id.empty() ? "a state" : fmt::format("state \"{}\"", id), what),
           mapping.after.span(states[at].place)});
    };
    const auto check = [&](StateIndex at) {
      std::size_t inside = 0;
      std::size_t children = 0;
      for (const StateIndex child : states[at].children) {
        if (states[child].is_history()) continue;
        ++children;
        if (active.contains(child)) ++inside;
      }
      if (states[at].kind == StateKind::kParallel) {
        if (inside < children) refuse(at, "in the new chart it has a region of which nothing is active");
      } else if (children > 0 && inside == 0) {
        refuse(at, "in the new chart it has states inside, none of which is active");
      } else if (inside > 1) {
        refuse(at, "in the new chart only one of its active states can be");
      }
    };
    if (session.running()) {
      check(0);
      active.for_each(check);
    }
    return active;
  }

  static void history(const Mapping& mapping, const Session& session, Session& carried) {
    for (const auto& [history, states] : *session.history_) {
      const auto now = mapping.find(history);
      if (!now || !mapping.after.states()[*now].is_history()) continue;
      std::vector<StateIndex> kept;
      for (const StateIndex state : states) {
        const auto target = mapping.find(state);
        if (target && mapping.after.model().is_descendant(*target, mapping.after.states()[*now].parent))
          kept.push_back(*target);
      }
      // What is no longer whole is no memory: the default is taken instead.
      if (kept.size() == states.size()) carried.history_.edit().emplace_back(*now, std::move(kept));
    }
  }

  // What was running stays with the <invoke> of the same place in the state of the same id.
  static void invocations(Mapping& mapping, const Session& session, Session& carried) {
    const Model& was = mapping.before.model();
    const Model& is = mapping.after.model();
    for (const Invocation& invocation : session.invocations_) {
      const auto& olds = was.state_code[invocation.state].invokes;
      const auto place = std::find(olds.begin(), olds.end(), invocation.invoke) - olds.begin();
      const auto state = mapping.find(invocation.state);
      if (!state || is.state_code[*state].invokes.size() != olds.size()) {
        mapping.refuse(
            fmt::format("what {} has invoked is running, and the new chart's state of that id does not invoke as many",
                        mapping.named(invocation.state)),
            was.invokes[invocation.invoke].place);
        continue;
      }
      Invocation& kept = carried.invocations_.emplace_back(invocation);
      kept.state = *state;
      kept.invoke = is.state_code[*state].invokes[static_cast<std::size_t>(place)];
    }
  }

  static void data(const Mapping& mapping, const Session& session, Session& carried) {
    const Model& was = mapping.before.model();
    const Model& is = mapping.after.model();
    if (is.variables.empty()) return;
    const bool has_new = std::any_of(is.variables.begin(), is.variables.end(),
                                     [&](const Variable& variable) { return !was.slots.contains(variable.id); });
    if (has_new && !is.late_binding) {
      Session beginning;
      Effects nowhere;
      start(mapping.after, beginning, {}, TimePoint{}, nowhere);
      if (beginning.variables_->size() == is.variables.size()) carried.variables_ = beginning.variables_;
    }
    auto& variables = carried.variables_.edit();
    for (std::size_t slot = 0; slot < is.variables.size(); ++slot) {
      const auto old = was.slots.find(is.variables[slot].id);
      if (old != was.slots.end()) variables[slot] = (*session.variables_)[old->second];
    }
  }

  static Loaded<Session> carry(const Chart& before, const Session& session, const Chart& after) {
    if (!is_bound(session) || before.fingerprint() == after.fingerprint()) return {session, {}};
    Mapping mapping{before, after, {}};
    const Model& model = after.model();
    if (before.data_model() != after.data_model() || before.model().late_binding != model.late_binding)
      mapping.refuse("the new chart has another data model, or another binding", {});
    if (auto reason = session.unsaveable()) mapping.problems.push_back(*std::move(reason));
    Session carried;
    reset_session(after, carried, {}, 1);
    if (mapping.problems.empty()) {
      carried.status_ = session.status_;
      carried.scripts_run_ = session.scripts_run_;
      carried.identity_ = session.identity_;
      carried.configuration_ = configuration(mapping, session);
      if (model.late_binding) {
        session.initialized_->for_each([&](StateIndex state) {
          if (const auto now = mapping.find(state)) carried.initialized_.edit().insert(*now);
        });
      }
      history(mapping, session, carried);
      carried.internal_ = session.internal_;
      carried.external_ = session.external_;
      carried.timers_ = session.timers_;
      invocations(mapping, session, carried);
      data(mapping, session, carried);
      carried.globals_ = session.globals_;
      carried.sequence_ = session.sequence_;
      carried.ids_ = session.ids_;
      carried.rng_ = session.rng_;
      carried.failure_ = session.failure_;
      carried.done_data_ = session.done_data_;
    }
    if (!mapping.problems.empty()) return {std::nullopt, std::move(mapping.problems)};
    return {std::move(carried), {}};
  }
};

Loaded<Session> carry(const Chart& before, const Session& session, const Chart& after) {
  return SessionSnapshot::carry(before, session, after);
}

Result<Value> save(const Chart&, const Session& session) {
  if (!SessionSnapshot::is_bound(session)) return Value();
  if (auto reason = session.unsaveable()) return tl::unexpected(*std::move(reason));
  return SessionSnapshot::save(session);
}

Result<Session> restore(const Chart& chart, const Value& saved, const LoadOptions& options) {
  if (saved.is_null()) return Session();
  const auto fingerprint = from_hex(saved.find("chart"));
  if (fingerprint && *fingerprint != chart.fingerprint()) {
    return fail("scxml.other-chart", "the saved session belongs to another chart, or to another version of " +
                                         (chart.file().empty() ? std::string("this one") : chart.file()));
  }
  Session session;
  if (!fingerprint || !SessionSnapshot::restore(chart, saved, options, 0, session)) {
    return fail("scxml.bad-snapshot", "this is no saved session, or a damaged one");
  }
  return session;
}

}  // namespace sentree::scxml
