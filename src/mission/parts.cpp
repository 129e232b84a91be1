#include "sentree/mission/parts.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/apply.h"
#include "sentree/project/intervention.h"

namespace sentree::mission {

namespace {

// The leaf and the run of the call that a delivery carries; nothing: it carries none.
struct CallOf {
  Numbered operator()(const ServeCall& serve) const { return std::pair(serve.leaf, serve.call->run); }
  template <class Kind>
  Numbered operator()(const Kind& kind) const {
    if constexpr (requires { kind.call->run; }) return std::pair(leaf, kind.call->run);
    return std::nullopt;
  }
  std::size_t leaf;
};

// Likewise the leaf and the number of a tick.
struct TickOf {
  Numbered operator()(const Answered& answered) const { return std::pair(answered.leaf, answered.tick); }
  Numbered operator()(const AnswerDue& due) const { return std::pair(due.leaf, due.tick); }
  Numbered operator()(const TickSkill& tick) const { return std::pair(leaf, tick.tick); }
  template <class Kind>
  Numbered operator()(const Kind&) const {
    return std::nullopt;
  }
  std::size_t leaf;
};

}  // namespace

Numbered numbered_tick(const Delivery& what) {
  return std::visit([&](const auto& to) { return std::visit(TickOf{what.leaf}, to); }, what.what);
}

Numbered numbered_call(const Delivery& what) {
  return std::visit([&](const auto& to) { return std::visit(CallOf{what.leaf}, to); }, what.what);
}

class Parts::TreeSide final : public TreeHost {
 public:
  explicit TreeSide(const project::Plan& plan)
      : machine(TreeModel{.plan = &plan,
                          .period = plan.scenario.project.period,
                          .repeat = plan.scenario.project.repeat,
                          .deadlines = plan.scenario.project.deadlines,
                          .tick_times = {},
                          .one_deadline_timer = false}) {}

  TreeMachine machine;
  Ground* ground = nullptr;  // during a step

 private:
  TimePoint now() const override { return ground->now(); }
  void publish(Message message) override { ground->publish(std::move(message)); }
  bool is_heard(ObservationName& name) override { return ground->is_heard(name); }
  void pass() override { ground->pass(); }
  std::uint64_t next_call() override { return ground->next_call(); }
  std::uint64_t tick_number(std::size_t leaf, std::uint64_t next) override { return ground->tick_number(leaf, next); }
  void set_tick(std::uint64_t tick) override { ground->set_tick(tick); }
  void changed(bt::NodeId node, bt::Status to) override {
    ground->met({Met::Kind::kNode, static_cast<std::uint32_t>(node), static_cast<std::uint32_t>(to)});
  }
  void has_answered(std::size_t leaf, bt::Status status) override {
    ground->met({Met::Kind::kAnswer, static_cast<std::uint32_t>(leaf), static_cast<std::uint32_t>(status)});
  }
  void tick(std::size_t leaf, std::uint64_t tick, bool started, const Map& inputs) override {
    ground->tell_skill(leaf, "tick", TickSkill{tick, started, inputs});
  }
  void halt(std::size_t leaf, TimePoint /*asked*/) override { ground->tell_skill(leaf, "halt", HaltSkill{}); }
  void cancel(std::size_t leaf, TimePoint) override { ground->tell_skill(leaf, "cancel", CancelSkill{}); }
  void deliver(TreeDelivery what) override { deliver_at(now(), Rank::kMessage, std::move(what)); }
  void deliver_at(TimePoint when, Rank rank, TreeDelivery what) override {
    ground->put(when, rank, {Delivery::kTree, std::move(what)});
  }
  std::optional<bt::Status> forced(std::string_view leaf) override { return ground->forced(leaf); }
  TimePoint due(std::size_t) override { return {}; }
  void tick_began(Duration) override {}
  void tick_done(std::uint64_t, Duration) override {}
  void problem(std::string what) override { ground->problem(what); }
  void ended() override {}
};

class Parts::SkillSide final : public SkillHost {
 public:
  SkillSide(const Parts& of, std::size_t leaf, SkillModel model) : machine(std::move(model)), of_(of), leaf_(leaf) {}

  SkillMachine machine;
  Ground* ground = nullptr;

 private:
  TimePoint now() const override { return ground->now(); }
  void publish(Message message) override { ground->publish(std::move(message)); }
  void show(Message& message) override { ground->show(message); }
  bool is_heard(ObservationName& name) override { return ground->is_heard(name); }
  void pass() override { ground->pass(); }
  std::uint64_t next_call() override { return ground->next_call(); }
  std::uint64_t run_number(std::uint64_t next) override { return ground->run_number(leaf_, next); }
  std::optional<Admission> request(Message message, const Shared<Call>&) override {
    if (auto veto = ground->judge(message)) return Admission{std::move(veto)};
    publish(std::move(message));
    return Admission{};
  }
  void send(const Shared<Call>& call, const idl::Method&) override {
    if (of_.plan_.services.at(call->service).at == "topics")
      deliver(Outcome{call, CallOutcome::returned()});
    else
      ground->call(leaf_, call);
  }
  void deliver(SkillDelivery what) override { deliver_at(now(), Rank::kMessage, std::move(what)); }
  void deliver_at(TimePoint when, Rank rank, SkillDelivery what) override {
    ground->put(when, rank, {leaf_, std::move(what)});
  }
  void entered(scxml::StateIndex state) override {
    ground->met({Met::Kind::kSkillState, static_cast<std::uint32_t>(leaf_), static_cast<std::uint32_t>(state)});
  }
  Duration delay_of(std::string_view message) override { return ground->delay_of(message); }
  void falsify(std::string_view call, const idl::Method& method, Value& result) override {
    ground->falsify(call, method, result);
  }
  bool fails(Failing how, std::string_view call) override { return ground->fails(how, call); }
  void answer(std::uint64_t tick, bt::Status status, Map outputs) override {
    ground->put(now(), Rank::kMessage,
                {Delivery::kTree, TreeDelivery(Answered{leaf_, tick, status, std::move(outputs)})});
  }
  void halted() override { ground->put(now(), Rank::kMessage, {Delivery::kTree, TreeDelivery(Halted{leaf_})}); }
  void log(const scxml::LogLine& line) override {
    Message message;
    message.source = machine.model().name;
    message.name = message.source + ".log";
    message.data = Map{{"label", line.label}, {"text", line.text}};
    publish(std::move(message));
  }
  void problem(const std::string& what) override { ground->problem(what); }
  void taken(scxml::TransitionIndex transition) override { ground->taken(leaf_, transition); }

  const Parts& of_;
  std::size_t leaf_;
};

class Parts::ModelSide final : public ModelHost {
 public:
  ModelSide(std::size_t index, ComponentModel model) : machine(std::move(model)), index_(index) {}

  ModelMachine machine;
  Ground* ground = nullptr;

 private:
  TimePoint now() const override { return ground->now(); }
  void publish(Message message) override { ground->publish(std::move(message)); }
  void deliver_at(TimePoint when, Rank rank, ModelDelivery what) override {
    ground->put(when, rank, {index_, std::move(what)});
  }
  std::uint64_t next_call() override { return ground->next_call(); }
  std::optional<Admission> request(Message message) override {
    if (auto veto = ground->judge(message)) return Admission{std::move(veto)};
    publish(std::move(message));
    return Admission{};
  }
  std::optional<std::uint64_t> choose(const Choice& choice) override { return ground->choose(choice); }
  void entered(scxml::StateIndex state) override {
    ground->met({Met::Kind::kModelState, static_cast<std::uint32_t>(index_), static_cast<std::uint32_t>(state)});
  }
  void taken(scxml::TransitionIndex transition) override {
    ground->met(
        {Met::Kind::kModelTransition, static_cast<std::uint32_t>(index_), static_cast<std::uint32_t>(transition)});
  }
  bool is_made_late(std::string_view call) override { return ground->fails(Failing::kLate, call); }
  void answer(std::size_t leaf, const Shared<Call>& call, CallOutcome outcome) override {
    if (leaf != ServeCall::kOutside)
      ground->put(now(), Rank::kMessage, {leaf, SkillDelivery(Outcome{call, std::move(outcome)})});
  }
  void problem(const std::string& what) override { ground->problem(what); }
  void refused(const Diagnostic& why) override { ground->refused(why); }

  std::size_t index_;
};

Parts::Parts(const project::Plan& plan) : plan_(plan), subscriptions_(plan) {
  for (std::size_t i = 0; i < plan.leaves.size(); ++i)
    skills_.push_back(std::make_unique<SkillSide>(*this, i, skill_model(plan, i)));
  for (std::size_t i = 0; i < plan.models.size(); ++i) {
    models_.push_back(std::make_unique<ModelSide>(i, component_model(plan, i)));
    for (const std::string& service : plan.models[i].serves) model_of_[service] = i;
  }
  tree_ = std::make_unique<TreeSide>(plan);
}

Parts::~Parts() = default;

void Parts::remember_steps() {
  for (const auto& skill : skills_) skill->machine.remember_steps();
  for (const auto& model : models_) model->machine.remember_steps();
}

void Parts::start(TreeState& state, Ground& ground) {
  tree_->ground = &ground;
  tree_->machine.start(state, *tree_);
}
void Parts::step(TreeState& state, TreeDelivery&& what, Ground& ground) {
  tree_->ground = &ground;
  tree_->machine.step(state, std::move(what), *tree_);
}
void Parts::step(std::size_t leaf, SkillState& state, SkillDelivery&& what, Ground& ground) {
  skills_[leaf]->ground = &ground;
  (void)skills_[leaf]->machine.step(state, std::move(what), *skills_[leaf]);
}
void Parts::step(std::size_t model, ModelState& state, ModelDelivery&& what, Ground& ground) {
  models_[model]->ground = &ground;
  models_[model]->machine.step(state, std::move(what), *models_[model]);
}

TreeState Parts::initial_tree() const { return tree_->machine.initial(); }
const SkillMachine& Parts::skill(std::size_t leaf) const { return skills_[leaf]->machine; }
const ModelMachine& Parts::model(std::size_t index) const { return models_[index]->machine; }

std::optional<std::size_t> Parts::model_of(std::string_view service) const {
  const auto found = model_of_.find(service);
  return found != model_of_.end() ? std::optional(found->second) : std::nullopt;
}

Delivery Parts::delivery_of(std::size_t leaf, const Shared<Call>& call) const {
  return {*model_of(call->service), ModelDelivery(ServeCall{leaf, skill(leaf).model().name, call})};
}

SkillDelivery Parts::unreachable(const Shared<Call>& call) {
  return Outcome{
      call, CallOutcome::failed(idl::CallErrorKind::kUnreachable, fmt::format("service {} was killed", call->service))};
}

namespace {

// A mission on a ground, as interventions find it.
class OnGround final : public Intervened {
 public:
  OnGround(const Parts& parts, Faults& faults, std::set<std::string>& down,
           const std::function<bool(std::size_t leaf)>& is_killed, Ground& ground, std::optional<std::uint64_t> number)
      : parts_(parts), faults_(faults), down_(down), is_killed_(is_killed), ground_(ground), number_(number) {}

 private:
  TimePoint now() const override { return ground_.now(); }
  void publish(Message message) override { ground_.publish(std::move(message)); }
  void stop_mission() override { post({Delivery::kTree, TreeDelivery(mission::Stop{})}); }

  Result<std::uint64_t> next_id() override {
    auto next = faults_.next_id();
    if (next) *next = number_.value_or(*next);
    return next;
  }
  void stand(std::uint64_t id, const project::Intervention& what) override { faults_.add(id, what); }
  Result<void> end_standing(std::uint64_t id) override { return faults_.clear(id); }

  std::optional<bool> is_killed(const std::string& part) const override {
    if (const auto leaf = leaf_of(part)) return is_killed_(*leaf);
    return parts_.model_of(part) ? std::optional(down_.contains(part)) : std::nullopt;
  }
  void kill_part(const std::string& part, TimePoint /*asked*/) override {
    if (const auto leaf = leaf_of(part))
      post({*leaf, SkillDelivery(KillSkill{})});
    else
      down_.insert(part);
  }
  void restart_part(const std::string& part, TimePoint /*asked*/) override {
    if (const auto leaf = leaf_of(part))
      post({*leaf, SkillDelivery(RestartSkill{})});
    else
      down_.erase(part);
  }

  Result<CallOutcome> call_service(const project::intervention::Call& what) override {
    const auto dot = what.method.rfind('.');
    const std::string name = what.method.substr(0, dot);
    const auto model = parts_.model_of(name);
    const auto service = parts_.plan().services.find(name);
    if (!model || service == parts_.plan().services.end())
      return fail("verify.fault", fmt::format("no model of the mission serves {}", name));
    const auto method = idl::find_method(*service->second.service, what.method.substr(dot + 1), name);
    if (!method) return fail("verify.fault", method.error().message);
    auto args = idl::conform_arguments(**method, what.args);
    if (!args) return fail("verify.fault", args.error().message);
    if (down_.contains(name)) return CallOutcome{};
    if ((*method)->oneway) {
      Message request;
      request.kind = MessageKind::kRequest;
      request.source = "scenario";
      request.target = name;
      request.name = what.method + ".request";
      request.call = ground_.next_call();
      request.data = Map{{"args", *args}};
      ground_.publish(std::move(request));
    }
    Call call{.run = 0,
              .id = ground_.next_call(),
              .service = name,
              .method = (*method)->name,
              .args = *std::move(args),
              .sendid = {}};
    ground_.serve(*model, {ServeCall::kOutside, "scenario", Shared<Call>(std::move(call))});
    return CallOutcome{};
  }

  void post(Delivery delivery) { ground_.put(ground_.now(), Rank::kMessage, std::move(delivery)); }
  std::optional<std::size_t> leaf_of(const std::string& part) const {
    const auto& leaves = parts_.plan().leaves;
    const auto found = std::find_if(leaves.begin(), leaves.end(), [&](const auto& leaf) { return leaf.name == part; });
    return found != leaves.end() ? std::optional(static_cast<std::size_t>(found - leaves.begin())) : std::nullopt;
  }

  const Parts& parts_;
  Faults& faults_;
  std::set<std::string>& down_;
  const std::function<bool(std::size_t leaf)>& is_killed_;
  Ground& ground_;
  std::optional<std::uint64_t> number_;
};

}  // namespace

Result<void> inject(const Parts& parts, Faults& faults, std::set<std::string>& down,
                    const std::function<bool(std::size_t leaf)>& is_killed, const project::Intervention& what,
                    Ground& ground, std::optional<std::uint64_t> number) {
  OnGround run(parts, faults, down, is_killed, ground, number);
  const auto applied = apply(what, "scenario", run);
  if (!applied) return tl::unexpected(applied.error());
  return {};
}

}  // namespace sentree::mission
