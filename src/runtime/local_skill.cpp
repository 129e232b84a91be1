#include "sentree/runtime/local_skill.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/mission/subscriptions.h"

namespace sentree::runtime {

SkillActor::SkillActor(mission::SkillModel model, std::size_t leaf, Surroundings surroundings, Replies replies)
    : leaf_(leaf),
      publisher_(surroundings.publisher),
      scheduler_(surroundings.scheduler),
      faults_(surroundings.faults),
      watchdog_(surroundings.watchdog),
      make_port_(std::move(surroundings.make_port)),
      replies_(std::move(replies)),
      watched_(std::make_shared<Watched>([this](const SourceSpan& script) { give_up(script); })),
      machine_(std::move(model), &watched_->execution()),
      actor_(scheduler_.add_actor(fmt::format("{} ({})", machine_.model().name, machine_.model().chart.file()))),
      tells_delays_(surroundings.tells_delays),
      timer_arrival_(std::move(surroundings.timer_arrival)),
      veto_arrival_(std::move(surroundings.veto_arrival)) {
  scheduler_.on_delivery(actor_, [this](mission::Delivery delivery) { take(std::move(delivery)); });
  if (watchdog_ != nullptr) watchdog_->watch(watched_);
  machine_.execute_elsewhere(surroundings.chart_elsewhere);
}

void SkillActor::take(mission::Delivery delivery) {
  watched_->in_this_thread();
  auto& what = std::get<mission::SkillDelivery>(delivery.what);
  if (const auto* topic = std::get_if<mission::Published>(&what)) {
    if (const auto told = topics_.taken(*topic->what, machine_.model().name, publisher_)) tell_order(*told);
  }
  if (given_up_) {
    mission::SkillMachine::give_up(state_, why_, *this);
    const std::string_view kind = mission::kind_of(what);
    if (kind == "outcome")
      machine_.step(state_, std::move(what), *this);  // too late for the chart, and observed as such
    else
      mission::SkillMachine::refuse(state_, what, why_, *this);
    return;
  }
  tell_order(what);
  if (const auto* timer = std::get_if<mission::SkillTimer>(&what); timer != nullptr && timer->when == state_.wake) {
    if (const TimePoint at = timer_arrival_ ? timer_arrival_(timers_ + 1) : TimePoint{}; at > now())
      return scheduler_.at(actor_, at, mission::Rank::kTimer, addressed(*timer));
    ++timers_;
    // A replay sets its timers a little earlier, at the times of what set them.
    if (!scheduler_.is_virtual()) tell_taken("timer", {{"number", static_cast<std::int64_t>(timers_)}});
  }
  const bool is_tick = std::holds_alternative<mission::TickSkill>(what);
  const scxml::ObserveGuards seen(tried_ ? this : nullptr);
  if (machine_.step(state_, std::move(what), *this)) told();
  if (scheduler_.is_virtual()) return;
  took_ = now();
  if (!is_tick) took_other_ = took_;
}

void SkillActor::tell_order(const mission::SkillDelivery& what) {
  const auto tell = [this](const char* name, bool behind, bool delayed) {
    if (behind || delayed) tell_taken(name, delayed ? Map{{"delayed", true}} : Map());
  };
  if (std::holds_alternative<mission::TickSkill>(what)) {
    tell("tick", took_other_ >= asked_.load(), was_delayed(what));
  } else if (std::holds_alternative<mission::HaltSkill>(what)) {
    tell("halt", took_ >= halt_asked_.load(), was_delayed(what));
  } else if (std::holds_alternative<mission::CancelSkill>(what)) {
    tell("cancel", took_ >= cancel_asked_.load(), was_delayed(what));
  } else if (std::holds_alternative<mission::KillSkill>(what)) {
    tell("kill", took_ >= kill_asked_.load(), false);
  } else if (std::holds_alternative<mission::RestartSkill>(what)) {
    tell("restart", took_ >= restart_asked_.load(), false);
  }
}

void SkillActor::tell_order(const ToldTopic& topic) {
  if (topic.delayed || took_ >= topic.published)
    tell_taken("topic", {{"topic", topic.what->topic}, {"sequence", static_cast<std::int64_t>(topic.sequence)}});
}

void SkillActor::tell_taken(const char* what, Map data) {
  tell(machine_.model().name, fmt::format("{}.taken", what), std::move(data));
}

void SkillActor::tell_delayed(std::string_view what, Map data) {
  tell("scenario", fmt::format("{}.delayed", what), std::move(data));
}

void SkillActor::tell_untaken() {
  for (const ToldTopic& each : topics_.waiting()) {
    tell(machine_.model().name, "topic.untaken",
         {{"topic", each.what->topic}, {"sequence", static_cast<std::int64_t>(each.sequence)}});
  }
}

void SkillActor::tell(std::string source, std::string_view what, Map data) {
  const std::string& leaf = machine_.model().name;
  Message message;
  message.kind = MessageKind::kEvent;
  if (source != leaf) message.target = leaf;
  message.source = std::move(source);
  message.name = fmt::format("{}.{}", leaf, what);
  message.data = std::move(data);
  publisher_.publish(std::move(message));
}

bool SkillActor::was_delayed(const mission::SkillDelivery& what) {
  if (!tells_delays_) return false;
  const std::lock_guard lock(order_mutex_);
  if (const auto* tick = std::get_if<mission::TickSkill>(&what)) {
    const auto found = std::find(delayed_ticks_.begin(), delayed_ticks_.end(), tick->tick);
    if (found == delayed_ticks_.end()) return false;
    delayed_ticks_.erase(found);
    return true;
  }
  std::size_t& left = std::holds_alternative<mission::HaltSkill>(what) ? delayed_halts_ : delayed_cancels_;
  if (left == 0) return false;
  --left;
  return true;
}

void SkillActor::give_up(const SourceSpan& script) {
  const std::string& name = machine_.model().name;
  why_ = watchdog_->reason(script, "skill " + name);
  given_up_ = true;
  replies_.given_up(why_);
  if (!scheduler_.is_virtual()) {
    Message message;
    message.kind = MessageKind::kEvent;
    message.source = name;
    message.name = name + ".given_up";
    message.data = Map{{"reason", why_}};
    publisher_.publish(std::move(message));
  }
  scheduler_.abandon(actor_, why_);
  if (!scheduler_.is_virtual())
    scheduler_.post(actor_, [this] { mission::SkillMachine::give_up(state_, why_, *this); });
}

bool SkillActor::held_back(std::string_view message, mission::SkillDelivery& what) {
  TimePoint& not_before = state_.not_before;
  const TimePoint present = now();
  not_before = std::max(not_before, present);
  if (faults_.any())
    not_before = std::max(not_before, present + faults_.delay_of(fmt::format("{}.{}", machine_.model().name, message)));
  if (not_before == present) return false;
  if (tells_delays_) {
    tell_delayed(message, {{"by_ns", (not_before - present).count()}});
    if (const auto* tick = std::get_if<mission::TickSkill>(&what))
      delayed_ticks_.push_back(tick->tick);
    else
      ++(std::holds_alternative<mission::HaltSkill>(what) ? delayed_halts_ : delayed_cancels_);
  }
  scheduler_.at(actor_, not_before, mission::Rank::kMessage, addressed(std::move(what)));
  return true;
}

void SkillActor::tick(mission::TickSkill tick, TimePoint asked) {
  mission::SkillDelivery what = std::move(tick);
  {
    const std::lock_guard lock(order_mutex_);
    asked_ = kNever;
    if (held_back("tick", what)) return;
    asked_ = asked;
  }
  scheduler_.hand_over(actor_, addressed(std::move(what)));
}

void SkillActor::halt(TimePoint asked) {
  const std::lock_guard lock(order_mutex_);
  mission::SkillDelivery what = mission::HaltSkill{};
  halt_asked_ = kNever;
  if (held_back("halt", what)) return;
  halt_asked_ = asked;
  post(std::move(what));
}

void SkillActor::cancel(TimePoint asked) {
  // In order behind a delayed tick, which would otherwise begin a run after it.
  const std::lock_guard lock(order_mutex_);
  mission::SkillDelivery what = mission::CancelSkill{};
  cancel_asked_ = kNever;
  if (held_back("cancel", what)) return;
  cancel_asked_ = asked;
  post(std::move(what));
}

void SkillActor::kill(TimePoint asked) {
  kill_asked_ = asked;
  post(mission::KillSkill{});
}

void SkillActor::restart(TimePoint asked) {
  restart_asked_ = asked;
  post(mission::RestartSkill{});
}

void SkillActor::take_topic(ToldTopic told) {
  const TimePoint present = now();
  TimePoint not_before = state_.topics_not_before;
  const TimePoint when = mission::Subscriptions::time_of(not_before, present, told.delay);
  told.delayed = tells_delays_ && when > present;
  if (!topics_.add(scheduler_, told)) return;
  state_.topics_not_before = not_before;
  if (told.delayed) {
    tell_delayed("topic", {{"topic", told.what->topic},
                           {"sequence", static_cast<std::int64_t>(told.sequence)},
                           {"by_ns", (when - present).count()}});
  }
  scheduler_.at(actor_, when, mission::Rank::kMessage, addressed(mission::Published{told.what}));
}

void SkillActor::inspect(std::function<void(const Skill*)> look) {
  scheduler_.post(actor_, [this, look = std::move(look)] {
    const Skill shown{machine_.model(), state_};
    look(given_up_ ? nullptr : &shown);
  });
}

std::vector<ServicePort*> SkillActor::make_ports() {
  std::vector<ServicePort*> made;
  for (const scxml::SendInfo& send : scxml::sends_with_invoked(machine_.model().chart)) {
    if (!send.target) continue;
    const auto service = machine_.model().services->find(*send.target);
    if (service == machine_.model().services->end() || project::is_inside(service->second.at)) continue;
    auto& port = ports_[service->first];
    if (port) continue;
    port = make_port_(service->second);
    made.push_back(port.get());
  }
  return made;
}

std::optional<mission::Admission> SkillActor::request(Message message, const mission::Shared<mission::Call>& call) {
  auto admission = publisher_.request(std::move(message), [this, call](mission::Admission decided) {
    post(mission::Admitted{call, std::move(decided)});
  });
  if (!admission || !admission->veto || !veto_arrival_) return admission;
  const TimePoint at = veto_arrival_(fmt::format("{}.{}", call->service, call->method));
  if (at <= now()) return admission;
  scheduler_.at(actor_, at, mission::Rank::kMessage, addressed(mission::Admitted{call, std::move(*admission)}));
  return std::nullopt;
}

void SkillActor::send(const mission::Shared<mission::Call>& call, const idl::Method& method) {
  auto& port = ports_[call->service];
  if (!port) port = make_port_(machine_.model().services->at(call->service));
  if (port->take(leaf_, call)) return;
  port->call(method, call->args, [this, call](mission::CallOutcome outcome) {
    // Often from a thread that waited for the reply and has nothing else to do.
    scheduler_.hand_over(actor_, addressed(mission::Outcome{call, std::move(outcome)}));
  });
}

void SkillActor::deliver_at(TimePoint when, mission::Rank rank, mission::SkillDelivery what) {
  scheduler_.at(actor_, when, rank, addressed(std::move(what)));
}

Duration SkillActor::delay_of(std::string_view message) { return faults_.delay_of_call(message); }

void SkillActor::falsify(std::string_view call, const idl::Method& method, Value& result) {
  if (!faults_.spares_calls()) faults_.falsify(call, method, result);
}

bool SkillActor::fails(mission::Failing how, std::string_view call) {
  return !faults_.spares_calls() && faults_.fails(how, call);
}

void SkillActor::answer(std::uint64_t tick, bt::Status status, Map outputs) {
  replies_.answered(tick, status, std::move(outputs));
}

}  // namespace sentree::runtime
