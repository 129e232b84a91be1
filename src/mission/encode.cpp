#include "sentree/mission/encode.h"

#include <algorithm>
#include <set>
#include <utility>

#include "sentree/base/encoder.h"
#include "sentree/bt/encode.h"
#include "sentree/mission/effect.h"
#include "sentree/project/intervention.h"
#include "sentree/scxml/encode.h"

namespace sentree::mission {

namespace {

// Whether a delivery finds what it was meant for. `timers` holds those of skills and models that were seen.
bool has_effect(const State& state, const Waiting& waiting, std::set<std::pair<bool, std::size_t>>& timers) {
  bool is_timer = false;
  bool of_model = false;
  const bool has = mission::has_effect(waiting.what, state.tree, [&](bool is_model, std::size_t part) {
    is_timer = true;
    of_model = is_model;
    return is_model ? state.models[part].wake : state.skills[part].wake;
  });
  return has && (!is_timer || timers.emplace(of_model, waiting.what.leaf).second);
}

// Writes what a part, or something on its way, is made of.
class Writer {
 public:
  Writer(const Parts& parts, TimePoint now, std::string& out) : parts_(parts), now_(now), text_(out), out_(out) {}

  // Each names all members, so that a new one does not compile before it is clear whether behaviour depends on it.

  Result<void> write(const TreeState& of, bt::Times times) {
    // Numbers join messages; the rest is told, or follows from what is here.
    const auto& [tree, leaves, next_tick, ticks, missed, planned, given_tick, began, timer_at, deadline, deadline_timer,
                 phase, over, root, reason] = of;
    if (auto done = bt::encode(parts_.plan().tree, tree, now_, text_, times); !done) return done;
    for (const auto& [index, leaf] : leaves) {
      const auto& [outstanding, call, halt_call, asked, lateness_told, late, held] = leaf;
      if (outstanding == 0 && halt_call == 0 && !late && !held) continue;
      out_.number(index + 1);
      out_.number(outstanding);
      // How long it has not answered, which is compared with a bound.
      if (outstanding != 0) out_.integer((now_ - asked).count());
      flag(halt_call != 0);
      completed(late);
      completed(held);
    }
    out_.number(0);
    // Once it is over no tick is planned any more.
    if (!over) due(planned);
    due(timer_at);
    out_.number(static_cast<std::uint64_t>(phase));
    flag(over);
    out_.number(static_cast<std::uint64_t>(root));
    return {};
  }

  Result<void> write(std::size_t leaf, const SkillState& of) {
    // Until when messages are held back is written with the whole run; `latest` is told.
    const auto& [phase, run, tick, answered, asked, halt_due, ended, outputs, trouble, wake, not_before,
                 topics_not_before, latest, lines, goals, heard, session] = of;
    const SkillModel& model = parts_.skill(leaf).model();
    // Most are at rest, with nothing that is left of a run.
    const bool nothing_waits = std::all_of(lines.begin(), lines.end(), [&](const SkillState::Line& line) {
      return line.waiting.empty() && line.not_before <= now_;
    });
    if (phase == SkillPhase::kIdle && answered == tick && !asked && !halt_due && outputs.empty() && trouble.empty() &&
        wake == kNever && nothing_waits && goals.empty() && heard.empty() && !model.protocol) {
      out_.byte(kAtRest);
      return {};
    }
    out_.number(static_cast<std::uint64_t>(phase));
    out_.number(answered == tick ? 0 : tick);
    flag(asked);
    flag(halt_due.has_value());
    if (halt_due) due(*halt_due);
    const bool has_ended = phase == SkillPhase::kEnded || phase == SkillPhase::kReady;
    out_.number(has_ended ? static_cast<std::uint64_t>(ended) : 0);
    map(outputs);
    out_.text(trouble);
    due(wake);
    for (const auto& [service, waiting, line_not_before] : lines) {
      if (waiting.empty() && line_not_before <= now_) continue;
      out_.text(service);
      time(line_not_before);
      out_.number(waiting.size());
      for (const auto& call : waiting) write(*call, leaf);
    }
    out_.text("");
    for (const auto& [service, id, abandoned] : goals) {
      out_.text(service);
      out_.text(id);
      flag(abandoned);
    }
    out_.text("");
    for (const Shared<Publication>& one : heard) content(Published{one});
    out_.text("");
    // What is published begins a chart that lives on only once.
    if (model.protocol) flag(run == 0);
    flag(of.running());
    if (!of.running()) return {};
    out_.number(run);
    return scxml::encode(model.chart, session, now_, text_);
  }

  Result<void> write(std::size_t index, const ModelState& of) {
    // Whoever asks for a form decides every choice.
    const auto& [session, open, rng, fresh, choices, wake, topics_not_before] = of;
    out_.number(open.size());
    for (const auto& [leaf, call, late_at, id, lost] : open) {
      out_.number(id);
      out_.number(leaf);
      out_.number(lost ? 1 : 0);
      write(*call, leaf);
      time(late_at);
    }
    out_.number(fresh);
    due(wake);
    return scxml::encode(parts_.model(index).model().chart, session, now_, text_);
  }

  void write(const Delivery& what) {
    out_.number(what.leaf);
    out_.number(what.what.index());
    leaf_ = what.leaf;
    std::visit([this](const auto& to) { one_of(to); }, what.what);
  }

  // Past times are alike.
  void time(TimePoint t) {
    if (t == kNever)
      out_.number(1);
    else
      out_.number(t <= now_ ? 0 : 2 + static_cast<std::uint64_t>((t - now_).count()));
  }

 private:
  void flag(bool b) { out_.byte(b ? 1 : 0); }
  void value(const Value& v) {
    out_.value(v, [this](std::string_view text) {
      out_.byte(Encoder::kString);
      out_.text(text);
    });
  }
  void map(const Map& m) {
    out_.number(m.size());
    for (const auto& [name, v] : m) {
      out_.text(name);
      value(v);
    }
  }
  // How far it is matters on both sides.
  void due(TimePoint t) {
    flag(t == kNever);
    if (t != kNever) out_.integer((t - now_).count());
  }

  void completed(const std::optional<TreeState::Completed>& what) {
    flag(what.has_value());
    if (!what) return;
    out_.number(static_cast<std::uint64_t>(what->status));
    map(what->outputs);
  }

  // @param leaf  Whose skill made it.
  void write(const Call& call, std::size_t leaf) {
    out_.number(call.run);
    out_.text(call.service);
    out_.text(call.method);
    value(call.args);
    // Ids that the engine makes up matter to a chart that asks for them.
    const bool asks = leaf >= parts_.skills() || asks_for_ids(parts_.skill(leaf).model().chart);
    out_.text(asks ? call.sendid : "");
    out_.text(call.session);
  }
  void write(const CallOutcome& outcome) {
    flag(outcome.ok);
    value(outcome.result);
    out_.text(outcome.kind_word());
    out_.text(outcome.message);
  }

  template <class... Kinds>
  void one_of(const std::variant<Kinds...>& what) {
    out_.number(what.index());
    std::visit([this](const auto& kind) { content(kind); }, what);
  }
  template <class Empty>
  void content(const Empty&) {
    static_assert(std::is_empty_v<Empty>);
  }
  void content(const AnswerDue& due) {
    out_.number(due.leaf);
    out_.number(due.tick);
  }
  void content(const Answered& answered) {
    out_.number(answered.leaf);
    out_.number(answered.tick);
    out_.number(static_cast<std::uint64_t>(answered.status));
    map(answered.outputs);
  }
  void content(const Halted& halted) { out_.number(halted.leaf); }
  void content(const TickSkill& tick) {
    out_.number(tick.tick);
    flag(tick.started);
    map(tick.inputs);
  }
  void content(const SkillTimer& timer) { due(timer.when); }
  void content(const ModelTimer& timer) { due(timer.when); }
  void content(const Admitted& admitted) {
    write(*admitted.call, leaf_);
    flag(admitted.admission.veto.has_value());
    if (admitted.admission.veto) write(*admitted.admission.veto);
  }
  void content(const Send& send) { write(*send.call, leaf_); }
  void content(const Outcome& outcome) {
    write(*outcome.call, leaf_);
    write(outcome.outcome);
  }
  void content(const Finish& finish) {
    write(*finish.call, leaf_);
    write(finish.outcome);
    out_.text(finish.vetoed_by);
  }
  void content(const Published& published) {
    out_.text(published.what->topic);
    out_.text(published.what->source);
    value(published.what->args);
  }
  void content(const Refused& refused) {
    out_.text(refused.service);
    out_.text(refused.method);
    value(refused.args);
    write(refused.veto);
  }
  void content(const ServeCall& serve) {
    out_.number(serve.leaf);
    write(*serve.call, serve.leaf);
    out_.text(serve.source);
  }
  void write(const Veto& veto) {
    out_.text(veto.by);
    out_.text(veto.reason);
  }

  static constexpr std::uint8_t kAtRest = 0x7F;  // of no phase

  const Parts& parts_;
  TimePoint now_;
  std::string& text_;
  Encoder out_;
  std::size_t leaf_ = 0;
};

}  // namespace

bool asks_for_ids(const scxml::Chart& chart) {
  const auto ambient = chart.ambient();
  return std::any_of(ambient.begin(), ambient.end(), [](const scxml::AmbientUse& use) {
    return use.what == scxml::Ambient::kIds || use.what == scxml::Ambient::kIdText ||
           use.what == scxml::Ambient::kAnything;
  });
}

void prune(State& state) {
  std::set<std::pair<bool, std::size_t>> timers;
  std::erase_if(state.queue, [&](const Waiting& waiting) { return !has_effect(state, waiting, timers); });
}

Result<void> encode(const Parts& parts, const TreeState& tree, TimePoint now, std::string& out, bt::Times times) {
  return Writer(parts, now, out).write(tree, times);
}
Result<void> encode(const Parts& parts, std::size_t leaf, const SkillState& skill, TimePoint now, std::string& out) {
  return Writer(parts, now, out).write(leaf, skill);
}
Result<void> encode(const Parts& parts, std::size_t index, const ModelState& model, TimePoint now, std::string& out) {
  return Writer(parts, now, out).write(index, model);
}
void encode(const Parts& parts, const Delivery& what, TimePoint when, std::string& out) {
  Writer(parts, when, out).write(what);
}

void encode(const Faults& faults, const std::set<std::string>& down, std::string& out) {
  Encoder to(out);
  for (const StandingIntervention& standing : faults.list()) {
    to.number(standing.id);  // by which it may be cleared
    to.text(to_json(Value(project::to_entry(standing.what))));
    if (project::count_of(standing.what) > 0) to.number(standing.used);
  }
  to.text("");
  for (const std::string& one : down) to.text(one);
}

Result<void> encode(const Parts& parts, const State& state, std::string& out, bt::Times times) {
  // Numbers join messages; the robot is in no run that has a form, and monitors have theirs.
  const auto& [now, begun, order, queue, tree, skills, models, faults, down, published, stamp, calls, tick, orders,
               world, monitors] = state;
  Writer writer(parts, now, out);
  if (auto done = encode(parts, tree, now, out, times); !done) return done;
  for (std::size_t leaf = 0; leaf < skills.size(); ++leaf) {
    if (auto done = encode(parts, leaf, skills[leaf], now, out); !done) return done;
    writer.time(skills[leaf].not_before);
    writer.time(skills[leaf].topics_not_before);
  }
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (auto done = encode(parts, i, models[i], now, out); !done) return done;
    writer.time(models[i].topics_not_before);
  }
  Encoder(out).number(queue.size());
  for (const Waiting& waiting : queue) {
    writer.time(waiting.when);
    Encoder(out).number(static_cast<std::uint64_t>(waiting.rank));
    encode(parts, waiting.what, waiting.when, out);
  }
  encode(faults, down, out);
  return {};
}

}  // namespace sentree::mission
