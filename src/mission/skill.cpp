#include "sentree/mission/skill.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/base/rng.h"
#include "sentree/mission/detail/skill_step.h"
#include "sentree/scxml/event.h"

namespace sentree::mission {

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

// SCXML drops the event, and the chart goes on as if nothing had happened.
void SkillMachine::Observer::unhandled(const scxml::Chart&, std::string_view, const Diagnostic& why) {
  machine.surroundings_->problem(fmt::format("skill {}: {}; no transition of the chart takes the error, and it goes on",
                                             machine.model_.name, to_string(why)));
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

bool SkillMachine::step(SkillState& state, SkillDelivery&& delivery, SkillHost& host) {
  const SkillPhase before = state.phase;
  const std::string_view by = kind_of(delivery);
  if (before == SkillPhase::kKilled && (by == "tick" || by == "halt" || by == "cancel")) {
    refuse(state, delivery, kKilled, host);
    return by != "cancel";
  }
  const bool told = std::visit(
      [step = Step(*this, state, host)]<class What>(What&& what) mutable { return step(std::forward<What>(what)); },
      std::move(delivery));
  const SkillEdge taken{before, by, state.phase};
  // Outcomes, timers and topics that find no living chart, and a restart of what lives, change nothing.
  const auto edges = skill_edges();
  SENTREE_ASSERT(
      (before == state.phase && (by.empty() || by == "outcome" || by == "timer" || by == "topic" || by == "restart")) ||
      std::find(edges.begin(), edges.end(), taken) != edges.end());
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
