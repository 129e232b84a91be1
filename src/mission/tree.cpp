#include "sentree/mission/tree.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"

namespace sentree::mission {

namespace {

constexpr TreeEdge kTreeEdges[] = {
    {TreePhase::kBetween, "period", TreePhase::kBetween},   {TreePhase::kBetween, "period", TreePhase::kWaiting},
    {TreePhase::kBetween, "period", TreePhase::kHalting},   {TreePhase::kBetween, "period", TreePhase::kEnded},
    {TreePhase::kWaiting, "period", TreePhase::kWaiting},  // missed
    {TreePhase::kWaiting, "answered", TreePhase::kWaiting}, {TreePhase::kWaiting, "answered", TreePhase::kBetween},
    {TreePhase::kWaiting, "answered", TreePhase::kHalting}, {TreePhase::kWaiting, "answered", TreePhase::kEnded},
    {TreePhase::kWaiting, "due", TreePhase::kWaiting},      {TreePhase::kWaiting, "due", TreePhase::kBetween},
    {TreePhase::kWaiting, "due", TreePhase::kHalting},      {TreePhase::kWaiting, "due", TreePhase::kEnded},
    {TreePhase::kBetween, "timer", TreePhase::kBetween},    {TreePhase::kBetween, "timer", TreePhase::kHalting},
    {TreePhase::kBetween, "timer", TreePhase::kEnded},      {TreePhase::kWaiting, "timer", TreePhase::kWaiting},
    {TreePhase::kBetween, "halted", TreePhase::kBetween},   {TreePhase::kWaiting, "halted", TreePhase::kWaiting},
    {TreePhase::kHalting, "halted", TreePhase::kHalting},   {TreePhase::kHalting, "halted", TreePhase::kEnded},
    {TreePhase::kBetween, "stop", TreePhase::kHalting},     {TreePhase::kBetween, "stop", TreePhase::kEnded},
    {TreePhase::kWaiting, "stop", TreePhase::kHalting},     {TreePhase::kWaiting, "stop", TreePhase::kEnded},
    {TreePhase::kHalting, "stop", TreePhase::kHalting},     {TreePhase::kHalting, "limit", TreePhase::kEnded},
};

struct TreeDeliveryKind {
  std::string_view operator()(const Period&) const { return "period"; }
  std::string_view operator()(const TreeTimer&) const { return "timer"; }
  std::string_view operator()(const AnswerDue&) const { return "due"; }
  std::string_view operator()(const Answered&) const { return "answered"; }
  std::string_view operator()(const Halted&) const { return "halted"; }
  std::string_view operator()(const Stop&) const { return "stop"; }
  std::string_view operator()(const HaltLimit&) const { return "limit"; }
};

Map entry(std::string key, Value value) {
  Map map;
  map.append(std::move(key), std::move(value));
  return map;
}

}  // namespace

std::string_view to_string(TreePhase phase) {
  constexpr std::array<std::string_view, 4> kNames{"between ticks", "waiting", "halting", "ended"};
  return kNames[static_cast<std::size_t>(phase)];
}

std::span<const TreeEdge> tree_edges() { return kTreeEdges; }

std::string_view kind_of(const TreeDelivery& delivery) { return std::visit(TreeDeliveryKind(), delivery); }

void TreeMachine::StatusEvents::status_changed(bt::NodeId node, bt::Status from, bt::Status to, TimePoint) {
  host->changed(node, to);
  if (!host->is_heard(name)) return host->pass();
  Message message;
  message.source = tree->path(node);
  message.name = name.text;
  Map data;
  data.reserve(3);
  data.append("node", static_cast<std::int64_t>(node));
  data.append("from", to_string(from));
  data.append("to", to_string(to));
  message.data = std::move(data);
  host->publish(std::move(message));
}

TreeMachine::TreeMachine(TreeModel model)
    : model_(std::move(model)), leaf_of_node_(model_.plan->tree.size(), model_.plan->leaves.size()) {
  for (std::size_t i = 0; i < model_.plan->leaves.size(); ++i) {
    const project::LeafPlan& leaf = model_.plan->leaves[i];
    leaf_of_node_[leaf.node] = i;
    names_.push_back({ObservationName(leaf.name + ".tick.request"), ObservationName(leaf.name + ".tick.reply")});
  }
  statuses_.tree = &model_.plan->tree;
  effects_.observer = &statuses_;
}

TreeState TreeMachine::initial() const {
  TreeState state;
  state.tree = bt::State(model_.plan->tree);
  return state;
}

/// One delivery to the mission.
class TreeMachine::Step {
 public:
  Step(TreeMachine& machine, TreeState& state, TreeHost& host)
      : machine_(machine), model_(machine.model_), plan_(*machine.model_.plan), state_(state), host_(host) {
    machine_.statuses_.host = &host;
  }

  void operator()(const Period&) {
    if (state_.over) return;
    const TimePoint now = host_.now();
    if (state_.phase == TreePhase::kWaiting) {
      // The last tick is not over: this period is missed, not queued.
      ++state_.missed;
    } else {
      host_.tick_began(now - state_.planned);
      state_.began = now;
      host_.set_tick(++state_.ticks);
      publish(MessageKind::kEvent, "mission", "", "mission.tick",
              entry("tick", static_cast<std::int64_t>(state_.ticks)));
      run(bt::Input::tick());
    }
    if (state_.over) return;
    TimePoint next = state_.planned + model_.period;
    // Periods that have passed altogether are missed as well.
    while (next + model_.period <= host_.now()) {
      next += model_.period;
      ++state_.missed;
    }
    plan_next_tick(next);
  }

  void operator()(const TreeTimer&) {
    state_.timer_at = kNever;
    // Timers that come due during a suspended tick wait for its end.
    if (!state_.over && state_.phase != TreePhase::kWaiting) run(bt::Input::timer());
  }

  void operator()(const AnswerDue& due) {
    state_.deadline_timer = kNever;
    if (!model_.one_deadline_timer) return give_up_waiting(due);
    if (state_.deadline.when <= host_.now()) return give_up_waiting(state_.deadline);
    if (state_.outstanding(state_.deadline.leaf) == state_.deadline.tick) watch_deadline();
  }

  void operator()(Answered&& answered) {
    TreeState::Leaf& leaf = state_.leaves[answered.leaf];
    const project::LeafPlan& plan = plan_.leaves[answered.leaf];
    if (leaf.outstanding != answered.tick || answered.tick == 0) return;  // halted or cancelled meanwhile
    leaf.outstanding = 0;
    leaf.lateness_told.reset();
    const bt::Status truth = answered.status;
    const bool forced = force(plan, leaf, answered);
    host_.has_answered(answered.leaf, answered.status);
    if (ObservationName& name = machine_.names_[answered.leaf].reply; host_.is_heard(name)) {
      Map data = entry("status", to_string(answered.status));
      if (forced) data.append("forced", true);
      if (!answered.outputs.empty()) data.append("outputs", answered.outputs);
      publish(MessageKind::kReply, plan.name, "mission", name.text, std::move(data), leaf.call);
    } else {
      host_.pass();
    }
    if (forced && bt::is_completed(answered.status) && !bt::is_completed(truth)) {
      // The tree has done with the leaf, so its skill must have done too.
      cancel(answered.leaf);
    }
    note_reason(plan.name, answered);
    if (state_.tree.waiting_leaf() == plan.node)
      run(bt::Input::answer(plan.node, answered.status, std::move(answered.outputs)));
    else if (bt::is_completed(answered.status))
      leaf.late = {answered.status, std::move(answered.outputs)};
  }

  void operator()(const Halted& halted) {
    TreeState::Leaf& leaf = state_.leaves[halted.leaf];
    const project::LeafPlan& plan = plan_.leaves[halted.leaf];
    if (leaf.halt_call == 0) return;
    publish(MessageKind::kReply, plan.name, "mission", plan.name + ".halt.reply", Map(),
            std::exchange(leaf.halt_call, 0));
    run(bt::Input::leaf_halted(plan.node));
  }

  void operator()(const Stop&) {
    if (!state_.over) {
      state_.over = true;
      run(bt::Input::halt());
    }
    // A leaf whose machine is gone will not answer, also one that halts because the mission has completed; the run ends
    // all the same.
    host_.deliver_at(add_saturating(host_.now(), 2 * model_.deadlines.halt), Rank::kTimer, HaltLimit{});
  }

  void operator()(const HaltLimit&) {
    if (state_.phase == TreePhase::kEnded) return;
    host_.problem("the run ended while leaves were still halting");
    state_.phase = TreePhase::kEnded;
    host_.ended();
  }

  // Where all this leaves the mission.
  void settle() {
    std::erase_if(state_.leaves, [](const auto& leaf) { return leaf.second.at_rest(); });
    if (state_.phase == TreePhase::kEnded) return;
    if (!state_.over) {
      state_.phase = state_.tree.waiting_leaf() != bt::kNoNode ? TreePhase::kWaiting : TreePhase::kBetween;
    } else if (!state_.tree.outstanding_halts().empty()) {
      state_.phase = TreePhase::kHalting;
    } else {
      state_.phase = TreePhase::kEnded;
      host_.ended();
    }
  }

  void plan_next_tick(TimePoint by_rate) {
    const auto& given = model_.tick_times;
    state_.planned = state_.given_tick < given.size() ? given[state_.given_tick++] : by_rate;
    host_.deliver_at(state_.planned, Rank::kTick, Period{});
  }

 private:
  void publish(MessageKind kind, std::string source, std::string target, std::string name, Map data,
               std::uint64_t call = 0) {
    Message message;
    message.kind = kind;
    message.source = std::move(source);
    message.target = std::move(target);
    message.name = std::move(name);
    message.call = call;
    message.data = std::move(data);
    host_.publish(std::move(message));
  }

  std::size_t index_of(bt::NodeId node) const {
    const std::size_t index = machine_.leaf_of_node_[node];
    SENTREE_ASSERT(index < plan_.leaves.size());
    return index;
  }

  void cancel(std::size_t index) {
    const std::string& name = plan_.leaves[index].name;
    const TimePoint asked = host_.now();
    publish(MessageKind::kEvent, "mission", name, name + ".cancel", Map());
    host_.cancel(index, asked);
  }

  // A mission fails by the leaf that failed last, unless that has recovered since.
  void note_reason(const std::string& leaf, const Answered& answered) {
    const Value* reason = answered.outputs.find("reason");
    const bool failed = answered.status == bt::Status::kFailure;
    if (failed && reason != nullptr)
      state_.reason = fmt::format("{}: {}", leaf, reason->text());
    else if (failed || (!state_.reason.empty() && state_.reason.starts_with(leaf + ": ")))
      state_.reason.clear();
  }

  void run(bt::Input input) {
    // Each answer known at once is the next input: a loop, so that a long tick does not recurse.
    std::optional<bt::Input> next = std::move(input);
    bool failed = false;
    std::string told;  // why it failed
    bt::Effects& effects = machine_.effects_;
    while (next) {
      const bool halts = next->kind == bt::Input::Kind::kHalt;
      const bt::StepResult result = bt::step(plan_.tree, state_.tree, *next, host_.now(), effects);
      next.reset();
      const bool waits = result.waiting() && effects.next_timer <= host_.now();
      if (effects.next_timer < state_.timer_at && !waits) {
        state_.timer_at = effects.next_timer;
        host_.deliver_at(state_.timer_at, Rank::kTimer, TreeTimer{});
      }
      machine_.followed_.swap(effects.list);
      for (const bt::Effect& effect : machine_.followed_) follow(effect);
      if (result.waiting()) {
        TreeState::Leaf& leaf = state_.leaves[index_of(result.leaf)];
        if (leaf.late) {
          // What the leaf said too late for its own tick answers this one.
          next = bt::Input::answer(result.leaf, leaf.late->status, std::move(leaf.late->outputs));
          leaf.late.reset();
        }
      } else if (result.done()) {
        finish_tick(result.status);
      } else if (result.kind == bt::StepResult::Kind::kFailed) {
        const std::string why = effects.error ? to_string(*effects.error) : "the tree failed";
        // Halting executes the `_onHalted` once more that has failed the tick.
        if (why != told) host_.problem(why);
        if (state_.reason.empty() || !failed) state_.reason = why;
        // A halt that fails has halted all the same; asking again would fail again.
        if (!halts && !state_.over) {
          failed = true;
          told = why;
          next = bt::Input::halt();
        }
      }
    }
    if (failed) finish_tick(bt::Status::kFailure);
  }

  void follow(const bt::Effect& effect) {
    const std::size_t index = index_of(effect.leaf);
    TreeState::Leaf& leaf = state_.leaves[index];
    const std::string& name = plan_.leaves[index].name;
    if (effect.kind == bt::Effect::Kind::kTickLeaf) {
      tick_leaf(index, effect);
      return;
    }
    leaf.late.reset();
    leaf.held.reset();
    leaf.outstanding = 0;
    if (effect.kind == bt::Effect::Kind::kHaltLeaf) {
      const TimePoint asked = host_.now();
      leaf.halt_call = host_.next_call();
      publish(MessageKind::kRequest, "mission", name, name + ".halt.request", Map(), leaf.halt_call);
      host_.halt(index, asked);
    } else {
      cancel(index);
    }
  }

  void tick_leaf(std::size_t index, const bt::Effect& effect) {
    TreeState::Leaf& leaf = state_.leaves[index];
    const project::LeafPlan& plan = plan_.leaves[index];
    if (leaf.late) return;  // answered already, see `run`
    const TimePoint now = host_.now();
    if (leaf.outstanding == 0) {
      leaf.outstanding = host_.tick_number(index, ++state_.next_tick);
      leaf.asked = now;
      leaf.call = host_.next_call();
      if (ObservationName& name = machine_.names_[index].request; host_.is_heard(name))
        publish(MessageKind::kRequest, "mission", plan.name, name.text, entry("inputs", effect.inputs), leaf.call);
      else
        host_.pass();
      if (effect.started) leaf.held.reset();
      if (leaf.held)
        host_.deliver(Answered{index, leaf.outstanding, leaf.held->status, leaf.held->outputs});
      else
        host_.tick(index, leaf.outstanding, effect.started, effect.inputs);
    }
    // One that has an older tick outstanding gets no second one, but the same time to answer.
    const Duration patience = plan.condition ? model_.deadlines.condition : model_.deadlines.budget;
    const TimePoint told = host_.due(index);
    if (told == kNever) return;
    const TimePoint until = add_saturating(now, patience);
    state_.deadline = {index, leaf.outstanding, told > now ? told : plan.condition ? until : with_next_tick(until)};
    watch_deadline();
  }

  // A budget that ends just behind the next period ends with it: ticks begin a little late where time is real, and
  // would cost the next one else. When the next tick is known to have begun, this one had ended.
  TimePoint with_next_tick(TimePoint until) const {
    const bool is_planned = state_.planned > state_.began;
    const auto& given = model_.tick_times;
    const std::size_t number = is_planned ? state_.given_tick - 1 : state_.given_tick;
    if (number < given.size() && (!is_planned || state_.planned == given[number]))
      return std::min(until, given[number]);
    const TimePoint next = is_planned ? state_.planned : add_saturating(state_.planned, model_.period);
    return until > next && next > host_.now() && until - next <= model_.period / 20 ? next : until;
  }

  void watch_deadline() {
    if (model_.one_deadline_timer && state_.deadline_timer <= state_.deadline.when) return;
    state_.deadline_timer = state_.deadline.when;
    host_.deliver_at(state_.deadline.when, Rank::kTimer, state_.deadline);
  }

  void give_up_waiting(const AnswerDue due) {
    TreeState::Leaf& leaf = state_.leaves[due.leaf];
    const project::LeafPlan& plan = plan_.leaves[due.leaf];
    if (leaf.outstanding != due.tick || state_.tree.waiting_leaf() != plan.node) return;
    const bool unresponsive = host_.now() - leaf.asked >= model_.deadlines.unresponsive;
    if (plan.condition || unresponsive) {
      const char* why = plan.condition ? "past the condition deadline" : "unresponsive";
      publish(MessageKind::kError, plan.name, "mission", plan.name + ".tick.error",
              Map{{"kind", "late"}, {"message", why}}, leaf.call);
      tell_late(plan, leaf, bt::Status::kFailure, why);
      state_.reason = fmt::format("{}: {}", plan.name, why);
      leaf.outstanding = 0;
      host_.cancel(due.leaf, kNever);
      run(bt::Input::answer(plan.node, bt::Status::kFailure));
    } else {
      tell_late(plan, leaf, bt::Status::kRunning, "past its budget");
      run(bt::Input::answer(plan.node, bt::Status::kRunning));
    }
  }

  // Whoever ticks ten times a second need not read it ten times a second.
  void tell_late(const project::LeafPlan& plan, TreeState::Leaf& leaf, bt::Status counts_as, const std::string& why) {
    if (leaf.lateness_told == counts_as) return;
    leaf.lateness_told = counts_as;
    host_.problem(fmt::format("{} did not answer tick {} ({}) and counts as {} until it answers", plan.name,
                              state_.ticks, why, to_string(counts_as)));
  }

  // What stands may make the leaf say something else. True: it does.
  bool force(const project::LeafPlan& plan, TreeState::Leaf& leaf, Answered& answer) {
    const std::optional<bt::Status> forced = host_.forced(plan.name);
    if (!forced) {
      leaf.held.reset();
      return false;
    }
    if (*forced != bt::Status::kRunning)
      leaf.held.reset();
    else if (bt::is_completed(answer.status))
      leaf.held = {answer.status, answer.outputs};
    if (*forced != answer.status) answer.outputs = Map();
    answer.status = *forced;
    return true;
  }

  void finish_tick(bt::Status status) {
    const Duration took = host_.now() - state_.began;
    if (status != state_.root)
      publish(MessageKind::kEvent, "mission", "", "mission.status", entry("status", to_string(status)));
    state_.root = status;
    if (status == bt::Status::kSuccess) state_.reason.clear();
    host_.tick_done(state_.ticks, took);
    if (bt::is_completed(status) && !model_.repeat) state_.over = true;
  }

  TreeMachine& machine_;
  const TreeModel& model_;
  const project::Plan& plan_;
  TreeState& state_;
  TreeHost& host_;
};

void TreeMachine::start(TreeState& state, TreeHost& host) const {
  state.planned = model_.tick_times.empty() ? TimePoint{} : model_.tick_times[state.given_tick++];
  host.deliver_at(state.planned, Rank::kTick, Period{});
}

void TreeMachine::step(TreeState& state, TreeDelivery&& delivery, TreeHost& host) {
  const TreePhase before = state.phase;
  const std::string_view by = kind_of(delivery);
  if (before == TreePhase::kEnded) return;
  Step step(*this, state, host);
  std::visit([&](auto&& what) { step(std::forward<decltype(what)>(what)); }, std::move(delivery));
  step.settle();
  const TreeEdge taken{before, by, state.phase};
  // What nobody waits for any more changes nothing.
  SENTREE_ASSERT(before == state.phase ||
                 std::find(std::begin(kTreeEdges), std::end(kTreeEdges), taken) != std::end(kTreeEdges));
}

}  // namespace sentree::mission
