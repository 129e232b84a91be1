#include "sentree/runtime/mission.h"

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"

namespace sentree::runtime {

namespace {

void note(std::vector<Duration>& timings, Duration timing) {
  if (timings.size() >= kTimingsMax) timings.erase(timings.begin(), timings.begin() + kTimingsMax / 2);
  timings.push_back(timing);
}

}  // namespace

Mission::Mission(mission::TreeModel model, double factor, Scheduler& scheduler, Stream& stream, StandingFaults& faults,
                 std::vector<std::unique_ptr<LeafDriver>> drivers, MissionHooks hooks)
    : factor_(factor),
      scheduler_(scheduler),
      stream_(stream),
      faults_(faults),
      drivers_(std::move(drivers)),
      hooks_(std::move(hooks)),
      machine_(std::move(model)),
      state_(machine_.initial()),
      actor_(scheduler.add_actor("mission")) {
  SENTREE_ASSERT(drivers_.size() == machine_.model().plan->leaves.size());
  scheduler_.on_delivery(actor_, [this](mission::Delivery delivery) {
    auto& what = std::get<mission::TreeDelivery>(delivery.what);
    if (std::holds_alternative<mission::Stop>(what) && !scheduler_.is_virtual()) tell_stopped();
    machine_.step(state_, std::move(what), *this);
  });
}

void Mission::tell_stopped() {
  Message message;
  message.source = "mission";
  message.name = "mission.stop.taken";
  stream_.publish(std::move(message));
}

void Mission::answered(std::size_t leaf, std::uint64_t tick, bt::Status status, Map outputs) {
  scheduler_.hand_over(actor_, addressed(mission::Answered{leaf, tick, status, std::move(outputs)}));
}

void Mission::halted(std::size_t leaf) { scheduler_.hand_over(actor_, addressed(mission::Halted{leaf})); }

void Mission::tick_began(Duration late) { note(lateness_, late); }

void Mission::tick_done(std::uint64_t tick, Duration took) {
  note(durations_, took);
  if (hooks_.tick_done) hooks_.tick_done(tick);
}

void Mission::problem(std::string what) { problems_.add(what); }

TickTiming Mission::timing() const {
  const auto wall = [&](Duration run_time) {
    return Duration(static_cast<std::int64_t>(static_cast<double>(run_time.count()) / factor_));
  };
  const auto quantile = [&](std::vector<Duration> values, double q) {
    if (values.empty()) return Duration(0);
    std::sort(values.begin(), values.end());
    return wall(values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))]);
  };
  return {state_.ticks,
          state_.missed,
          quantile(lateness_, 0.5),
          quantile(lateness_, 0.99),
          quantile(lateness_, 1.0),
          quantile(durations_, 0.5)};
}

}  // namespace sentree::runtime
