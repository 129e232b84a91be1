#include "sentree/mission/encode.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "sentree/bt/encode.h"
#include "sentree/scxml/encode.h"

namespace sentree::mission {

namespace {

// Whether a delivery finds what it was meant for. `timers` holds those of skills and models that were seen.
bool has_effect(const State& state, const Waiting& waiting, std::set<std::pair<bool, std::size_t>>& timers) {
  const std::size_t part = waiting.what.leaf;
  if (const auto* tree = std::get_if<TreeDelivery>(&waiting.what.what)) {
    const auto* due = std::get_if<AnswerDue>(tree);
    return due == nullptr || state.tree.leaves[due->leaf].outstanding == due->tick;
  }
  if (const auto* skill = std::get_if<SkillDelivery>(&waiting.what.what)) {
    const auto* timer = std::get_if<SkillTimer>(skill);
    return timer == nullptr || (state.skills[part].wake == timer->when && timers.emplace(false, part).second);
  }
  const auto* timer = std::get_if<ModelTimer>(&std::get<ModelDelivery>(waiting.what.what));
  return timer == nullptr || (state.models[part].wake == timer->when && timers.emplace(true, part).second);
}

class Writer {
 public:
  Writer(const VirtualHost& host, const State& state, std::string& out) : host_(host), state_(state), out_(out) {}

  Result<void> operator()() {
    if (auto done = tree(); !done) return done;
    for (std::size_t leaf = 0; leaf < state_.skills.size(); ++leaf) {
      if (auto done = skill(leaf); !done) return done;
    }
    for (std::size_t i = 0; i < state_.models.size(); ++i) {
      if (auto done = model(i); !done) return done;
    }
    number(state_.queue.size());
    for (const Waiting& waiting : state_.queue) {
      time(waiting.when);
      number(static_cast<std::uint64_t>(waiting.rank));
      number(waiting.what.leaf);
      std::visit([this](const auto& to) { one_of(to); }, waiting.what.what);
    }
    for (const StandingIntervention& standing : state_.faults.list()) {
      text(to_json(Value(to_entry(standing.what))));
      if (standing.what.count > 0) number(standing.used);
    }
    for (const std::string& down : state_.down) text(down);
    return {};
  }

 private:
  void number(std::uint64_t n) {
    while (n >= 0x80) {
      out_.push_back(static_cast<char>(n | 0x80));
      n >>= 7U;
    }
    out_.push_back(static_cast<char>(n));
  }
  void flag(bool b) { out_.push_back(b ? 1 : 0); }
  void text(std::string_view s) {
    number(s.size());
    out_.append(s);
  }
  void value(const Value& v) { text(v.is_null() ? "" : to_json(v)); }
  void map(const Map& m) {
    if (m.empty())
      number(0);
    else
      text(to_json(Value(m)));
  }
  // Past times are alike.
  void time(TimePoint t) {
    if (t == kNever)
      number(1);
    else
      number(t <= state_.now ? 0 : 2 + static_cast<std::uint64_t>((t - state_.now).count()));
  }
  void renamed(std::map<std::uint64_t, std::uint64_t>& names, std::uint64_t id) {
    number(id == 0 ? 0 : names.emplace(id, names.size() + 1).first->second);
  }
  void tick_number(std::uint64_t id) { renamed(ticks_, id); }
  void call_number(std::uint64_t id) { renamed(calls_, id); }

  void completed(const std::optional<TreeState::Completed>& what) {
    flag(what.has_value());
    if (!what) return;
    number(static_cast<std::uint64_t>(what->status));
    map(what->outputs);
  }

  Result<void> tree() {
    const TreeState& tree = state_.tree;
    if (auto done = bt::encode(host_.plan().tree, tree.tree, state_.now, out_); !done) return done;
    for (const TreeState::Leaf& leaf : tree.leaves) {
      tick_number(leaf.outstanding);
      if (leaf.outstanding != 0) {
        call_number(leaf.call);
        // How long it has not answered, which is compared with a bound.
        number(static_cast<std::uint64_t>((state_.now - leaf.asked).count()));
      }
      call_number(leaf.halt_call);
      completed(leaf.late);
      completed(leaf.held);
    }
    time(tree.planned);
    time(tree.timer_at);
    number(static_cast<std::uint64_t>(tree.phase));
    flag(tree.over);
    number(static_cast<std::uint64_t>(tree.root));
    return {};
  }

  Result<void> skill(std::size_t leaf) {
    const SkillState& skill = state_.skills[leaf];
    number(static_cast<std::uint64_t>(skill.phase));
    flag(skill.answered == skill.tick);
    tick_number(skill.tick);
    flag(skill.asked);
    time(skill.halt_due.value_or(TimePoint{}));
    flag(skill.halt_due.has_value());
    const bool ended = skill.phase == SkillPhase::kEnded || skill.phase == SkillPhase::kReady;
    number(ended ? static_cast<std::uint64_t>(skill.ended) : 0);
    map(skill.outputs);
    text(skill.trouble);
    time(skill.wake);
    time(skill.not_before);
    time(skill.topics_not_before);
    for (const SkillState::Line& line : skill.lines) {
      if (line.waiting.empty() && line.not_before <= state_.now) continue;
      text(line.service);
      time(line.not_before);
      number(line.waiting.size());
      for (const auto& call : line.waiting) write(call, leaf);
    }
    flag(skill.running());
    if (!skill.running()) return {};
    return scxml::encode(host_.skill(leaf).model().chart, skill.session, state_.now, out_);
  }

  Result<void> model(std::size_t index) {
    const ModelState& model = state_.models[index];
    number(model.open.size());
    for (const ModelState::OpenCall& open : model.open) {
      number(open.id);
      number(open.leaf);
      write(open.call, open.leaf);
      time(open.due);
    }
    number(model.fresh);
    time(model.wake);
    time(model.topics_not_before);
    return scxml::encode(host_.model(index).model().chart, model.session, state_.now, out_);
  }

  bool asks_for_ids(std::size_t leaf) const {
    const auto ambient = host_.skill(leaf).model().chart.ambient();
    return std::any_of(ambient.begin(), ambient.end(), [](const scxml::AmbientUse& use) {
      return use.what == scxml::Ambient::kIds || use.what == scxml::Ambient::kAnything;
    });
  }

  // @param leaf  Whose skill made it.
  void write(const Shared<Call>& call, std::size_t leaf) {
    flag(leaf < state_.skills.size() && state_.skills[leaf].is_current(call->run));
    call_number(call->id);
    text(call->service);
    text(call->method);
    value(call->args);
    // Ids that the engine makes up matter to a chart that asks for them.
    const bool asks = leaf >= state_.skills.size() || asks_for_ids(leaf);
    text(asks ? call->sendid : "");
  }
  void write(const CallOutcome& outcome) {
    flag(outcome.ok);
    value(outcome.result);
    text(outcome.kind);
    text(outcome.message);
  }

  template <class... Kinds>
  void one_of(const std::variant<Kinds...>& what) {
    number(what.index());
    std::visit([this](const auto& kind) { content(kind); }, what);
  }
  template <class Empty>
  void content(const Empty&) {
    static_assert(std::is_empty_v<Empty>);
  }
  void content(const AnswerDue& due) {
    number(due.leaf);
    tick_number(due.tick);
  }
  void content(const Answered& answered) {
    number(answered.leaf);
    tick_number(answered.tick);
    number(static_cast<std::uint64_t>(answered.status));
    map(answered.outputs);
  }
  void content(const Halted& halted) { number(halted.leaf); }
  void content(const TickSkill& tick) {
    tick_number(tick.tick);
    flag(tick.started);
    map(tick.inputs);
  }
  void content(const SkillTimer&) {}
  void content(const ModelTimer&) {}
  void content(const Admitted& admitted) {
    write(admitted.call, kNobody);
    flag(admitted.admission.veto.has_value());
    if (admitted.admission.veto) {
      text(admitted.admission.veto->by);
      text(admitted.admission.veto->reason);
    }
  }
  void content(const Send& send) { write(send.call, leaf_of(send.call)); }
  void content(const Outcome& outcome) {
    write(outcome.call, leaf_of(outcome.call));
    write(outcome.outcome);
  }
  void content(const Finish& finish) {
    write(finish.call, leaf_of(finish.call));
    write(finish.outcome);
    text(finish.vetoed_by);
  }
  void content(const Published& published) {
    text(published.what->topic);
    text(published.what->source);
    value(published.what->args);
  }
  void content(const Refused& refused) {
    text(refused.service);
    text(refused.method);
    value(refused.args);
    text(refused.veto.by);
    text(refused.veto.reason);
  }
  void content(const ServeCall& serve) {
    number(serve.leaf);
    write(serve.call, serve.leaf);
    text(serve.source);
  }

  // To whom a call in the queue belongs: the delivery says it beside.
  std::size_t leaf_of(const Shared<Call>& call) const {
    for (const Waiting& waiting : state_.queue) {
      const auto* skill = std::get_if<SkillDelivery>(&waiting.what.what);
      if (skill == nullptr) continue;
      const bool is_this = std::visit(
          [&](const auto& kind) {
            if constexpr (requires { *kind.call; }) return &*kind.call == &*call;
            return false;
          },
          *skill);
      if (is_this) return waiting.what.leaf;
    }
    return kNobody;
  }
  static constexpr std::size_t kNobody = static_cast<std::size_t>(-1);

  const VirtualHost& host_;
  const State& state_;
  std::string& out_;
  std::map<std::uint64_t, std::uint64_t> ticks_;
  std::map<std::uint64_t, std::uint64_t> calls_;
};

}  // namespace

void prune(State& state) {
  std::set<std::pair<bool, std::size_t>> timers;
  std::erase_if(state.queue, [&](const Waiting& waiting) { return !has_effect(state, waiting, timers); });
}

Result<void> encode(const VirtualHost& host, const State& state, std::string& out) {
  return Writer(host, state, out)();
}

}  // namespace sentree::mission
