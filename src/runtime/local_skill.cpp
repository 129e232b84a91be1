#include "sentree/runtime/local_skill.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

namespace {

constexpr auto kKilled = "the skill was killed";

}  // namespace

SkillActor::SkillActor(scxml::Chart chart, Options options, const std::map<std::string, project::ServicePlan>& services,
                       Caller::MakePort make_port, Publisher& publisher, Scheduler& scheduler,
                       StandingInterventions& standing, Replies replies)
    : name_(options.name),
      publisher_(publisher),
      scheduler_(scheduler),
      standing_(standing),
      actor_(scheduler.add_actor(options.name)),
      replies_(std::move(replies)),
      on_step_(std::move(options.on_step)),
      watched_(std::make_shared<Watched>(
          [this, watchdog = options.watchdog](const SourceSpan& script) { give_up(script, *watchdog); })),
      caller_(
          options.name, services, std::move(make_port), publisher, scheduler, actor_, standing,
          [this](const SkillEvent& event) {
            watched_->in_this_thread();
            if (given_up_) return false;
            const bool delivered = skill_.deliver(event, scheduler_.now());
            stepped();
            return delivered;
          },
          [this](std::uint64_t run) { return !given_up_ && skill_.is_current(run); }),
      skill_(std::move(chart),
             {.name = options.name,
              .condition = options.condition,
              .halt_deadline = options.halt_deadline,
              .seed = options.seed,
              .check_call = [this](const scxml::OutgoingSend& send) { return caller_.check(send); },
              .watch = &watched_->execution()},
             *this) {
  if (options.watchdog) options.watchdog->watch(watched_);
}

Scheduler::Task SkillActor::unless_given_up(Scheduler::Task task) {
  return [this, task = std::move(task)] {
    watched_->in_this_thread();
    if (given_up_) return;
    task();
    stepped();
  };
}

void SkillActor::give_up(const SourceSpan& script, const Watchdog& watchdog) {
  why_ = watchdog.reason(script, "skill " + name_);
  given_up_ = true;
  replies_.given_up(why_);
  if (!scheduler_.is_virtual()) {
    Message message;
    message.kind = MessageKind::kEvent;
    message.source = name_;
    message.name = name_ + ".given_up";
    message.data = Map{{"reason", why_}};
    publisher_.publish(std::move(message));
  }
  scheduler_.abandon(actor_, why_);
  if (scheduler_.is_virtual()) return;
  scheduler_.post(actor_, [this] { fail_outstanding(why_); });
}

void SkillActor::fail_outstanding(const std::string& why) {
  if (answered_ != tick_) answer(bt::Status::kFailure, Map{{"reason", why}});
  if (halting_) halted();
}

void SkillActor::kill() {
  scheduler_.post(actor_, unless_given_up([this] {
                    killed_ = true;
                    skill_.drop();
                    fail_outstanding(kKilled);
                  }));
}

void SkillActor::restart() {
  scheduler_.post(actor_, unless_given_up([this] { killed_ = false; }));
}

bool SkillActor::deliver_delayed(const std::string& message, Scheduler::Task& task) {
  const TimePoint now = scheduler_.now();
  not_before_ = std::max(not_before_, now);
  if (standing_.any(project::Intervention::Kind::kDelay))
    not_before_ = std::max(not_before_, now + standing_.delay_of(name_ + "." + message));
  if (not_before_ == now) return false;
  scheduler_.at(actor_, not_before_, Rank::kMessage, std::move(task));
  return true;
}

void SkillActor::deliver_after_delay(const std::string& message, Scheduler::Task task) {
  const std::lock_guard lock(order_mutex_);
  if (!deliver_delayed(message, task)) scheduler_.post(actor_, std::move(task));
}

void SkillActor::tick(std::uint64_t tick, bool started, Map inputs) {
  Scheduler::Task task = [this, tick, started, inputs = std::move(inputs)] {
    watched_->in_this_thread();
    tick_ = tick;
    if (given_up_) {
      answer(bt::Status::kFailure, Map{{"reason", why_}});
    } else if (killed_) {
      answer(bt::Status::kFailure, Map{{"reason", kKilled}});
    } else {
      skill_.tick(started, inputs, scheduler_.now());
      stepped();
    }
  };
  {
    const std::lock_guard lock(order_mutex_);
    if (deliver_delayed("tick", task)) return;
  }
  scheduler_.hand_over(actor_, std::move(task));
}

void SkillActor::halt() {
  deliver_after_delay("halt", [this] {
    watched_->in_this_thread();
    halting_ = true;
    if (given_up_ || killed_) {
      halted();
    } else {
      skill_.halt(scheduler_.now());
      stepped();
    }
  });
}

void SkillActor::inspect(std::function<void(const Skill*)> look) {
  scheduler_.post(actor_, [this, look = std::move(look)] { look(given_up_ ? nullptr : &skill_); });
}

void SkillActor::cancel() {
  // In order behind a delayed tick, which would otherwise begin a run after it.
  deliver_after_delay("cancel", unless_given_up([this] { skill_.cancel(scheduler_.now()); }));
}

void SkillActor::answer(bt::Status status, Map outputs) {
  answered_ = tick_;
  replies_.answered(tick_, status, std::move(outputs));
}

void SkillActor::halted() {
  halting_ = false;
  replies_.halted();
}

void SkillActor::wake_at(TimePoint when) {
  if (when == kNever || when == wake_) return;
  wake_ = when;
  scheduler_.at(actor_, when, Rank::kTimer, unless_given_up([this, when] {
                  if (wake_ != when) return;
                  wake_ = kNever;
                  skill_.timers(scheduler_.now());
                }));
}

}  // namespace sentree::runtime
