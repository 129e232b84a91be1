#include "sentree/runtime/skill.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace sentree::runtime {

Skill::Skill(scxml::Chart chart, SkillOptions options, SkillPort& port)
    : chart_(std::move(chart)), options_(std::move(options)), port_(port) {
  host_.processors.push_back({"thrift", ""});
  host_.on_send = options_.check_call;
  host_.watch = options_.watch;
  host_.observer = &watcher_;
}

void Skill::Watcher::event(const scxml::Chart& chart, std::string_view, const scxml::Event& event) {
  if (chart == skill.chart_) latest.event = event.name;
}

void Skill::Watcher::transition(const scxml::Chart& chart, std::string_view, scxml::TransitionIndex taken) {
  if (!(chart == skill.chart_)) return;
  latest.transition = taken;
  ++latest.transitions;
}

void Skill::start(const Map& inputs, TimePoint now) {
  ++run_;
  running_ = true;
  halting_ = false;
  halt_due_.reset();
  ended_.reset();
  outputs_ = Map();
  scxml::StartOptions options;
  for (const auto& [port, value] : inputs) {
    const bool is_data =
        std::any_of(chart_.data().begin(), chart_.data().end(), [&](const auto& d) { return d.id == port; });
    if (is_data) options.data[port] = value;
  }
  options.session_id = options_.name + "." + std::to_string(run_);
  options.seed = hash_combine(options_.seed, run_);
  scxml::Effects effects;
  scxml::start(chart_, session_, std::move(options), now, effects, host_);
  follow(effects);
}

void Skill::tick(bool started, const Map& inputs, TimePoint now) {
  answer_owed_ = true;
  if (started && !running_) start(inputs, now);
  if (running_) {
    scxml::Event event;
    event.name = "tick";
    event.data = Value(inputs);
    step(std::move(event), now);
  }
  settle();
  // An action's tick is answered after the macrostep that it caused.
  if (answer_owed_ && !options_.condition) {
    answer_owed_ = false;
    port_.answer(bt::Status::kRunning, {});
  }
  schedule();
}

void Skill::halt(TimePoint now) {
  answer_owed_ = false;
  ended_.reset();
  if (!running_) {
    port_.halted();
    return;
  }
  halting_ = true;
  scxml::Event event;
  event.name = "halt";
  const bool enabled = step(std::move(event), now).enabled;
  if (running_ && !enabled) {
    scxml::Effects effects;
    scxml::cancel(chart_, session_, now, effects, host_);
    follow(effects);
  }
  if (running_) halt_due_ = add_saturating(now, options_.halt_deadline);
  settle();
  schedule();
}

void Skill::cancel(TimePoint now) {
  answer_owed_ = false;
  if (running_) {
    scxml::Effects effects;
    scxml::cancel(chart_, session_, now, effects, host_);
    follow(effects);
  }
  ended_.reset();
  if (std::exchange(halting_, false)) port_.halted();
  schedule();
}

void Skill::drop() {
  running_ = false;
  answer_owed_ = false;
  halting_ = false;
  halt_due_.reset();
  ended_.reset();
  outputs_ = Map();
}

bool Skill::deliver(const SkillEvent& outcome, TimePoint now) {
  if (!is_current(outcome.run)) return false;
  scxml::Event event;
  event.name = outcome.name;
  // SCXML 6.2.5: what prevents delivery is an error event of the platform.
  event.type = outcome.name.starts_with("error.") ? scxml::EventType::kPlatform : scxml::EventType::kExternal;
  event.sendid = outcome.sendid;
  event.origintype = "thrift";
  event.data = outcome.data;
  step(std::move(event), now);
  settle();
  schedule();
  return true;
}

void Skill::timers(TimePoint now) {
  if (running_ && session_.next_timer() <= now) {
    scxml::Effects effects;
    scxml::step_timers(chart_, session_, now, effects, host_);
    follow(effects);
  }
  if (running_ && halt_due_ && *halt_due_ <= now) {
    port_.problem(options_.name + " did not end within its halt deadline of " +
                  std::to_string(options_.halt_deadline.count() / 1'000'000) + " ms and was cancelled");
    scxml::Effects effects;
    scxml::cancel(chart_, session_, now, effects, host_);
    follow(effects);
  }
  settle();
  schedule();
}

scxml::StepInfo Skill::step(scxml::Event event, TimePoint now) {
  scxml::Effects effects;
  const scxml::StepInfo info = scxml::step(chart_, session_, event, now, effects, host_);
  follow(effects);
  return info;
}

void Skill::follow(scxml::Effects& effects) {
  for (scxml::Effect& effect : effects) {
    if (auto* send = std::get_if<scxml::OutgoingSend>(&effect)) {
      if (send->type == "thrift") {
        port_.call({run_, send->target, send->event, send->data.value_or(Value(Map())), send->sendid});
      } else {
        port_.problem(to_string(send->span) + ": nobody receives <send> of type \"" + send->type + "\" to \"" +
                      send->target + "\"");
      }
    } else if (const auto* line = std::get_if<scxml::LogLine>(&effect)) {
      port_.log(*line);
    } else if (const auto* done = std::get_if<scxml::Done>(&effect)) {
      end_run(done->final_id, done->donedata);
    }
  }
  if (running_ && session_.status() == scxml::SessionStatus::kFailed) {
    port_.problem(options_.name + " was given up: " +
                  (session_.failure() ? to_string(*session_.failure()) : std::string("its chart failed")));
    end_run("failure", Value(Map{{"reason", session_.failure() ? session_.failure()->message : ""}}));
  }
}

void Skill::end_run(const std::string& final_id, const std::optional<Value>& donedata) {
  running_ = false;
  halt_due_.reset();
  // A run that says `halted` without having been asked to has not done its work.
  ended_ = final_id == "success" ? bt::Status::kSuccess : bt::Status::kFailure;
  const Map* outputs = donedata ? donedata->as_map() : nullptr;
  outputs_ = outputs != nullptr ? *outputs : Map();
}

Result<Value> Skill::save() const {
  Map saved{{"run", static_cast<std::int64_t>(run_)},
            {"running", running_},
            {"answer_owed", answer_owed_},
            {"halting", halting_}};
  if (halt_due_) saved["halt_due_ns"] = halt_due_->time_since_epoch().count();
  if (ended_) saved["ended"] = bt::to_string(*ended_);
  if (!outputs_.empty()) saved["outputs"] = outputs_;
  if (run_ > 0) {
    auto session = scxml::save(chart_, session_);
    if (!session) return tl::unexpected(session.error());
    saved["session"] = std::move(*session);
  }
  return Value(std::move(saved));
}

// Answers what the end of a run answers.
void Skill::settle() {
  if (running_) return;
  if (halting_) {
    halting_ = false;
    ended_.reset();
    port_.halted();
  } else if (answer_owed_ && ended_) {
    answer_owed_ = false;
    port_.answer(*std::exchange(ended_, std::nullopt), std::move(outputs_));
  } else if (answer_owed_) {
    // Ticked again after it was cancelled: there is nothing to tell but failure.
    answer_owed_ = false;
    port_.answer(bt::Status::kFailure, {});
  }
}

void Skill::schedule() {
  TimePoint next = running_ ? session_.next_timer() : kNever;
  if (halt_due_) next = std::min(next, *halt_due_);
  port_.wake_at(next);
}

}  // namespace sentree::runtime
