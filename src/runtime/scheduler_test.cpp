#include "sentree/runtime/scheduler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <mutex>
#include <string>
#include <thread>
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

// A command from another thread is an injection at an instant of its own.
TEST(VirtualScheduler, TakesInCommandsWhileItStands) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  std::vector<std::string> order;
  const auto note = [&](const std::string& what) {
    return [&, what] { order.push_back(what + " at " + std::to_string(scheduler->now().time_since_epoch().count())); };
  };
  std::promise<void> standing;
  scheduler->on_standing([&] { standing.set_value(); });
  scheduler->set_pace({.paused = false, .factor = 0});
  scheduler->at(actor, TimePoint(milliseconds(1)), Rank::kMessage, [&] {
    scheduler->set_pace({.paused = true, .factor = 0});
    note("last of the instant")();
  });
  scheduler->at(actor, TimePoint(milliseconds(1)), Rank::kTimer, note("timer"));
  scheduler->at(actor, TimePoint(milliseconds(2)), Rank::kTimer, [&] { scheduler->stop(); });
  std::thread work([&] { EXPECT_EQ(scheduler->run(), std::nullopt); });
  standing.get_future().wait();
  EXPECT_TRUE(scheduler->standing());
  std::promise<void> done;
  EXPECT_TRUE(scheduler->inject(actor, note("first command")));
  EXPECT_TRUE(scheduler->inject(actor, [&] {
    note("second command")();
    scheduler->post(actor, note("its message"));
    done.set_value();
  }));
  done.get_future().wait();
  scheduler->set_pace({.paused = false, .factor = 0});
  work.join();
  EXPECT_THAT(order, ElementsAre("last of the instant at 1000000", "timer at 1000000", "first command at 1000001",
                                 "second command at 1000001", "its message at 1000001"));
}

TEST(VirtualScheduler, RefusesMoreCommandsThanItsInboxHolds) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  for (std::size_t i = 0; i < Scheduler::kInboxMax; ++i) ASSERT_TRUE(scheduler->inject(actor, [] {}));
  EXPECT_FALSE(scheduler->inject(actor, [] {}));
}

TEST(VirtualScheduler, IsNeverAheadOfTheWallClockTimesItsPace) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  constexpr double kFactor = 50.0;
  scheduler->set_pace({.paused = false, .factor = kFactor});
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 1; i <= 20; ++i) {
    scheduler->at(actor, TimePoint(milliseconds(50 * i)), Rank::kTimer, [&] {
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
      EXPECT_LE(seconds(scheduler->now()), wall.count() * kFactor);
      EXPECT_EQ(scheduler->view_time(), scheduler->now());
    });
  }
  scheduler->at(actor, TimePoint(milliseconds(1000)), Rank::kTick, [&] { scheduler->stop(); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
}

TEST(RealScheduler, StandsWhilePausedAndTakesInCommands) {
  const auto scheduler = make_real_scheduler(1000.0);
  const ActorId actor = scheduler->add_actor("a");
  scheduler->set_pace({.paused = true, .factor = 1000.0});
  EXPECT_TRUE(scheduler->standing());
  bool fired = false;
  scheduler->at(actor, TimePoint(milliseconds(1)), Rank::kTimer, [&] {
    fired = true;
    scheduler->stop();
  });
  std::thread work([&] { EXPECT_EQ(scheduler->run(), std::nullopt); });
  std::promise<TimePoint> first;
  std::promise<TimePoint> second;
  EXPECT_TRUE(scheduler->inject(actor, [&] { first.set_value(scheduler->now()); }));
  EXPECT_EQ(first.get_future().get(), TimePoint());
  EXPECT_TRUE(scheduler->inject(actor, [&] {
    EXPECT_FALSE(fired);
    second.set_value(scheduler->now());
  }));
  EXPECT_EQ(second.get_future().get(), TimePoint());
  scheduler->set_pace({.paused = false, .factor = 100.0});
  work.join();
  EXPECT_TRUE(fired);
  EXPECT_GE(scheduler->now(), TimePoint(milliseconds(1)));
}

TEST(RealScheduler, GoesOnWhereItWasAtAnotherSpeed) {
  const auto scheduler = make_real_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  // An hour of run time, which only the new speed makes short.
  scheduler->at(actor, TimePoint(std::chrono::hours(1)), Rank::kTimer, [&] { scheduler->stop(); });
  EXPECT_TRUE(scheduler->inject(actor, [&] {
    const TimePoint before = scheduler->now();
    scheduler->set_pace({.paused = true, .factor = 1e6});
    const TimePoint paused = scheduler->now();
    EXPECT_GE(paused, before);
    EXPECT_EQ(scheduler->now(), paused);
    scheduler->set_pace({.paused = false, .factor = 1e6});
    EXPECT_GE(scheduler->now(), paused);
  }));
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_GE(scheduler->now(), TimePoint(std::chrono::hours(1)));
}

}  // namespace
}  // namespace sentree::runtime
