#include "sentree/runtime/mission.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/bt/thread_work.h"
#include "sentree/runtime/detail/node_watch.h"

namespace sentree::runtime {

namespace {

void note(std::vector<Duration>& timings, Duration timing) {
  if (timings.size() >= kTimingsMax) timings.erase(timings.begin(), timings.begin() + kTimingsMax / 2);
  timings.push_back(timing);
}

// Virtual time would have passed altogether before a thread has begun. So it passes no faster than the clock while one
// works: what takes less than a period ends at the same tick in every run, and nothing is waited for without an end.
class ThreadsAwaited {
 public:
  ThreadsAwaited(const project::Plan& plan, Duration period, std::vector<bt::NodeId> nodes)
      : plan_(plan), period_(period), nodes_(std::move(nodes)) {}

  // Before a tick. What a person should know, once.
  std::optional<std::string> wait(bt::State& state) {
    const bt::NodeId works = bt::wait_for_threads(plan_.tree, state, nodes_, ticked_ + period_);
    ticked_ = std::chrono::steady_clock::now();
    if (works == bt::kNoNode || std::exchange(is_told_, true)) return std::nullopt;
    return fmt::format(
        "{}: {} \"{}\" works in a thread for longer than a period: virtual time passes no faster than the clock "
        "meanwhile, and at which tick it ends depends on the machine. --clock real is what it was made for; with "
        "exec::Threads(0) its work takes no time",
        to_string(plan_.tree.span(works)), plan_.tree.registration(works), plan_.tree.path(works));
  }

 private:
  const project::Plan& plan_;
  const Duration period_;
  const std::vector<bt::NodeId> nodes_;
  std::chrono::steady_clock::time_point ticked_;
  bool is_told_ = false;
};

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
  NodeWatch* const watch = WatchNodes::present();
  std::shared_ptr<ThreadsAwaited> threads;
  if (const project::Plan& plan = *machine_.model().plan; plan.scenario.virtual_time) {
    auto nodes = bt::nodes_in_threads(plan.tree);
    if (!nodes.empty()) threads = std::make_shared<ThreadsAwaited>(plan, machine_.model().period, std::move(nodes));
  }
  scheduler_.on_delivery(actor_, [this, watch, threads](mission::Delivery delivery) {
    if (watch != nullptr && watch->has_given_up()) return;
    const bt::WatchCalls watched(watch != nullptr ? &watch->calls() : nullptr);
    auto& what = std::get<mission::TreeDelivery>(delivery.what);
    if (std::holds_alternative<mission::Stop>(what) && !scheduler_.is_virtual()) tell_stopped();
    if (threads != nullptr && std::holds_alternative<mission::Period>(what)) {
      if (const auto told = threads->wait(state_.tree)) problem(*told);
    }
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
