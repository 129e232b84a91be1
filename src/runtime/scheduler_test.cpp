#include "sentree/runtime/scheduler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <string>
#include <vector>

namespace sentree::runtime {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(VirtualScheduler, OrdersOneInstantByRankThenByPosting) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  std::vector<std::string> order;
  const TimePoint t(milliseconds(5));
  const auto note = [&](const std::string& what) { return [&order, what] { order.push_back(what); }; };
  scheduler->at(actor, t, Rank::kTick, note("tick"));
  scheduler->at(actor, t, Rank::kTimer, note("timer 1"));
  scheduler->at(actor, t, Rank::kTimer, note("timer 2"));
  scheduler->at(actor, t, Rank::kInjection, [&] {
    order.push_back("injection");
    scheduler->post(actor, note("message"));
  });
  scheduler->at(actor, t, Rank::kSimulator, note("simulator"));
  scheduler->at(actor, t + milliseconds(1), Rank::kInjection, [&] { scheduler->stop(); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_THAT(order, ElementsAre("injection", "simulator", "message", "timer 1", "timer 2", "tick"));
  EXPECT_EQ(scheduler->now(), t + milliseconds(1));
}

TEST(VirtualScheduler, TimeDoesNotRunBackwards) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  TimePoint seen{};
  scheduler->at(actor, TimePoint(milliseconds(5)), Rank::kTimer, [&] {
    scheduler->at(actor, TimePoint(milliseconds(1)), Rank::kTimer, [&] {
      seen = scheduler->now();
      scheduler->stop();
    });
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_EQ(seen, TimePoint(milliseconds(5)));
}

TEST(VirtualScheduler, SaysWhenPartsAnswerEachOtherForEver) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("echo");
  std::function<void()> again = [&] { scheduler->post(actor, again); };
  scheduler->post(actor, again);
  EXPECT_THAT(scheduler->run().value_or(""),
              HasSubstr("echo has been sent more than 200000 messages without time passing"));
}

TEST(VirtualScheduler, BoundsItsQueue) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("slow");
  for (std::size_t i = 0; i <= Scheduler::kQueueMax; ++i)
    scheduler->at(actor, TimePoint(milliseconds(1)), Rank::kTimer, [] {});
  EXPECT_THAT(scheduler->run().value_or(""), HasSubstr("are waiting; the last one was for slow"));
}

TEST(VirtualScheduler, SaysWhenNothingIsLeftToDo) {
  EXPECT_THAT(make_virtual_scheduler()->run().value_or(""), HasSubstr("nothing is left to do"));
}

TEST(RealScheduler, TasksOfOneActorNeverOverlapAndKeepTheirOrder) {
  const auto scheduler = make_real_scheduler();
  const ActorId counter = scheduler->add_actor("counter");
  const ActorId first = scheduler->add_actor("first");
  const ActorId second = scheduler->add_actor("second");
  std::vector<std::pair<int, int>> seen;  // only the counter touches it
  constexpr int kEach = 1000;
  const auto send = [&](int from) {
    for (int i = 0; i < kEach; ++i) {
      scheduler->post(counter, [&, from, i] {
        seen.emplace_back(from, i);
        if (seen.size() == 2 * kEach) scheduler->stop();
      });
    }
  };
  scheduler->post(first, [&] { send(1); });
  scheduler->post(second, [&] { send(2); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  int next[3] = {0, 0, 0};
  for (const auto& [from, i] : seen) EXPECT_EQ(i, next[from]++);
}

TEST(RealScheduler, StretchesTimeByItsFactor) {
  const auto scheduler = make_real_scheduler(1000.0);
  const ActorId actor = scheduler->add_actor("a");
  const auto began = std::chrono::steady_clock::now();
  TimePoint fired{};
  scheduler->at(actor, TimePoint(std::chrono::seconds(20)), Rank::kTimer, [&] {
    fired = scheduler->now();
    scheduler->stop();
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_GE(fired, TimePoint(std::chrono::seconds(20)));
  EXPECT_GE(std::chrono::steady_clock::now() - began, milliseconds(19));
}

TEST(RealScheduler, BoundsEachQueue) {
  const auto scheduler = make_real_scheduler();
  const ActorId actor = scheduler->add_actor("slow");
  for (std::size_t i = 0; i <= Scheduler::kQueueMax; ++i) {
    scheduler->at(actor, TimePoint(std::chrono::hours(1)), Rank::kTimer, [] {});
  }
  EXPECT_THAT(scheduler->run().value_or(""), HasSubstr("messages are waiting for slow"));
}

}  // namespace
}  // namespace sentree::runtime
