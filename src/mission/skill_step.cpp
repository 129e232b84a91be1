#include "sentree/mission/detail/skill_step.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/step.h"

// Ticks, halts and the runs of a chart that they become.

namespace sentree::mission {

namespace {

scxml::Event event_of(const Publication& published) {
  scxml::Event event;
  event.name = published.topic;
  event.origintype = "thrift";
  event.data = idl::for_script(published.args);
  return event;
}

}  // namespace

bool SkillMachine::Step::operator()(TickSkill&& tick) {
  state_.tick = tick.tick;
  state_.answered = 0;
  if (halting_) {
    // No ticks are delivered while a halt goes on.
    answer(bt::Status::kRunning, {});
    return true;
  }
  owing_ = true;
  if (model_.protocol) return ask(std::move(tick));
  if (tick.started && !alive_) {
    alive_ = true;
    start(tick.inputs);
  }
  if (alive_) {
    scxml::Event event;
    event.name = "tick";
    event.data = Value(std::move(tick.inputs));
    step(std::move(event));
  }
  return settle();
}

bool SkillMachine::Step::operator()(const HaltSkill&) {
  owing_ = false;
  const bool has_run = alive_ || ended_;
  ended_ = false;
  halting_ = true;
  if (model_.protocol) {
    if (lives_ && has_run) halt_with_protocol(!alive_);
  } else if (alive_) {
    scxml::Event event;
    event.name = "halt";
    const bool enabled = step(std::move(event));
    if (alive_ && !enabled) cancel();
    if (alive_) state_.halt_due = add_saturating(host_.now(), model_.halt_deadline);
  }
  return settle();
}

bool SkillMachine::Step::operator()(const CancelSkill&) {
  owing_ = false;
  // Between its runs a chart that lives on has nothing to give up.
  if (alive_ || (lives_ && ended_)) cancel();
  ended_ = false;
  const bool told = settle();
  abandon_goals();
  return told;
}

bool SkillMachine::Step::operator()(const KillSkill&) {
  give_up(state_, kKilled, host_);
  state_.phase = SkillPhase::kKilled;
  return true;
}

bool SkillMachine::Step::operator()(const RestartSkill&) {
  if (state_.phase == SkillPhase::kKilled) state_.phase = SkillPhase::kIdle;
  return true;
}

bool SkillMachine::Step::operator()(const SkillTimer& timer) {
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

bool SkillMachine::Step::operator()(const Published& published) {
  if (!state_.goals.empty()) note_result(*published.what);
  const bool begins = !lives_ && model_.protocol && state_.phase == SkillPhase::kIdle && state_.run == 0;
  if (begins) start({});
  remember(published.what);
  if (!lives_) return begins;
  step(event_of(*published.what));
  return settle();
}

bool SkillMachine::Step::ask(TickSkill&& tick) {
  const project::SkillProtocol& protocol = *model_.protocol;
  // What it has said since the last tick answers this one.
  if (ended_ && !tick.started) return settle();
  const bool begins = !alive_;
  alive_ = true;
  if (!lives_) start(tick.inputs);
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

void SkillMachine::Step::look_at_states() {
  std::optional<bt::Status> means;
  for (scxml::StateIndex state = 0; state < machine_.meaning_of_state_.size(); ++state) {
    if (machine_.meaning_of_state_[state] && state_.session.is_active(state)) means = machine_.meaning_of_state_[state];
  }
  if (means) take_answer(*means, {});
}

void SkillMachine::Step::halt_with_protocol(bool has_ended) {
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

void SkillMachine::Step::end_halt() {
  alive_ = false;
  state_.asked = false;
  state_.halt_due.reset();
}

void SkillMachine::Step::take_answer(bt::Status status, Map outputs) {
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

void SkillMachine::Step::give_reason() {
  std::string trouble = std::exchange(state_.trouble, {});
  if (state_.ended != bt::Status::kFailure || trouble.empty() || state_.outputs.find("reason") != nullptr) return;
  state_.outputs["reason"] = std::move(trouble);
}

void SkillMachine::Step::start(const Map& inputs) {
  const scxml::Chart& chart = model_.chart;
  state_.run = host_.run_number(state_.run + 1);
  lives_ = true;
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
  options.session_id = model_.name + '.' + std::to_string(state_.run);
  options.seed = hash_combine(model_.seed, state_.run);
  const std::string what = machine_.memory_ ? "start\n" + to_json(Value(options.data)) : std::string();
  execute(what,
          {.kind = scxml::StepOrder::Kind::kStart, .now = host_.now(), .event = {}, .options = std::move(options)});
  // Where it begins is no answer: it has not been asked.
  machine_.said_.clear();
  follow();
  for (const Shared<Publication>& heard : state_.heard) {
    if (!lives_) break;
    execute(event_of(*heard));
    if (model_.protocol) machine_.said_.clear();
    follow();
  }
}

void SkillMachine::Step::remember(const Shared<Publication>& what) {
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

bool SkillMachine::Step::step(scxml::Event&& event) {
  const bool enabled = execute(std::move(event));
  follow();
  return enabled;
}

bool SkillMachine::Step::execute(scxml::Event&& event) {
  const std::string what = machine_.memory_ ? StepMemory::name_of(event) : std::string();
  return execute(
      what, {.kind = scxml::StepOrder::Kind::kEvent, .now = host_.now(), .event = std::move(event), .options = {}});
}

bool SkillMachine::Step::execute(std::string_view what, scxml::StepOrder&& order) {
  if (machine_.elsewhere_ != nullptr) {
    if (const auto enabled = execute_elsewhere(order)) return *enabled;
  }
  const auto kind = order.kind;
  const auto run = [&] {
    return scxml::execute(model_.chart, state_.session, std::move(order), machine_.effects_, machine_.host_);
  };
  if (!machine_.memory_ || kind == scxml::StepOrder::Kind::kCancel) return run();
  return machine_.memory_->step(
      what, kind == scxml::StepOrder::Kind::kStart, state_.session, host_.now(), machine_.effects_,
      [](const Choice&) -> std::uint64_t { return 0; },
      [this](const StepMemory::Seen& seen) {
        if (seen.transition)
          machine_.took(*seen.transition);
        else
          machine_.got(seen.event, seen.message);
      },
      run);
}

std::optional<bool> SkillMachine::Step::execute_elsewhere(const scxml::StepOrder& order) {
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

void SkillMachine::Step::cancel() {
  execute("cancel", {.kind = scxml::StepOrder::Kind::kCancel, .now = host_.now(), .event = {}, .options = {}});
  follow();
}

void SkillMachine::Step::follow() {
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
    host_.problem(fmt::format("{} was given up: {}", model_.name, failure ? to_string(*failure) : "its chart failed"));
    end_chart("failure", Value(Map{{"reason", failure ? failure->message : ""}}));
  }
}

void SkillMachine::Step::end_chart(const std::string& final_id, std::optional<Value> donedata) {
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

bool SkillMachine::Step::settle() {
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

bool SkillMachine::Step::tell(const std::string& name) {
  scxml::Event event;
  event.name = name;
  return step(std::move(event));
}

void SkillMachine::Step::answer(bt::Status status, Map outputs) {
  state_.answered = state_.tick;
  host_.answer(state_.tick, status, std::move(outputs));
}

void SkillMachine::Step::schedule() {
  TimePoint next = lives_ ? state_.session.next_timer() : kNever;
  if (state_.halt_due) next = std::min(next, *state_.halt_due);
  if (next == kNever || next == state_.wake) return;
  state_.wake = next;
  host_.deliver_at(next, Rank::kTimer, SkillTimer{next});
}

}  // namespace sentree::mission
