#include "sentree/runtime/services.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "sentree/sim/world.h"

namespace sentree::runtime {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

class SetClock final : public Clock {
 public:
  TimePoint now() const override { return TimePoint(Duration(now_.load())); }
  void advance(Duration by) { now_ += by.count(); }

 private:
  std::atomic<Duration::rep> now_ = 0;
};

std::shared_ptr<const sim::World> world() {
  auto world = sim::load_world(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/world/world.yaml");
  return world.ok() ? std::make_shared<const sim::World>(std::move(*world.value)) : nullptr;
}

TEST(SimHost, FallsBehindAClockThatIsTooFastInsteadOfKeepingItsCallersWaiting) {
  SetClock clock;
  SimHost host(world(), 1, clock);
  std::promise<Duration> told;
  host.keep_up({.work = milliseconds(1), .lag = milliseconds(10)}, [&](Duration behind) { told.set_value(behind); });
  clock.advance(hours(20));  // more than a minute's work
  const Duration behind = told.get_future().get();
  host.stop_keeping_up();
  EXPECT_GT(behind, hours(19));
  const TimePoint reached = host.snapshot().time;
  EXPECT_EQ(reached + behind, TimePoint(hours(20)));
  clock.advance(milliseconds(60));
  EXPECT_EQ(host.snapshot().time, reached + milliseconds(60));
}

}  // namespace
}  // namespace sentree::runtime
