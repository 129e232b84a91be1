#include "sentree/runtime/scheduler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
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
  scheduler->at(actor, t, mission::Rank::kTick, note("tick"));
  scheduler->at(actor, t, mission::Rank::kTimer, note("timer 1"));
  scheduler->at(actor, t, mission::Rank::kTimer, note("timer 2"));
  scheduler->at(actor, t, mission::Rank::kInjection, [&] {
    order.push_back("injection");
    scheduler->post(actor, note("message"));
  });
  scheduler->at(actor, t, mission::Rank::kSimulator, note("simulator"));
  scheduler->at(actor, t + milliseconds(1), mission::Rank::kInjection, [&] { scheduler->stop(); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_THAT(order, ElementsAre("injection", "simulator", "message", "timer 1", "timer 2", "tick"));
  EXPECT_EQ(scheduler->now(), t + milliseconds(1));
}

TEST(VirtualScheduler, TimeDoesNotRunBackwards) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  TimePoint seen{};
  scheduler->at(actor, TimePoint(milliseconds(5)), mission::Rank::kTimer, [&] {
    scheduler->at(actor, TimePoint(milliseconds(1)), mission::Rank::kTimer, [&] {
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
    scheduler->at(actor, TimePoint(milliseconds(1)), mission::Rank::kTimer, [] {});
  EXPECT_THAT(scheduler->run().value_or(""), HasSubstr("are waiting; the last one was for slow"));
}

// Commands and deliveries that come in at one instant are written down with the places that they have.
TEST(VirtualScheduler, NumbersWhatComesFromOutside) {
  struct Written final : Chronicle {
    void instant(TimePoint) override {}
    void entered(const Place& where, const mission::Delivery&) override { places.push_back(where); }
    std::vector<Place> places;
  } written;
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  const ActorId other = scheduler->add_actor("b");
  scheduler->keep(&written);
  std::vector<Place> executed;
  scheduler->on_delivery(other, [&](const mission::Delivery&) { executed.push_back(scheduler->place()); });
  ASSERT_TRUE(scheduler->inject(actor, [&] { executed.push_back(scheduler->place()); }));
  scheduler->enter(other, {});
  ASSERT_TRUE(scheduler->inject(actor, [&] {
    executed.push_back(scheduler->place());
    scheduler->stop();
  }));
  scheduler->set_pace({.factor = 1});
  EXPECT_EQ(scheduler->run(), std::nullopt);
  ASSERT_EQ(executed.size(), 3U);
  EXPECT_EQ(executed[0].when, executed[2].when);
  EXPECT_LT(executed[0], executed[1]);
  EXPECT_LT(executed[1], executed[2]);
  EXPECT_THAT(written.places, ElementsAre(executed[1]));
}

TEST(VirtualScheduler, SaysHowFarItIsBehindTheClock) {
  const auto scheduler = make_virtual_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  std::vector<Duration> told;
  scheduler->on_behind([&](Duration behind) { told.push_back(behind); });
  scheduler->set_pace({.factor = 1});
  // Twice something takes longer than the run may catch up with.
  for (const int ms : {0, 10}) {
    scheduler->at(actor, TimePoint(milliseconds(ms)), mission::Rank::kTimer, [] {
      const auto until = std::chrono::steady_clock::now() + milliseconds(300);
      while (std::chrono::steady_clock::now() < until) {
      }
    });
  }
  scheduler->at(actor, TimePoint(milliseconds(20)), mission::Rank::kTimer, [&] { scheduler->stop(); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  ASSERT_GE(told.size(), 2U);
  EXPECT_GE(told.front(), milliseconds(250));
  EXPECT_GE(told.back(), told.front() + milliseconds(250));
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

// Set once, waited for by anybody.
class Signal {
 public:
  void set() {
    const std::lock_guard lock(mutex_);
    set_ = true;
    changed_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return set_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool set_ = false;
};

TEST(RealScheduler, ATaskMayWaitForWhatItPosted) {
  const auto scheduler = make_real_scheduler();
  constexpr int kDepth = 5;
  std::vector<ActorId> actors;
  for (int i = 0; i <= kDepth; ++i) actors.push_back(scheduler->add_actor(std::to_string(i)));
  std::vector<Signal> done(kDepth + 1);
  // Each waits for the next, so that all but the last occupy a thread.
  std::function<void(int)> go = [&](int depth) {
    if (depth < kDepth) {
      scheduler->post(actors[depth + 1], [&, depth] { go(depth + 1); });
      done[depth + 1].wait();
    }
    done[depth].set();
    if (depth == 0) scheduler->stop();
  };
  scheduler->post(actors[0], [&] { go(0); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
}

TEST(RealScheduler, KeepsTimeWhileActorsAreBusy) {
  const auto scheduler = make_real_scheduler();
  const ActorId busy = scheduler->add_actor("busy");
  const ActorId other = scheduler->add_actor("other");
  Signal rang;
  scheduler->post(busy, [&] {
    scheduler->at(other, scheduler->now() + milliseconds(2), mission::Rank::kTimer, [&] { rang.set(); });
    rang.wait();
    scheduler->stop();
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
}

TEST(RealScheduler, WhoeverIsToldComesFirstAndTheBackgroundLast) {
  // On a machine that is busy with other things another thread may help out, in its own order; not every time.
  for (std::vector<std::string> order; order != std::vector<std::string>{"told", "own", "background"};) {
    const auto scheduler = make_real_scheduler();
    const ActorId teller = scheduler->add_actor("teller");
    const ActorId told = scheduler->add_actor("told");
    const ActorId background = scheduler->add_actor("background", Urgency::kBackground);
    std::mutex mutex;
    order.clear();
    const auto note = [&](const std::string& what) {
      return [&, what] {
        const std::lock_guard lock(mutex);
        order.push_back(what);
        if (order.size() == 3) scheduler->stop();
      };
    };
    scheduler->post(teller, [&] {
      scheduler->post(background, note("background"));
      scheduler->post(teller, note("own"));
      scheduler->post(told, note("told"));
    });
    EXPECT_EQ(scheduler->run(), std::nullopt);
  }
}

TEST(RealScheduler, AThreadThatHandsOverExecutesItself) {
  const auto scheduler = make_real_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  const ActorId other = scheduler->add_actor("b");
  std::thread running([&] { (void)scheduler->run(); });
  Signal began;
  scheduler->post(actor, [&] { began.set(); });
  began.wait();
  // The actor may be a moment from being idle; what it is handed then is done by another thread.
  std::deque<Signal> followed;
  for (std::thread::id where{}; where != std::this_thread::get_id();) {
    Signal& done = followed.emplace_back();
    scheduler->hand_over(actor, [&] {
      where = std::this_thread::get_id();
      scheduler->post(other, [&] { done.set(); });
    });
    done.wait();
  }
  scheduler->stop();
  running.join();
}

TEST(RealScheduler, LosesNothingAmongManyThreads) {
  const auto scheduler = make_real_scheduler();
  constexpr int kActors = 6;
  constexpr int kThreads = 3;
  constexpr int kChains = 400;
  constexpr int kSteps = 20;
  struct State {
    ActorId actor = 0;
    std::atomic<bool> inside = false;
  };
  std::vector<State> states(kActors);
  for (State& state : states) state.actor = scheduler->add_actor("actor");
  std::atomic<int> overlaps = 0;
  std::atomic<int> ended = 0;
  std::function<void(int, int, int)> step = [&](int at, int stride, int left) {
    State& state = states[at];
    if (state.inside.exchange(true)) ++overlaps;
    const int next = (at + stride) % kActors;
    if (left > 0 && left % 7 == 0) {
      scheduler->at(states[next].actor, scheduler->now(), mission::Rank::kTimer,
                    [&, next, stride, left] { step(next, stride, left - 1); });
    } else if (left > 0) {
      scheduler->post(states[next].actor, [&, next, stride, left] { step(next, stride, left - 1); });
    }
    state.inside = false;
    if (left == 0 && ++ended == kThreads * kChains) scheduler->stop();
  };
  std::thread running([&] { EXPECT_EQ(scheduler->run(), std::nullopt); });
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0; i < kChains; ++i) {
        const int at = (i + thread) % kActors;
        const auto task = [&, at, thread] { step(at, thread + 1, kSteps); };
        if (i % 2 == 0)
          scheduler->hand_over(states[at].actor, task);
        else
          scheduler->post(states[at].actor, task);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  running.join();
  EXPECT_EQ(overlaps, 0);
  EXPECT_EQ(ended, kThreads * kChains);
}

TEST(RealScheduler, StretchesTimeByItsFactor) {
  const auto scheduler = make_real_scheduler(1000.0);
  const ActorId actor = scheduler->add_actor("a");
  const auto began = std::chrono::steady_clock::now();
  TimePoint fired{};
  scheduler->at(actor, TimePoint(std::chrono::seconds(20)), mission::Rank::kTimer, [&] {
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
    scheduler->at(actor, TimePoint(std::chrono::hours(1)), mission::Rank::kTimer, [] {});
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
  scheduler->at(actor, TimePoint(milliseconds(1)), mission::Rank::kMessage, [&] {
    scheduler->set_pace({.paused = true, .factor = 0});
    note("last of the instant")();
  });
  scheduler->at(actor, TimePoint(milliseconds(1)), mission::Rank::kTimer, note("timer"));
  scheduler->at(actor, TimePoint(milliseconds(2)), mission::Rank::kTimer, [&] { scheduler->stop(); });
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
    scheduler->at(actor, TimePoint(milliseconds(50 * i)), mission::Rank::kTimer, [&] {
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
      EXPECT_LE(seconds(scheduler->now()), wall.count() * kFactor);
      EXPECT_EQ(scheduler->view_time(), scheduler->now());
    });
  }
  scheduler->at(actor, TimePoint(milliseconds(1000)), mission::Rank::kTick, [&] { scheduler->stop(); });
  EXPECT_EQ(scheduler->run(), std::nullopt);
}

TEST(RealScheduler, StandsWhilePausedAndTakesInCommands) {
  const auto scheduler = make_real_scheduler(1000.0);
  const ActorId actor = scheduler->add_actor("a");
  scheduler->set_pace({.paused = true, .factor = 1000.0});
  EXPECT_TRUE(scheduler->standing());
  bool fired = false;
  scheduler->at(actor, TimePoint(milliseconds(1)), mission::Rank::kTimer, [&] {
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

TEST(RealScheduler, IsSettledOnceAllThatIsDueIsDoneWhileTimeStands) {
  const auto scheduler = make_real_scheduler();
  const ActorId asking = scheduler->add_actor("asking");
  const ActorId other = scheduler->add_actor("other");
  const ActorId told = scheduler->add_actor("told", Urgency::kBackground);
  std::atomic<int> done = 0;
  std::atomic<bool> rang = false;
  scheduler->at(other, TimePoint(std::chrono::hours(1)), mission::Rank::kTimer, [&] { rang = true; });
  scheduler->post(asking, [&] {
    scheduler->hold();
    const TimePoint held = scheduler->now();
    // What is due, each told by the one before.
    scheduler->at(other, held, mission::Rank::kTimer, [&] {
      ++done;
      scheduler->post(told, [&] { ++done; });
    });
    scheduler->at(other, held + Duration(1), mission::Rank::kTimer, [&] {
      rang = true;
      scheduler->stop();
    });
    EXPECT_TRUE(scheduler->settle(asking, std::chrono::minutes(1)));
    EXPECT_EQ(done, 2);
    EXPECT_FALSE(rang);
    EXPECT_EQ(scheduler->now(), held);
    scheduler->go_on();
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_TRUE(rang);
}

TEST(RealScheduler, SaysWhoDoesNotSettle) {
  const auto scheduler = make_real_scheduler();
  const ActorId asking = scheduler->add_actor("asking");
  const ActorId busy = scheduler->add_actor("busy");
  Signal asked;
  scheduler->post(busy, [&] { asked.wait(); });
  scheduler->post(asking, [&] {
    scheduler->hold();
    const auto settled = scheduler->settle(asking, milliseconds(5));
    ASSERT_FALSE(settled);
    EXPECT_EQ(settled.error().code, "run.cannot-carry");
    EXPECT_EQ(settled.error().message.find("busy is still at work"), 0U) << settled.error().message;
    asked.set();
    EXPECT_TRUE(scheduler->settle(asking, std::chrono::minutes(1)));
    scheduler->stop();
    const auto ended = scheduler->settle(asking, std::chrono::minutes(1));
    ASSERT_FALSE(ended);
    EXPECT_EQ(ended.error().code, "run.ended");
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
}

TEST(RealScheduler, IsLookedAtOnlyWhileNobodyElseIsAtWork) {
  const auto scheduler = make_real_scheduler();
  const ActorId asking = scheduler->add_actor("asking");
  const ActorId other = scheduler->add_actor("other");
  std::atomic<bool> looking = false;
  std::atomic<bool> done = false;
  const auto look = [&] {
    looking = true;
    const TimePoint before = scheduler->now();
    // A call elsewhere is answered meanwhile, and another one's time has come.
    std::thread([&] {
      scheduler->hand_over(other, [&] {
        EXPECT_FALSE(looking);
        done = true;
        scheduler->stop();
      });
    }).join();
    const auto until = std::chrono::steady_clock::now() + milliseconds(2);
    while (std::chrono::steady_clock::now() < until) EXPECT_FALSE(done);
    EXPECT_EQ(scheduler->now(), before);
    looking = false;
  };
  scheduler->post(asking, [&] {
    scheduler->post(other, [&] {
      scheduler->post(asking, [&] {
        const TimePoint before = scheduler->now();
        scheduler->at(other, before + milliseconds(1), mission::Rank::kTimer, [&] { EXPECT_FALSE(looking); });
        while (!scheduler->look_at_rest(asking, look)) {
        }                                                       // while the other one ends its task
        EXPECT_GE(scheduler->now() - before, milliseconds(2));  // as if it had not stood
      });
    });
    EXPECT_FALSE(scheduler->look_at_rest(asking, [] { ADD_FAILURE() << "somebody has something to do"; }));
  });
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_TRUE(done);
}

TEST(RealScheduler, GoesOnFromWhatAnotherOneHadToDeliverEachOnce) {
  constexpr std::size_t kLeaves = 3;
  mission::State state;
  using Taken = std::vector<std::pair<std::size_t, std::uint64_t>>;
  // Each tells the number of the tick that it is given.
  const auto takes = [](Scheduler& scheduler, std::size_t leaf, std::mutex& mutex, Taken& taken, std::size_t all) {
    const ActorId actor = scheduler.add_actor(std::to_string(leaf));
    scheduler.on_delivery(actor, [&, leaf, all](mission::Delivery what) {
      const std::lock_guard lock(mutex);
      taken.emplace_back(leaf, std::get<mission::TickSkill>(std::get<mission::SkillDelivery>(what.what)).tick);
      if (taken.size() == all) scheduler.stop();
    });
    return actor;
  };
  const auto tick = [](std::size_t leaf, std::uint64_t number) {
    return mission::Delivery{leaf, mission::SkillDelivery(mission::TickSkill{number, false, {}})};
  };
  std::mutex mutex;
  Taken before;
  {
    const auto scheduler = make_real_scheduler();
    std::vector<ActorId> actors;
    for (std::size_t leaf = 0; leaf < kLeaves; ++leaf) actors.push_back(takes(*scheduler, leaf, mutex, before, 1000));
    const ActorId asking = scheduler->add_actor("asking");
    for (std::size_t leaf = 0; leaf < kLeaves; ++leaf) {
      // Two of one instant, the later one of the higher rank first.
      scheduler->at(actors[leaf], TimePoint(std::chrono::hours(1)), mission::Rank::kTimer, tick(leaf, 4));
      scheduler->at(actors[leaf], TimePoint(std::chrono::hours(1)), mission::Rank::kMessage, tick(leaf, 2));
      scheduler->at(actors[leaf], TimePoint(std::chrono::hours(1)), mission::Rank::kMessage, tick(leaf, 3));
    }
    scheduler->at(asking, TimePoint(std::chrono::hours(2)), mission::Rank::kTimer, [] { FAIL() << "is no delivery"; });
    scheduler->at(asking, TimePoint(milliseconds(1)), mission::Rank::kTimer, [&] {
      scheduler->hold();
      for (std::size_t leaf = 0; leaf < kLeaves; ++leaf) scheduler->post(actors[leaf], tick(leaf, 1));
      ASSERT_TRUE(scheduler->settle(asking, std::chrono::minutes(1)));
      scheduler->save(state);
      scheduler->stop();
    });
    EXPECT_EQ(scheduler->run(), std::nullopt);
  }
  EXPECT_EQ(before.size(), kLeaves);
  EXPECT_EQ(state.queue.size(), 3 * kLeaves);
  EXPECT_GE(state.now, TimePoint(milliseconds(1)));
  EXPECT_LT(state.now, TimePoint(std::chrono::hours(1)));

  Taken after;
  const auto scheduler = make_real_scheduler(1e7);
  std::vector<ActorId> actors;
  for (std::size_t leaf = 0; leaf < kLeaves; ++leaf)
    actors.push_back(takes(*scheduler, leaf, mutex, after, 3 * kLeaves));
  scheduler->load(state, [&](const mission::Delivery& what) { return actors[what.leaf]; });
  EXPECT_EQ(scheduler->now(), state.now);
  EXPECT_EQ(scheduler->run(), std::nullopt);
  EXPECT_GE(scheduler->now(), TimePoint(std::chrono::hours(1)));
  for (std::size_t leaf = 0; leaf < kLeaves; ++leaf) {
    std::vector<std::uint64_t> ticks;
    for (const auto& [of, number] : after)
      if (of == leaf) ticks.push_back(number);
    EXPECT_EQ(ticks, (std::vector<std::uint64_t>{2, 3, 4})) << "leaf " << leaf;
  }
}

TEST(RealScheduler, GoesOnWhereItWasAtAnotherSpeed) {
  const auto scheduler = make_real_scheduler();
  const ActorId actor = scheduler->add_actor("a");
  // An hour of run time, which only the new speed makes short.
  scheduler->at(actor, TimePoint(std::chrono::hours(1)), mission::Rank::kTimer, [&] { scheduler->stop(); });
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
