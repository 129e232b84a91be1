#include "sentree/mission/virtual_host.h"

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/choice.h"

namespace sentree::mission {

class VirtualHost::TreeSide final : public TreeHost {
 public:
  explicit TreeSide(VirtualHost& of)
      : host_(of),
        machine(TreeModel{.plan = &of.plan_,
                          .period = of.plan_.scenario.project.period,
                          .repeat = of.plan_.scenario.project.repeat,
                          .deadlines = of.plan_.scenario.project.deadlines,
                          .tick_times = {},
                          .one_deadline_timer = false}) {}

 private:
  TimePoint now() const override { return host_.state_->now; }
  void publish(Message message) override { host_.publish(std::move(message)); }
  std::uint64_t next_call() override { return ++host_.state_->calls; }
  void set_tick(std::uint64_t tick) override { host_.state_->tick = tick; }
  void tick(std::size_t leaf, std::uint64_t tick, bool started, const Map& inputs) override {
    host_.tell_skill(leaf, "tick", TickSkill{tick, started, inputs});
  }
  void halt(std::size_t leaf) override { host_.tell_skill(leaf, "halt", HaltSkill{}); }
  void cancel(std::size_t leaf) override { host_.tell_skill(leaf, "cancel", CancelSkill{}); }
  void deliver(TreeDelivery what) override { host_.post({Delivery::kTree, std::move(what)}); }
  void deliver_at(TimePoint when, Rank rank, TreeDelivery what) override {
    host_.put(when, rank, {Delivery::kTree, std::move(what)});
  }
  std::optional<bt::Status> forced(std::string_view leaf) override { return host_.state_->faults.forced(leaf); }
  TimePoint due(std::size_t) override { return {}; }
  void tick_began(Duration) override {}
  void tick_done(std::uint64_t, Duration) override {}
  void problem(std::string what) override { host_.surroundings_->problem(what); }
  void ended() override {}

  VirtualHost& host_;

 public:
  TreeMachine machine;
};

class VirtualHost::SkillSide final : public SkillHost {
 public:
  SkillSide(VirtualHost& of, std::size_t leaf, SkillModel model) : host_(of), leaf_(leaf), machine(std::move(model)) {}

 private:
  TimePoint now() const override { return host_.state_->now; }
  void publish(Message message) override { host_.publish(std::move(message)); }
  std::uint64_t next_call() override { return ++host_.state_->calls; }
  std::optional<Admission> request(Message message, const Shared<Call>&) override {
    message.time = now();
    message.tick = host_.state_->tick;
    if (auto veto = host_.surroundings_->judge(message)) return Admission{std::move(veto)};
    publish(std::move(message));
    return Admission{};
  }
  void send(const Shared<Call>& call, const idl::Method&) override {
    if (host_.plan_.services.at(call->service).at == "topics") {
      deliver(Outcome{call, {.ok = true, .result = {}, .kind = {}, .message = {}}});
    } else if (host_.state_->down.contains(call->service)) {
      deliver(Outcome{
          call,
          {.ok = false, .result = {}, .kind = "unreachable", .message = "service " + call->service + " was killed"}});
    } else {
      host_.post(
          {host_.model_of_.find(call->service)->second, ModelDelivery(ServeCall{leaf_, machine.model().name, call})});
    }
  }
  void deliver(SkillDelivery what) override { host_.post({leaf_, std::move(what)}); }
  void deliver_at(TimePoint when, Rank rank, SkillDelivery what) override {
    host_.put(when, rank, {leaf_, std::move(what)});
  }
  Duration delay_of(std::string_view message) override { return host_.state_->faults.delay_of(message); }
  void falsify(std::string_view call, const idl::Method& method, Value& result) override {
    host_.state_->faults.falsify(call, method, result);
  }
  void answer(std::uint64_t tick, bt::Status status, Map outputs) override {
    host_.post({Delivery::kTree, TreeDelivery(Answered{leaf_, tick, status, std::move(outputs)})});
  }
  void halted() override { host_.post({Delivery::kTree, TreeDelivery(Halted{leaf_})}); }
  void log(const scxml::LogLine& line) override {
    Message message;
    message.source = machine.model().name;
    message.name = message.source + ".log";
    message.data = Map{{"label", line.label}, {"text", line.text}};
    publish(std::move(message));
  }
  void problem(const std::string& what) override { host_.surroundings_->problem(what); }
  void taken(scxml::TransitionIndex transition) override { host_.surroundings_->taken(leaf_, transition); }

  VirtualHost& host_;
  std::size_t leaf_;

 public:
  SkillMachine machine;
};

class VirtualHost::ModelSide final : public ModelHost {
 public:
  ModelSide(VirtualHost& of, std::size_t index, ComponentModel model)
      : host_(of), index_(index), machine(std::move(model)) {}

 private:
  TimePoint now() const override { return host_.state_->now; }
  void publish(Message message) override { host_.publish(std::move(message)); }
  void deliver_at(TimePoint when, Rank rank, ModelDelivery what) override {
    host_.put(when, rank, {index_, std::move(what)});
  }
  std::uint64_t next_call() override { return ++host_.state_->calls; }
  std::optional<Admission> request(Message message) override {
    message.time = now();
    message.tick = host_.state_->tick;
    if (auto veto = host_.surroundings_->judge(message)) return Admission{std::move(veto)};
    publish(std::move(message));
    return Admission{};
  }
  std::optional<std::uint64_t> choose(const Choice& choice) override { return host_.surroundings_->choose(choice); }
  void answer(std::size_t leaf, const Shared<Call>& call, CallOutcome outcome) override {
    if (leaf != ServeCall::kOutside) host_.post({leaf, SkillDelivery(Outcome{call, std::move(outcome)})});
  }
  void problem(const std::string& what) override { host_.surroundings_->problem(what); }
  void refused(const Diagnostic& why) override { host_.surroundings_->refused(why); }

  VirtualHost& host_;
  std::size_t index_;

 public:
  ModelMachine machine;
};

Diagnostics VirtualHost::obstacles(const project::Plan& plan) {
  Diagnostics out;
  const auto add = [&](std::string code, std::string message, SourceSpan span = {}) {
    out.push_back({Severity::kError, std::move(code), std::move(message), std::move(span)});
  };
  const std::string& file = plan.scenario.project.file;
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.at.empty() || !leaf.chart)
      add("verify.elsewhere", "skill " + leaf.name + " runs in another process, where its inside cannot be seen",
          SourceSpan{file});
  }
  for (const auto& [name, service] : plan.services) {
    if (service.at != "model" && service.at != "topics") {
      add("verify.no-model",
          "service \"" + name + "\" has no model; give it a chart: models: [{file: models/" + name +
              ".scxml, serves: [" + name + "]}]",
          SourceSpan{file});
    }
  }
  for (const project::ObserverPlan& observer : plan.observers) {
    add("verify.elsewhere", "\"" + observer.name + "\" observes in another process, where its inside cannot be seen",
        SourceSpan{file});
  }
  return out;
}

VirtualHost::VirtualHost(const project::Plan& plan) : plan_(plan) {
  for (std::size_t i = 0; i < plan.leaves.size(); ++i) {
    skills_.push_back(std::make_unique<SkillSide>(*this, i, skill_model(plan, i)));
    for (const std::string& topic : plan.leaves[i].subscribes)
      takers_[topic].push_back({.is_model = false, .index = i});
  }
  for (std::size_t i = 0; i < plan.models.size(); ++i) {
    models_.push_back(std::make_unique<ModelSide>(*this, i, component_model(plan, i)));
    for (const std::string& service : plan.models[i].serves) model_of_[service] = i;
    for (const std::string& topic : plan.models[i].subscribes) takers_[topic].push_back({.is_model = true, .index = i});
  }
  tree_ = std::make_unique<TreeSide>(*this);
}

VirtualHost::~VirtualHost() = default;

void VirtualHost::remember_steps() {
  for (const auto& skill : skills_) skill->machine.remember_steps();
  for (const auto& model : models_) model->machine.remember_steps();
}

const SkillMachine& VirtualHost::skill(std::size_t leaf) const { return skills_[leaf]->machine; }
const ModelMachine& VirtualHost::model(std::size_t index) const { return models_[index]->machine; }

State VirtualHost::begin() {
  State state;
  state.tree = tree_->machine.initial();
  state.skills.resize(skills_.size());
  state.models.resize(models_.size());
  state.faults = Faults(plan_.scenario.delays);
  state_ = &state;
  for (std::size_t i = 0; i < models_.size(); ++i) put({}, Rank::kSimulator, {i, ModelDelivery(StartModel{})});
  tree_->machine.start(state.tree, *tree_);
  state_ = nullptr;
  return state;
}

void VirtualHost::put(TimePoint when, Rank rank, Delivery what) {
  Waiting waiting{std::max(when, state_->now), rank, state_->order++, std::move(what)};
  auto& queue = state_->queue;
  const auto later = std::upper_bound(queue.begin(), queue.end(), waiting, [](const Waiting& a, const Waiting& b) {
    return a.when != b.when ? a.when < b.when : a.rank < b.rank;
  });
  queue.insert(later, std::move(waiting));
}

void VirtualHost::publish(Message message) {
  message.sequence = ++state_->published;
  message.stamp = state_->stamp = std::max(state_->stamp, message.stamp) + 1;
  message.time = state_->now;
  message.tick = state_->tick;
  surroundings_->observed(message);
  if (!takers_.empty() && message.kind == MessageKind::kRequest) deliver_topic(message);
}

// A call of a one-way method reaches whoever subscribes to it; a delayed one holds back the later ones.
void VirtualHost::deliver_topic(const Message& message) {
  std::string_view topic = message.name;
  topic.remove_suffix(std::string_view(".request").size());
  const auto takers = takers_.find(topic);
  if (takers == takers_.end()) return;
  const idl::Method* const method =
      plan_.services.at(message.target).service->find(topic.substr(message.target.size() + 1));
  const Value* const args = message.data.find("args");
  auto conforming = idl::conform_arguments(*method, args != nullptr ? *args : Value(Map()));
  if (!conforming) {
    return surroundings_->problem(std::string(topic) + " of " + message.source +
                                  " reaches nobody: " + conforming.error().message);
  }
  const Duration delay = state_->faults.empty() ? Duration(0) : state_->faults.delay_of(topic);
  const Shared<Publication> what(Publication{std::string(topic), message.source, std::move(*conforming)});
  for (const Taker& taker : takers->second) {
    TimePoint& not_before =
        taker.is_model ? state_->models[taker.index].topics_not_before : state_->skills[taker.index].topics_not_before;
    not_before = std::max(not_before, add_saturating(state_->now, delay));
    put(not_before, Rank::kMessage,
        taker.is_model ? Delivery{taker.index, ModelDelivery(Published{what})}
                       : Delivery{taker.index, SkillDelivery(Published{what})});
  }
}

// A delayed tick or halt holds back the later ones.
void VirtualHost::tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) {
  TimePoint& not_before = state_->skills[leaf].not_before;
  const TimePoint now = state_->now;
  not_before = std::max(not_before, now);
  if (!state_->faults.empty())
    not_before =
        std::max(not_before, now + state_->faults.delay_of(plan_.leaves[leaf].name + "." + std::string(message)));
  put(not_before, Rank::kMessage, {leaf, std::move(what)});
}

void VirtualHost::step(State& state, Surroundings& surroundings) {
  SENTREE_ASSERT(!state.queue.empty());
  state_ = &state;
  surroundings_ = &surroundings;
  auto& queue = state.queue;
  std::size_t which = 0;
  if (queue.size() > 1 && queue[1].when == queue[0].when && queue[1].rank == queue[0].rank &&
      queue[0].rank != Rank::kTick) {
    // The first of each part: what is on its way to one keeps its order.
    std::vector<const Delivery*> first;
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < queue.size() && queue[i].when == queue[0].when && queue[i].rank == queue[0].rank; ++i) {
      if (std::any_of(first.begin(), first.end(), [&](const Delivery* d) { return same_part(*d, queue[i].what); }))
        continue;
      first.push_back(&queue[i].what);
      at.push_back(i);
    }
    if (first.size() > 1) which = at[surroundings.order(++state.orders, first)];
  }
  Waiting next = std::move(queue[which]);
  queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(which));
  state.now = next.when;
  Delivery& what = next.what;
  if (auto* tree = std::get_if<TreeDelivery>(&what.what)) {
    tree_->machine.step(state.tree, std::move(*tree), *tree_);
  } else if (auto* skill = std::get_if<SkillDelivery>(&what.what)) {
    (void)skills_[what.leaf]->machine.step(state.skills[what.leaf], std::move(*skill), *skills_[what.leaf]);
  } else {
    models_[what.leaf]->machine.step(state.models[what.leaf], std::move(std::get<ModelDelivery>(what.what)),
                                     *models_[what.leaf]);
  }
  state_ = nullptr;
}

Result<void> VirtualHost::inject(State& state, const project::Intervention& what, Surroundings& surroundings) {
  using Kind = project::Intervention::Kind;
  state_ = &state;
  surroundings_ = &surroundings;
  const auto tell = [&](std::uint64_t id) { publish(injection_message(what, "scenario", id)); };
  if (what.stands()) {
    const auto id = state.faults.next_id();
    if (!id) return tl::unexpected(id.error());
    tell(*id);
    state.faults.add(*id, what);
    return {};
  }
  if (what.kind == Kind::kClear) {
    if (auto cleared = state.faults.clear(what.id); !cleared) return cleared;
    tell(0);
    return {};
  }
  if (what.kind == Kind::kStop) {
    tell(0);
    post({Delivery::kTree, TreeDelivery(Stop{})});
    return {};
  }
  const bool kill = what.kind == Kind::kKill;
  if (!kill && what.kind != Kind::kRestart)
    return fail("verify.fault", "\"" + std::string(to_string(what.kind)) + "\" is no fault that can be tried");
  const auto refuse = [&] {
    return fail("steering.part-state", "\"" + what.target + (kill ? "\" is killed already" : "\" has not been killed"));
  };
  for (std::size_t leaf = 0; leaf < skills_.size(); ++leaf) {
    if (plan_.leaves[leaf].name != what.target) continue;
    if ((state.skills[leaf].phase == SkillPhase::kKilled) == kill) return refuse();
    tell(0);
    post({leaf, kill ? SkillDelivery(KillSkill{}) : SkillDelivery(RestartSkill{})});
    return {};
  }
  if (model_of_.find(what.target) == model_of_.end())
    return fail("verify.fault", "nothing in the mission is called \"" + what.target + "\"");
  if (state.down.contains(what.target) == kill) return refuse();
  tell(0);
  if (kill)
    state.down.insert(what.target);
  else
    state.down.erase(what.target);
  return {};
}

}  // namespace sentree::mission
