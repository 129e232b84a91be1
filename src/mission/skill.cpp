#include "sentree/mission/skill.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/step.h"

namespace sentree::mission {

namespace {

constexpr auto kKilled = "the skill was killed";

constexpr SkillEdge kSkillEdges[] = {
    // A run begins, goes on, is answered, or ends within its tick.
    {SkillPhase::kIdle, "tick", SkillPhase::kIdle},
    {SkillPhase::kIdle, "tick", SkillPhase::kRunning},
    {SkillPhase::kIdle, "tick", SkillPhase::kOwing},
    {SkillPhase::kRunning, "tick", SkillPhase::kRunning},
    {SkillPhase::kRunning, "tick", SkillPhase::kIdle},
    {SkillPhase::kOwing, "tick", SkillPhase::kOwing},
    {SkillPhase::kOwing, "tick", SkillPhase::kIdle},
    {SkillPhase::kHalting, "tick", SkillPhase::kHalting},
    {SkillPhase::kEnded, "tick", SkillPhase::kIdle},
    {SkillPhase::kEnded, "tick", SkillPhase::kRunning},
    {SkillPhase::kKilled, "tick", SkillPhase::kKilled},
    // Outcomes and timers reach a living chart only.
    {SkillPhase::kRunning, "outcome", SkillPhase::kRunning},
    {SkillPhase::kRunning, "outcome", SkillPhase::kEnded},
    {SkillPhase::kOwing, "outcome", SkillPhase::kOwing},
    {SkillPhase::kOwing, "outcome", SkillPhase::kIdle},
    {SkillPhase::kHalting, "outcome", SkillPhase::kHalting},
    {SkillPhase::kHalting, "outcome", SkillPhase::kIdle},
    {SkillPhase::kRunning, "timer", SkillPhase::kRunning},
    {SkillPhase::kRunning, "timer", SkillPhase::kEnded},
    {SkillPhase::kOwing, "timer", SkillPhase::kOwing},
    {SkillPhase::kOwing, "timer", SkillPhase::kIdle},
    {SkillPhase::kHalting, "timer", SkillPhase::kHalting},
    {SkillPhase::kHalting, "timer", SkillPhase::kIdle},
    // A halt takes its time; a cancelled run is gone at once.
    {SkillPhase::kIdle, "halt", SkillPhase::kIdle},
    {SkillPhase::kRunning, "halt", SkillPhase::kHalting},
    {SkillPhase::kRunning, "halt", SkillPhase::kIdle},
    {SkillPhase::kOwing, "halt", SkillPhase::kHalting},
    {SkillPhase::kOwing, "halt", SkillPhase::kIdle},
    {SkillPhase::kHalting, "halt", SkillPhase::kHalting},
    {SkillPhase::kHalting, "halt", SkillPhase::kIdle},
    {SkillPhase::kEnded, "halt", SkillPhase::kIdle},
    {SkillPhase::kKilled, "halt", SkillPhase::kKilled},
    {SkillPhase::kIdle, "cancel", SkillPhase::kIdle},
    {SkillPhase::kRunning, "cancel", SkillPhase::kIdle},
    {SkillPhase::kOwing, "cancel", SkillPhase::kIdle},
    {SkillPhase::kHalting, "cancel", SkillPhase::kIdle},
    {SkillPhase::kEnded, "cancel", SkillPhase::kIdle},
    {SkillPhase::kKilled, "cancel", SkillPhase::kKilled},
    {SkillPhase::kIdle, "kill", SkillPhase::kKilled},
    {SkillPhase::kRunning, "kill", SkillPhase::kKilled},
    {SkillPhase::kOwing, "kill", SkillPhase::kKilled},
    {SkillPhase::kHalting, "kill", SkillPhase::kKilled},
    {SkillPhase::kEnded, "kill", SkillPhase::kKilled},
    {SkillPhase::kKilled, "kill", SkillPhase::kKilled},
    {SkillPhase::kKilled, "restart", SkillPhase::kIdle},
    // Charts that live on answer in any phase, and may end in each.
    {SkillPhase::kIdle, "tick", SkillPhase::kResting},
    {SkillPhase::kRunning, "tick", SkillPhase::kResting},
    {SkillPhase::kRunning, "tick", SkillPhase::kOwing},
    {SkillPhase::kOwing, "tick", SkillPhase::kResting},
    {SkillPhase::kOwing, "tick", SkillPhase::kRunning},
    {SkillPhase::kEnded, "tick", SkillPhase::kResting},
    {SkillPhase::kEnded, "tick", SkillPhase::kOwing},
    {SkillPhase::kResting, "tick", SkillPhase::kResting},
    {SkillPhase::kResting, "tick", SkillPhase::kRunning},
    {SkillPhase::kResting, "tick", SkillPhase::kOwing},
    {SkillPhase::kResting, "tick", SkillPhase::kIdle},
    {SkillPhase::kReady, "tick", SkillPhase::kResting},
    {SkillPhase::kReady, "tick", SkillPhase::kRunning},
    {SkillPhase::kReady, "tick", SkillPhase::kOwing},
    {SkillPhase::kReady, "tick", SkillPhase::kIdle},
    {SkillPhase::kRunning, "outcome", SkillPhase::kReady},
    {SkillPhase::kOwing, "outcome", SkillPhase::kResting},
    {SkillPhase::kOwing, "outcome", SkillPhase::kRunning},
    {SkillPhase::kHalting, "outcome", SkillPhase::kResting},
    {SkillPhase::kResting, "outcome", SkillPhase::kResting},
    {SkillPhase::kResting, "outcome", SkillPhase::kIdle},
    {SkillPhase::kReady, "outcome", SkillPhase::kReady},
    {SkillPhase::kReady, "outcome", SkillPhase::kEnded},
    {SkillPhase::kRunning, "timer", SkillPhase::kReady},
    {SkillPhase::kOwing, "timer", SkillPhase::kResting},
    {SkillPhase::kOwing, "timer", SkillPhase::kRunning},
    {SkillPhase::kHalting, "timer", SkillPhase::kResting},
    {SkillPhase::kResting, "timer", SkillPhase::kResting},
    {SkillPhase::kResting, "timer", SkillPhase::kIdle},
    {SkillPhase::kReady, "timer", SkillPhase::kReady},
    {SkillPhase::kReady, "timer", SkillPhase::kEnded},
    {SkillPhase::kRunning, "halt", SkillPhase::kResting},
    {SkillPhase::kOwing, "halt", SkillPhase::kResting},
    {SkillPhase::kHalting, "halt", SkillPhase::kResting},
    {SkillPhase::kResting, "halt", SkillPhase::kResting},
    {SkillPhase::kReady, "halt", SkillPhase::kHalting},
    {SkillPhase::kReady, "halt", SkillPhase::kResting},
    {SkillPhase::kReady, "halt", SkillPhase::kIdle},
    {SkillPhase::kResting, "cancel", SkillPhase::kResting},
    {SkillPhase::kReady, "cancel", SkillPhase::kIdle},
    {SkillPhase::kResting, "kill", SkillPhase::kKilled},
    {SkillPhase::kReady, "kill", SkillPhase::kKilled},
    // So do topics, which also begin a chart that lives on.
    {SkillPhase::kIdle, "topic", SkillPhase::kResting},
    {SkillPhase::kRunning, "topic", SkillPhase::kRunning},
    {SkillPhase::kRunning, "topic", SkillPhase::kEnded},
    {SkillPhase::kRunning, "topic", SkillPhase::kReady},
    {SkillPhase::kOwing, "topic", SkillPhase::kOwing},
    {SkillPhase::kOwing, "topic", SkillPhase::kIdle},
    {SkillPhase::kOwing, "topic", SkillPhase::kResting},
    {SkillPhase::kOwing, "topic", SkillPhase::kRunning},
    {SkillPhase::kHalting, "topic", SkillPhase::kHalting},
    {SkillPhase::kHalting, "topic", SkillPhase::kIdle},
    {SkillPhase::kHalting, "topic", SkillPhase::kResting},
    {SkillPhase::kResting, "topic", SkillPhase::kResting},
    {SkillPhase::kResting, "topic", SkillPhase::kIdle},
    {SkillPhase::kReady, "topic", SkillPhase::kReady},
    {SkillPhase::kReady, "topic", SkillPhase::kEnded},
};

struct SkillDeliveryKind {
  std::string_view operator()(const TickSkill&) const { return "tick"; }
  std::string_view operator()(const HaltSkill&) const { return "halt"; }
  std::string_view operator()(const CancelSkill&) const { return "cancel"; }
  std::string_view operator()(const KillSkill&) const { return "kill"; }
  std::string_view operator()(const RestartSkill&) const { return "restart"; }
  std::string_view operator()(const SkillTimer&) const { return "timer"; }
  std::string_view operator()(const Outcome&) const { return "outcome"; }
  std::string_view operator()(const Finish&) const { return "outcome"; }
  std::string_view operator()(const Admitted&) const { return ""; }
  std::string_view operator()(const Send&) const { return ""; }
  std::string_view operator()(const Published&) const { return "topic"; }
};

SkillState::Line& line_of(SkillState& state, const std::string& service) {
  for (SkillState::Line& line : state.lines) {
    if (line.service == service) return line;
  }
  state.lines.push_back({service, {}, {}});
  return state.lines.back();
}

}  // namespace

std::string_view to_string(SkillPhase phase) {
  constexpr std::array<std::string_view, 8> kNames{"idle",  "running", "owing", "halting",
                                                   "ended", "resting", "ready", "killed"};
  return kNames[static_cast<std::size_t>(phase)];
}

std::span<const SkillEdge> skill_edges() { return kSkillEdges; }

std::string_view kind_of(const SkillDelivery& delivery) { return std::visit(SkillDeliveryKind(), delivery); }

SkillModel skill_model(const project::Plan& plan, std::size_t leaf) {
  const project::LeafPlan& of = plan.leaves[leaf];
  return {.name = of.name,
          .condition = of.condition,
          .halt_deadline = plan.scenario.project.deadlines.halt,
          .call_deadline = plan.scenario.project.deadlines.call,
          .seed = hash_combine(plan.scenario.seed, hash_bytes(of.name)),
          .chart = *of.chart,
          .services = &plan.services,
          .constants = project::initial_data(of.constants),
          .protocol = of.protocol,
          .latest_topics = of.latest};
}

SkillMachine::SkillMachine(SkillModel model, scxml::ExecutionWatch* watch) : model_(std::move(model)) {
  host_.processors.push_back({"thrift", ""});
  host_.on_send = [this](const scxml::OutgoingSend& send) { return check_call(send, *model_.services); };
  host_.watch = watch;
  host_.observer = &observer_;
  if (!model_.protocol) return;
  meaning_of_state_.resize(model_.chart.states().size());
  for (const auto& [id, status] : model_.protocol->states) {
    if (const auto state = model_.chart.find(id)) meaning_of_state_[*state] = status;
  }
  halted_state_ = model_.chart.find(model_.protocol->halted);
}

SkillMachine::Called& SkillMachine::called(const Call& call) {
  for (Called& known : called_) {
    if (known.service == call.service && known.method->name == call.method) return known;
  }
  const std::string name = fmt::format("{}.{}", call.service, call.method);
  return called_.emplace_back(Called{call.service, model_.services->at(call.service).service->find(call.method), name,
                                     ObservationName(name + ".request"), ObservationName(name + ".reply")});
}

void SkillMachine::Observer::event(const scxml::Chart& chart, std::string_view, const scxml::Event& event) {
  if (!(chart == machine.model_.chart)) return;
  const Value* const message = event.data ? event.data->find("message") : nullptr;
  const std::string said = message != nullptr ? std::string(message->text()) : std::string();
  if (machine.memory_) machine.memory_->saw({std::nullopt, event.name, said});
  if (machine.model_.protocol) machine.hear(event);
  machine.got(event.name, said);
}

void SkillMachine::got(const std::string& event, const std::string& message) {
  stepped_->latest.event = event;
  if (event.ends_with(".reply")) stepped_->trouble.clear();
  if (!scxml::event_matches("error", event) && !event.ends_with(".error")) return;
  stepped_->trouble = event;
  if (!message.empty()) stepped_->trouble += ": " + message;
}

void SkillMachine::Observer::transition(const scxml::Chart& chart, std::string_view, scxml::TransitionIndex taken) {
  if (!(chart == machine.model_.chart)) return;
  if (machine.memory_) machine.memory_->saw({taken, {}, {}});
  machine.took(taken);
}

void SkillMachine::took(scxml::TransitionIndex taken) {
  surroundings_->taken(taken);
  stepped_->latest.transition = taken;
  ++stepped_->latest.transitions;
}

void SkillMachine::Observer::entered(const scxml::Chart& chart, std::string_view, scxml::StateIndex state) {
  if (!(chart == machine.model_.chart)) return;
  machine.surroundings_->entered(state);
  if (machine.meaning_of_state_.empty()) return;
  if (machine.meaning_of_state_[state]) machine.said_.push_back({machine.meaning_of_state_[state], {}});
  if (machine.halted_state_ == state) machine.said_.push_back({});
}

// The answers of a protocol are events that the chart sends to itself, whether or not it has a transition for them.
void SkillMachine::hear(const scxml::Event& event) {
  const project::SkillProtocol& protocol = *model_.protocol;
  if (event.name.empty()) return;
  if (event.name == protocol.halted && !halted_state_) said_.push_back({});
  if (event.name != protocol.answer) return;
  Value status = event.data.value_or(Value());
  Map outputs;
  if (!protocol.param.empty()) {
    if (Map* params = status.as_map()) outputs = std::move(*params);
    const Value* param = outputs.find(protocol.param);
    status = param != nullptr ? *param : Value();
    outputs.erase(protocol.param);
  }
  const std::optional<bt::Status> means = protocol.meaning(status);
  if (!means)
    unclear_.push_back(
        fmt::format("{} answers a tick with {}, which is none of the protocol's values, and counts as FAILURE",
                    event.name, to_json(status)));
  said_.push_back({means.value_or(bt::Status::kFailure), std::move(outputs)});
}

/// One delivery to one skill.
class SkillMachine::Step {
 public:
  Step(SkillMachine& machine, SkillState& state, SkillHost& host)
      : machine_(machine),
        model_(machine.model_),
        state_(state),
        host_(host),
        lives_(state.running()),
        alive_(state.running() && state.phase != SkillPhase::kResting && state.phase != SkillPhase::kReady),
        owing_(state.phase == SkillPhase::kOwing),
        halting_(state.phase == SkillPhase::kHalting),
        ended_(state.phase == SkillPhase::kEnded || state.phase == SkillPhase::kReady) {
    machine_.stepped_ = &state;
    machine_.surroundings_ = &host;
  }

  bool operator()(TickSkill&& tick) {
    state_.tick = tick.tick;
    state_.answered = 0;
    if (halting_) {
      // No ticks are delivered while a halt goes on.
      answer(bt::Status::kRunning, {});
      return true;
    }
    owing_ = true;
    if (model_.protocol) return ask(std::move(tick));
    if (tick.started && !alive_) start(tick.inputs);
    if (alive_) {
      scxml::Event event;
      event.name = "tick";
      event.data = Value(std::move(tick.inputs));
      step(event);
    }
    return settle();
  }

  bool operator()(const HaltSkill&) {
    owing_ = false;
    const bool has_run = alive_ || ended_;
    ended_ = false;
    halting_ = true;
    if (model_.protocol) {
      if (lives_ && has_run) halt_with_protocol(!alive_);
    } else if (alive_) {
      scxml::Event event;
      event.name = "halt";
      const bool enabled = step(event);
      if (alive_ && !enabled) cancel();
      if (alive_) state_.halt_due = add_saturating(host_.now(), model_.halt_deadline);
    }
    return settle();
  }

  bool operator()(const CancelSkill&) {
    owing_ = false;
    // Between its runs a chart that lives on has nothing to give up.
    if (alive_ || (lives_ && ended_)) cancel();
    ended_ = false;
    const bool told = settle();
    abandon_goals();
    return told;
  }

  bool operator()(const KillSkill&) {
    give_up(state_, kKilled, host_);
    state_.phase = SkillPhase::kKilled;
    return true;
  }

  bool operator()(const RestartSkill&) {
    if (state_.phase == SkillPhase::kKilled) state_.phase = SkillPhase::kIdle;
    return true;
  }

  bool operator()(const SkillTimer& timer) {
    if (state_.wake != timer.when) return false;
    state_.wake = kNever;
    if (!lives_) return false;
    if (state_.session.next_timer() <= host_.now()) {
      execute(StepMemory::kTimers,
              {.kind = scxml::StepOrder::Kind::kTimers, .now = host_.now(), .event = {}, .options = {}});
      follow();
    }
    if (alive_ && state_.halt_due && *state_.halt_due <= host_.now()) {
      host_.problem(fmt::format("{} did not end within its halt deadline of {} ms and was cancelled", model_.name,
                                model_.halt_deadline.count() / 1'000'000));
      cancel();
    }
    return settle();
  }

  bool operator()(const Admitted& decided) {
    line_of(state_, decided.call->service).waiting.pop_front();
    admitted(decided.call, decided.admission);
    admit(decided.call->service);
    return false;
  }

  bool operator()(const Send& send) {
    host_.send(send.call, *machine_.called(*send.call).method);
    return false;
  }

  bool operator()(const Published& published) {
    if (!state_.goals.empty()) note_result(*published.what);
    const bool begins = !lives_ && model_.protocol && state_.phase == SkillPhase::kIdle && state_.run == 0;
    if (begins) start({}, false);
    remember(published.what);
    if (!lives_) return begins;
    hear(*published.what);
    return settle();
  }

  bool operator()(Outcome&& answered) {
    // What nobody answers has left, and that is all.
    const Called& called = machine_.called(*answered.call);
    if (answered.outcome.ok && called.method->oneway) return false;
    const std::string& name = called.name;
    const bool is_served = answered.outcome.ok || answered.outcome.kind == "exception";
    if (is_served && host_.fails(Failing::kLate, name)) {
      CallOutcome late{.ok = false, .result = {}, .kind = "late", .message = "a fault: the answer comes too late"};
      host_.deliver_at(add_saturating(host_.now(), model_.call_deadline), Rank::kMessage,
                       Finish{answered.call, std::move(late), {}});
      return false;
    }
    if (answered.outcome.ok) host_.falsify(name, *called.method, answered.outcome.result);
    const Duration delay = host_.delay_of(called.reply.text);
    if (delay == Duration(0)) return (*this)(Finish{answered.call, std::move(answered.outcome), {}});
    host_.deliver_at(add_saturating(host_.now(), delay), Rank::kMessage,
                     Finish{answered.call, std::move(answered.outcome), {}});
    return false;
  }

  bool operator()(Finish&& finish) {
    const Call& call = *finish.call;
    CallOutcome& outcome = finish.outcome;
    const bool current = state_.is_current(call.run);
    // Nobody's but the run's own, which nobody waits for.
    const bool is_own = call.run == 0;
    if (!state_.goals.empty() && call.method == kSendGoal) note_accepted(call, outcome);
    Map data;
    data.append("args", call.args);
    if (outcome.ok) {
      data.append("result", std::move(outcome.result));
    } else {
      data.append("kind", outcome.kind);
      data.append("message", std::move(outcome.message));
      if (!finish.vetoed_by.empty()) data.append("vetoed_by", std::move(finish.vetoed_by));
    }
    Called& called = machine_.called(call);
    if (current && outcome.ok && !host_.is_heard(called.reply)) {
      host_.pass();
      return finish_with(call, called.reply.text, scxml::EventType::kExternal, std::move(data));
    }
    Message message;
    message.kind = outcome.ok && (current || is_own) ? MessageKind::kReply : MessageKind::kError;
    message.source = model_.name;
    message.target = call.service;
    message.name = !current && !is_own ? called.name + ".late"
                   : outcome.ok        ? called.reply.text
                                       : called.name + ".error";
    message.call = call.id;
    if (!current) {
      message.data = std::move(data);
      host_.publish(std::move(message));
      return false;
    }
    message.data = data;
    const bool undelivered = outcome.kind == "unreachable" || outcome.kind == "late" || outcome.kind == "protocol" ||
                             outcome.kind == "interrupted";
    // SCXML 6.2.5: what prevents delivery is an error event of the platform.
    const bool platform = !outcome.ok && undelivered;
    const std::string event = platform ? "error.communication" : message.name;
    host_.publish(std::move(message));
    return finish_with(call, event, platform ? scxml::EventType::kPlatform : scxml::EventType::kExternal,
                       std::move(data));
  }

 private:
  bool finish_with(const Call& call, const std::string& name, scxml::EventType type, Map data) {
    scxml::Event event;
    event.name = name;
    event.type = type;
    event.sendid = call.sendid;
    event.origintype = "thrift";
    event.data = idl::for_script(std::move(data));
    step(event);
    return settle();
  }

  // Beside a call that the chart makes itself.
  void note_sent(const Call& call, const idl::Service& service) {
    if (!is_action(service)) return;
    if (call.method == kSendGoal) {
      if (state_.goals.size() >= kGoalsMax) state_.goals.erase(state_.goals.begin());
      state_.goals.push_back({.service = call.service, .id = {}});
      return;
    }
    const Value* const id = call.args.find("goal_id");
    const bool is_all = id == nullptr || id->text().empty();
    std::erase_if(state_.goals, [&](const SkillState::Goal& goal) {
      return goal.service == call.service && !goal.id.empty() && (is_all || goal.id == id->text());
    });
  }

  // Calls to one service are answered in their order.
  void note_accepted(const Call& call, const CallOutcome& outcome) {
    const auto goal = std::find_if(state_.goals.begin(), state_.goals.end(), [&](const SkillState::Goal& each) {
      return each.service == call.service && each.id.empty();
    });
    if (goal == state_.goals.end()) return;
    const Value* const accepted = outcome.result.find("accepted");
    const Value* const id = outcome.result.find("goal_id");
    if (!outcome.ok || accepted == nullptr || *accepted != Value(true) || id == nullptr || id->text().empty()) {
      state_.goals.erase(goal);
      return;
    }
    goal->id = id->text();
    if (goal->abandoned) abandon_goals();
  }

  void note_result(const Publication& what) {
    const Value* const id = what.args.find("goal_id");
    if (id == nullptr || !what.topic.ends_with(".result")) return;
    const std::string_view service = std::string_view(what.topic).substr(0, what.topic.rfind('.'));
    std::erase_if(state_.goals,
                  [&](const SkillState::Goal& goal) { return goal.service == service && goal.id == id->text(); });
  }

  // Goals of a run that was halted and has not cancelled them itself.
  void abandon_goals() {
    std::vector<SkillState::Goal> left;
    for (SkillState::Goal& goal : std::exchange(state_.goals, {})) {
      goal.abandoned = true;
      if (goal.id.empty()) {
        left.push_back(std::move(goal));
        continue;
      }
      make({.run = 0,
            .id = host_.next_call(),
            .service = goal.service,
            .method = "cancel_goal",
            .args = Value(Map{{"goal_id", goal.id}}),
            .sendid = {}});
    }
    state_.goals = std::move(left);
  }

  // What a run that ended by itself has left is its chart's business.
  void forget_goals() {
    if (!state_.goals.empty()) std::erase_if(state_.goals, [](const auto& goal) { return !goal.abandoned; });
  }

  // A tick for a chart that lives on.
  bool ask(TickSkill&& tick) {
    const project::SkillProtocol& protocol = *model_.protocol;
    // What it has said since the last tick answers this one.
    if (ended_ && !tick.started) return settle();
    const bool begins = !alive_;
    ended_ = false;
    if (lives_) {
      alive_ = true;
    } else {
      start(tick.inputs);
    }
    const auto inputs = [&](const std::string& name) {
      scxml::Event event;
      event.name = name;
      event.data = Value(tick.inputs);
      return event;
    };
    if (lives_ && begins && !protocol.start.empty()) step(inputs(protocol.start));
    // At most one tick that it has not answered; one that it does not take is none.
    if (alive_ && !state_.asked && !protocol.tick.empty()) {
      state_.asked = !protocol.answer.empty();
      if (!step(inputs(protocol.tick))) state_.asked = false;
    }
    if (alive_) look_at_states();
    return settle();
  }

  // The innermost of the active states that mean something; of parallel ones, the last in the document.
  void look_at_states() {
    std::optional<bt::Status> means;
    for (scxml::StateIndex state = 0; state < machine_.meaning_of_state_.size(); ++state) {
      if (machine_.meaning_of_state_[state] && state_.session.is_active(state))
        means = machine_.meaning_of_state_[state];
    }
    if (means) take_answer(*means, {});
  }

  // @param has_ended  And nobody has been told.
  void halt_with_protocol(bool has_ended) {
    const project::SkillProtocol& protocol = *model_.protocol;
    if (protocol.halt.empty()) {
      // What it would still answer would be taken for the answer to a later tick.
      if (state_.asked) cancel();
      alive_ = false;
      if (lives_ && has_ended && !protocol.acknowledge.empty()) tell(protocol.acknowledge);
      return;
    }
    alive_ = true;
    const bool enabled = tell(protocol.halt);
    if (!alive_) return;
    if (!enabled)
      cancel();
    else if (protocol.halted.empty() || (machine_.halted_state_ && state_.session.is_active(*machine_.halted_state_)))
      end_halt();
    else
      state_.halt_due = add_saturating(host_.now(), model_.halt_deadline);
  }

  void end_halt() {
    alive_ = false;
    state_.asked = false;
    state_.halt_due.reset();
  }

  void take_answer(bt::Status status, Map outputs) {
    state_.asked = false;
    if (!alive_ || halting_) return;  // nobody has asked, or does any more
    says_running_ = status == bt::Status::kRunning;
    if (says_running_) return;
    alive_ = false;
    ended_ = true;
    state_.ended = status;
    state_.outputs = std::move(outputs);
    give_reason();
  }

  // A chart that does not say why it failed may have been told.
  void give_reason() {
    std::string trouble = std::exchange(state_.trouble, {});
    if (state_.ended != bt::Status::kFailure || trouble.empty() || state_.outputs.find("reason") != nullptr) return;
    state_.outputs["reason"] = std::move(trouble);
  }

  // @param asked  By a tick.
  void start(const Map& inputs, bool asked = true) {
    const scxml::Chart& chart = model_.chart;
    state_.run = host_.run_number(state_.run + 1);
    lives_ = true;
    alive_ = asked;
    ended_ = false;
    state_.asked = false;
    state_.halt_due.reset();
    state_.outputs = Map();
    state_.trouble.clear();
    forget_goals();
    scxml::StartOptions options;
    options.data = model_.constants;
    for (const auto& [port, value] : inputs) {
      const bool is_data = std::any_of(chart.data().begin(), chart.data().end(),
                                       [&, name = std::string_view(port)](const auto& d) { return d.id == name; });
      if (is_data) options.data[port] = value;
    }
    options.session_id = fmt::format("{}.{}", model_.name, state_.run);
    options.seed = hash_combine(model_.seed, state_.run);
    const std::string what = machine_.memory_ ? "start\n" + to_json(Value(options.data)) : std::string();
    execute(what,
            {.kind = scxml::StepOrder::Kind::kStart, .now = host_.now(), .event = {}, .options = std::move(options)});
    // Where it begins is no answer: it has not been asked.
    machine_.said_.clear();
    follow();
    for (const Shared<Publication>& heard : state_.heard) {
      if (lives_) hear(*heard, !model_.protocol);
    }
  }

  // @param answers  As of `step`.
  void hear(const Publication& published, bool answers = true) {
    scxml::Event event;
    event.name = published.topic;
    event.origintype = "thrift";
    event.data = idl::for_script(published.args);
    step(event, answers);
  }

  // For the runs that begin later.
  void remember(const Shared<Publication>& what) {
    const auto& topics = model_.latest_topics;
    if (std::find(topics.begin(), topics.end(), what->topic) == topics.end()) return;
    const auto at =
        std::lower_bound(state_.heard.begin(), state_.heard.end(), what->topic,
                         [](const Shared<Publication>& each, const std::string& topic) { return each->topic < topic; });
    if (at != state_.heard.end() && (*at)->topic == what->topic)
      *at = what;
    else
      state_.heard.insert(at, what);
  }

  // Whether the chart took it. @param answers  Whether what it does then may answer a tick.
  bool step(const scxml::Event& event, bool answers = true) {
    const bool enabled =
        execute(machine_.memory_ ? StepMemory::name_of(event) : std::string(),
                {.kind = scxml::StepOrder::Kind::kEvent, .now = host_.now(), .event = event, .options = {}});
    if (!answers) machine_.said_.clear();
    follow();
    return enabled;
  }

  // @param what  Tells steps apart; only with a memory.
  bool execute(std::string_view what, const scxml::StepOrder& order) {
    if (machine_.elsewhere_ != nullptr) {
      if (const auto enabled = execute_elsewhere(order)) return *enabled;
    }
    const auto run = [&] {
      return scxml::execute(model_.chart, state_.session, order, machine_.effects_, machine_.host_);
    };
    if (!machine_.memory_ || order.kind == scxml::StepOrder::Kind::kCancel) return run();
    return machine_.memory_->step(
        what, order.kind == scxml::StepOrder::Kind::kStart, state_.session, host_.now(), machine_.effects_,
        [](const Choice&) -> std::uint64_t { return 0; },
        [this](const StepMemory::Seen& seen) {
          if (seen.transition)
            machine_.took(*seen.transition);
          else
            machine_.got(seen.event, seen.message);
        },
        run);
  }

  // Nothing: it is to be done here.
  std::optional<bool> execute_elsewhere(const scxml::StepOrder& order) {
    const auto told = machine_.elsewhere_->execute(state_.session, order);
    if (!told && told.error() == ChartElsewhere::Away::kHere) return std::nullopt;
    if (!told) {
      lost_ = "its process does not execute it";
      return false;
    }
    const auto enabled = scxml::take_step(model_.chart, *told, state_.session, machine_.effects_, &machine_.observer_);
    if (!enabled) {
      lost_ = "its process executes something else: " + enabled.error().message;
      return false;
    }
    machine_.elsewhere_->took(state_.session);
    for (const scxml::Effect& effect : machine_.effects_) {
      const auto* send = std::get_if<scxml::OutgoingSend>(&effect);
      const auto sent = send != nullptr ? check_call(*send, *model_.services) : Result<void>();
      if (sent) continue;
      lost_ = "its process executes something else: " + sent.error().message;
      machine_.effects_.clear();
      return false;
    }
    return *enabled;
  }

  void cancel() {
    execute("cancel", {.kind = scxml::StepOrder::Kind::kCancel, .now = host_.now(), .event = {}, .options = {}});
    follow();
  }

  void follow() {
    for (std::string& what : std::exchange(machine_.unclear_, {}))
      host_.problem(fmt::format("{}: {}", model_.name, what));
    for (Said& said : std::exchange(machine_.said_, {})) {
      if (said.status)
        take_answer(*said.status, std::move(said.outputs));
      else if (halting_)
        end_halt();
    }
    for (scxml::Effect& effect : machine_.effects_) {
      if (auto* send = std::get_if<scxml::OutgoingSend>(&effect)) {
        if (send->type == "thrift") {
          call(*send);
        } else {
          host_.problem(fmt::format("{}: nobody receives <send> of type \"{}\" to \"{}\"", to_string(send->span),
                                    send->type, send->target));
        }
      } else if (const auto* line = std::get_if<scxml::LogLine>(&effect)) {
        host_.log(*line);
      } else if (auto* done = std::get_if<scxml::Done>(&effect)) {
        end_chart(done->final_id, std::move(done->donedata));
      }
    }
    machine_.effects_.clear();
    if (lives_ && lost_) {
      host_.problem(fmt::format("{} was given up: {}", model_.name, *lost_));
      end_chart("failure", Value(Map{{"reason", *lost_}}));
    }
    if (lives_ && state_.session.status() == scxml::SessionStatus::kFailed) {
      const auto& failure = state_.session.failure();
      host_.problem(
          fmt::format("{} was given up: {}", model_.name, failure ? to_string(*failure) : "its chart failed"));
      end_chart("failure", Value(Map{{"reason", failure ? failure->message : ""}}));
    }
  }

  void end_chart(const std::string& final_id, std::optional<Value> donedata) {
    lives_ = false;
    state_.asked = false;
    state_.halt_due.reset();
    if (!std::exchange(alive_, false)) return;  // it has answered before
    ended_ = true;
    // A run that says `halted` without having been asked to has not done its work.
    state_.ended = final_id == "success" ? bt::Status::kSuccess : bt::Status::kFailure;
    Map* outputs = donedata ? donedata->as_map() : nullptr;
    state_.outputs = outputs != nullptr ? std::move(*outputs) : Map();
    give_reason();
  }

  // The phase that follows, and the answers that come with it. An action's tick is answered after the macrostep that it
  // caused.
  bool settle() {
    SkillPhase next = SkillPhase::kIdle;
    if (alive_ && halting_) {
      next = SkillPhase::kHalting;
    } else if (alive_ && owing_ && model_.condition && !says_running_) {
      next = SkillPhase::kOwing;
    } else if (alive_) {
      next = SkillPhase::kRunning;
    } else if (ended_ && !halting_ && !owing_) {
      next = lives_ ? SkillPhase::kReady : SkillPhase::kEnded;
    } else if (lives_) {
      next = SkillPhase::kResting;
    }
    state_.phase = next;
    if (!alive_ && halting_) {
      if (!state_.goals.empty()) abandon_goals();
      host_.halted();
    } else if (!alive_ && owing_) {
      forget_goals();
      // One that was cancelled has nothing to tell but failure.
      if (ended_)
        answer(state_.ended, std::exchange(state_.outputs, Map()));
      else
        answer(bt::Status::kFailure, {});
      if (lives_ && !model_.protocol->acknowledge.empty()) tell(model_.protocol->acknowledge);
      if (!lives_) state_.phase = SkillPhase::kIdle;
    } else if (owing_ && next == SkillPhase::kRunning) {
      answer(bt::Status::kRunning, {});
    }
    schedule();
    return true;
  }

  // True: the chart takes the event.
  bool tell(const std::string& name) {
    scxml::Event event;
    event.name = name;
    return step(event);
  }

  void answer(bt::Status status, Map outputs) {
    state_.answered = state_.tick;
    host_.answer(state_.tick, status, std::move(outputs));
  }

  void schedule() {
    TimePoint next = lives_ ? state_.session.next_timer() : kNever;
    if (state_.halt_due) next = std::min(next, *state_.halt_due);
    if (next == kNever || next == state_.wake) return;
    state_.wake = next;
    host_.deliver_at(next, Rank::kTimer, SkillTimer{next});
  }

  void call(scxml::OutgoingSend& send) {
    // `check_call` has passed: the chart's <send> would have failed otherwise.
    const idl::Service& service = *model_.services->at(send.target).service;
    const idl::Method& method = *service.find(send.event);
    Call call{.run = state_.run,
              .id = host_.next_call(),
              .service = std::move(send.target),
              .method = method.name,
              .args = send.data ? std::move(*send.data) : Value(Map()),
              .sendid = std::move(send.sendid)};
    if (!idl::conforms_arguments(method, call.args)) call.args = *idl::conform_arguments(method, std::move(call.args));
    if (call.method == kSendGoal || call.method == "cancel_goal") note_sent(call, service);
    make(std::move(call));
  }

  void make(Call call) {
    const Shared<Call> shared(std::move(call));
    SkillState::Line& line = line_of(state_, shared->service);
    if (line.waiting.size() >= kGatedCallsMax) {
      const std::string why = fmt::format("{} calls are waiting for a gate already", kGatedCallsMax);
      host_.deliver(Finish{shared, {.ok = false, .result = {}, .kind = "unreachable", .message = why}, {}});
      return;
    }
    line.waiting.push_back(shared);
    if (line.waiting.size() == 1) admit(shared->service);
  }

  // Asks for the calls to one service, one after the other, until a decision has to be waited for.
  void admit(const std::string& service) {
    for (;;) {
      SkillState::Line& line = line_of(state_, service);
      if (line.waiting.empty()) return;
      const Shared<Call> call = line.waiting.front();
      Called& called = machine_.called(*call);
      if (!host_.is_heard(called.request)) {
        host_.pass();
        line.waiting.pop_front();
        admitted(call, {});
        continue;
      }
      Message request;
      request.kind = MessageKind::kRequest;
      request.source = model_.name;
      request.target = call->service;
      request.name = called.request.text;
      request.call = call->id;
      Map data;
      data.append("args", call->args);
      request.data = std::move(data);
      const auto admission = host_.request(std::move(request), call);
      if (!admission) return;
      line.waiting.pop_front();
      admitted(call, *admission);
    }
  }

  void admitted(const Shared<Call>& call, const Admission& admission) {
    if (admission.veto) {
      const std::string by = admission.veto->by.empty() ? "" : " by " + admission.veto->by;
      host_.deliver(Finish{call,
                           {.ok = false,
                            .result = {},
                            .kind = "vetoed",
                            .message = fmt::format("vetoed{}: {}", by, admission.veto->reason)},
                           admission.veto->by});
      return;
    }
    const Called& called = machine_.called(*call);
    if (!called.method->oneway && host_.fails(Failing::kUnreachable, called.name)) {
      host_.deliver(Finish{
          call, {.ok = false, .result = {}, .kind = "unreachable", .message = "a fault: nobody can be reached"}, {}});
      return;
    }
    const TimePoint now = host_.now();
    TimePoint& not_before = line_of(state_, call->service).not_before;
    not_before = std::max(not_before, now + host_.delay_of(called.name));
    if (not_before > now) {
      host_.deliver_at(not_before, Rank::kMessage, Send{call});
    } else {
      not_before = TimePoint{};
      host_.send(call, *called.method);
    }
  }

  SkillMachine& machine_;
  const SkillModel& model_;
  SkillState& state_;
  SkillHost& host_;
  bool lives_;                       // the chart lives; without a protocol the same as:
  bool alive_;                       // a run goes on
  bool owing_;                       // a tick waits for its answer
  bool halting_;                     // a halt waits for the end of the run
  std::optional<std::string> lost_;  // why its chart is executed no more
  bool ended_;                       // a run has ended and its status has not been told
  bool says_running_ = false;        // the chart has answered so, in this delivery
};

bool SkillMachine::step(SkillState& state, SkillDelivery delivery, SkillHost& host) {
  const SkillPhase before = state.phase;
  const std::string_view by = kind_of(delivery);
  if (before == SkillPhase::kKilled && (by == "tick" || by == "halt" || by == "cancel")) {
    refuse(state, delivery, kKilled, host);
    return by != "cancel";
  }
  const bool told = std::visit([step = Step(*this, state, host)](auto&& what) mutable { return step(std::move(what)); },
                               std::move(delivery));
  const SkillEdge taken{before, by, state.phase};
  // Outcomes, timers and topics that find no living chart, and a restart of what lives, change nothing.
  SENTREE_ASSERT(
      (before == state.phase && (by.empty() || by == "outcome" || by == "timer" || by == "topic" || by == "restart")) ||
      std::find(std::begin(kSkillEdges), std::end(kSkillEdges), taken) != std::end(kSkillEdges));
  return told;
}

void SkillMachine::refuse(SkillState& state, const SkillDelivery& delivery, const std::string& why, SkillHost& host) {
  if (const auto* tick = std::get_if<TickSkill>(&delivery)) {
    state.tick = state.answered = tick->tick;
    host.answer(tick->tick, bt::Status::kFailure, Map{{"reason", why}});
  } else if (std::holds_alternative<HaltSkill>(delivery)) {
    host.halted();
  }
}

void SkillMachine::give_up(SkillState& state, const std::string& why, SkillHost& host) {
  if (state.answered != state.tick) {
    state.answered = state.tick;
    host.answer(state.tick, bt::Status::kFailure, Map{{"reason", why}});
  }
  if (state.phase == SkillPhase::kHalting) host.halted();
  state.phase = SkillPhase::kIdle;
  state.halt_due.reset();
  state.outputs = Map();
}

bool is_action(const idl::Service& service) { return service.name.find("/action/") != std::string::npos; }

Result<void> check_call(const scxml::OutgoingSend& send, const std::map<std::string, project::ServicePlan>& services) {
  if (send.type != "thrift") return {};
  const auto service = services.find(send.target);
  if (service == services.end()) {
    std::vector<std::string> names;
    for (const auto& [name, plan] : services) names.push_back(name);
    return fail("run.unknown-service",
                fmt::format("service \"{}\" is not in sentree.yaml{}", send.target, did_you_mean(send.target, names)),
                send.span);
  }
  if (!service->second.observed.empty())
    return fail("run.observed", fmt::format("\"{}\" is observed and cannot be called", send.target), send.span);
  const auto method = idl::find_method(*service->second.service, send.event, send.target, send.span);
  if (!method) return tl::unexpected(method.error());
  if (send.data && idl::conforms_arguments(**method, *send.data)) return {};
  auto args = idl::conform_arguments(**method, send.data.value_or(Value(Map())));
  if (!args) return tl::unexpected(args.error());
  return {};
}

Result<Value> save(const SkillModel& model, const SkillState& state) {
  Map saved{{"run", static_cast<std::int64_t>(state.run)},
            {"running", state.running()},
            {"answer_owed", state.phase == SkillPhase::kOwing},
            {"halting", state.phase == SkillPhase::kHalting}};
  if (state.halt_due) saved["halt_due_ns"] = state.halt_due->time_since_epoch().count();
  if (state.asked) saved["asked"] = true;
  if (state.phase == SkillPhase::kEnded || state.phase == SkillPhase::kReady)
    saved["ended"] = bt::to_string(state.ended);
  if (!state.outputs.empty()) saved["outputs"] = state.outputs;
  if (!state.trouble.empty()) saved["trouble"] = state.trouble;
  if (state.run > 0) {
    auto session = scxml::save(model.chart, state.session);
    if (!session) return tl::unexpected(session.error());
    saved["session"] = std::move(*session);
  }
  return Value(std::move(saved));
}

}  // namespace sentree::mission
