#include "sentree/runtime/local_skill.h"

#include <algorithm>
#include <utility>

namespace sentree::runtime {

SkillActor::SkillActor(scxml::Chart chart, Options options, const std::map<std::string, ServicePlan>& services,
                       Caller::MakePort make_port, Publisher& publisher, Scheduler& scheduler, const Delays& delays,
                       Replies replies)
    : name_(options.name),
      scheduler_(scheduler),
      delays_(delays),
      actor_(scheduler.add_actor(options.name)),
      replies_(std::move(replies)),
      caller_(
          options.name, services, std::move(make_port), publisher, scheduler, actor_, delays,
          [this](const SkillEvent& event) { return skill_.deliver(event, scheduler_.now()); },
          [this](std::uint64_t run) { return skill_.is_current(run); }),
      skill_(std::move(chart),
             {.name = options.name,
              .condition = options.condition,
              .halt_deadline = options.halt_deadline,
              .seed = options.seed,
              .check_call = [this](const scxml::OutgoingSend& send) { return caller_.check(send); }},
             *this) {}

void SkillActor::deliver_after_delay(const std::string& message, Scheduler::Task task) {
  const std::lock_guard lock(order_mutex_);
  const TimePoint now = scheduler_.now();
  not_before_ = std::max(not_before_, now + delays_.of(name_ + "." + message));
  if (not_before_ > now)
    scheduler_.at(actor_, not_before_, Rank::kMessage, std::move(task));
  else
    scheduler_.post(actor_, std::move(task));
}

void SkillActor::tick(std::uint64_t tick, bool started, Map inputs) {
  deliver_after_delay("tick", [this, tick, started, inputs = std::move(inputs)] {
    tick_ = tick;
    skill_.tick(started, inputs, scheduler_.now());
  });
}

void SkillActor::halt() {
  deliver_after_delay("halt", [this] { skill_.halt(scheduler_.now()); });
}

void SkillActor::cancel() {
  // In order behind a delayed tick, which would otherwise begin a run after it.
  deliver_after_delay("cancel", [this] { skill_.cancel(scheduler_.now()); });
}

void SkillActor::answer(bt::Status status, Map outputs) { replies_.answered(tick_, status, std::move(outputs)); }
void SkillActor::halted() { replies_.halted(); }

void SkillActor::wake_at(TimePoint when) {
  if (when == kNever || when == wake_) return;
  wake_ = when;
  scheduler_.at(actor_, when, Rank::kTimer, [this, when] {
    if (wake_ != when) return;
    wake_ = kNever;
    skill_.timers(scheduler_.now());
  });
}

}  // namespace sentree::runtime
