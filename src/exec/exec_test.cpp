#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "sentree/bt/load.h"
#include "sentree/exec/coroutine_action.h"
#include "sentree/exec/executor.h"
#include "sentree/exec/threaded_action.h"

namespace sentree::exec {
namespace {

using bt::Status;
using std::chrono::hours;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

bt::Tree tree(const std::string& body, const bt::Registry& registry) {
  auto loaded = bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\">" + body + "</BehaviorTree></root>",
                         {.registry = &registry});
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  return std::move(*loaded.value);
}

/// Opened once, by anybody; waiting for it takes as long as that takes.
class Gate {
 public:
  void open() { promise_.set_value(); }
  void wait() const { opened_.wait(); }

 private:
  std::promise<void> promise_;
  std::shared_future<void> opened_ = promise_.get_future().share();
};

/// Counts wake-ups; `wait(n)` returns when there were n.
class Wakes {
 public:
  void operator()() {
    const std::lock_guard lock(mutex_);
    ++count_;
    changed_.notify_all();
  }
  void wait(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_ >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int count_ = 0;
};

bt::Runner runner(const std::string& body, const bt::Registry& registry, Wakes& wakes) {
  bt::Runner made(tree(body, registry));
  made.effects().waker = [&wakes] { wakes(); };
  return made;
}

struct Pose {
  double x = 0;
};

TEST(ThreadedAction, RunsBesideTheTreeWakesItAndWritesItsOutputs) {
  bt::Registry registry;
  Gate gate;
  threaded_action(registry, std::make_shared<Threads>(), "Double",
                  {bt::input<double>("in"), bt::input<Pose>("from"), bt::output<double>("out"), bt::output<Pose>("to")},
                  [&](Job& job) {
                    gate.wait();
                    job.output("out", 2 * job.input<double>("in").value());
                    job.output("to", Pose{job.input<Pose>("from")->x + 1});
                    return Status::kSuccess;
                  });
  registry.action("Here", {bt::output<Pose>("pose")},
                  [](bt::Context& self) { return self.output("pose", Pose{5}) ? Status::kSuccess : Status::kFailure; });
  double reached = 0;
  registry.action("See", {bt::input<Pose>("pose")}, [&](bt::Context& self) {
    reached = self.input<Pose>("pose")->x;
    return Status::kSuccess;
  });
  Wakes wakes;
  bt::Runner r = runner(
      "<Sequence><Here pose=\"{a}\"/><Double in=\"21\" from=\"{a}\" out=\"{answer}\" to=\"{b}\"/><See "
      "pose=\"{b}\"/></Sequence>",
      registry, wakes);
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kRunning);
  gate.open();
  wakes.wait(1);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(*bt::entry(r.tree(), r.state(), "answer"), Value(42.0));
  EXPECT_EQ(reached, 6);
}

TEST(ThreadedAction, FailsTheTickWithTheTextOfAnException) {
  bt::Registry registry;
  threaded_action(registry, std::make_shared<Threads>(), "Throw", {},
                  [](Job&) -> Status { throw std::runtime_error("no plan"); });
  Wakes wakes;
  bt::Runner r = runner("<Throw/>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kRunning);
  wakes.wait(1);
  EXPECT_EQ(r.tick(), Status::kFailure);
  ASSERT_TRUE(r.error());
  EXPECT_THAT(r.error()->message, HasSubstr("no plan"));
}

TEST(ThreadedAction, SaysWhatIsWrongWithAnInput) {
  bt::Registry registry;
  std::vector<std::string> codes;
  threaded_action(registry, std::make_shared<Threads>(0), "Read", {bt::input("n"), bt::input<double>("m")},
                  [&](Job& job) {
                    codes = {job.input<int>("n").error().code, job.input<double>("m").error().code};
                    EXPECT_EQ(job.input_or("m", 1.5), 1.5);
                    return Status::kSuccess;
                  });
  Wakes wakes;
  bt::Runner r = runner("<Read n=\"many\"/>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_THAT(codes, ElementsAre("exec.conversion", "exec.no-input"));
}

TEST(ThreadedAction, IsAskedToStopWhenHaltedAndStartsAnewWhenItHas) {
  bt::Registry registry;
  Gate begun;
  Gate gate;
  std::atomic<int> runs = 0;
  threaded_action(registry, std::make_shared<Threads>(), "Work", {}, [&](Job& job) {
    if (++runs > 1) return Status::kSuccess;
    begun.open();
    EXPECT_FALSE(job.sleep_for(hours(1)));
    EXPECT_TRUE(job.stop_requested());
    gate.wait();
    return Status::kSuccess;
  });
  Wakes wakes;
  bt::Runner r = runner("<Work/>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kRunning);
  begun.wait();
  r.halt();
  EXPECT_EQ(r.tick(), Status::kRunning);  // still on its way out: neither waited for nor started twice
  EXPECT_EQ(r.tick(), Status::kRunning);
  gate.open();
  wakes.wait(1);
  EXPECT_EQ(r.tick(), Status::kRunning);
  wakes.wait(2);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(runs, 2);
}

TEST(ThreadedAction, IsAskedToStopWhenTheLastStateThatWaitsForItIsGone) {
  bt::Registry registry;
  threaded_action(registry, std::make_shared<Threads>(), "Work", {}, [&](Job& job) {
    job.sleep_for(hours(1));
    return Status::kSuccess;
  });
  Wakes wakes;
  bt::Runner r = runner("<Work/>", registry, wakes);
  r.tick();
  bt::State copy = r.state();
  r.state() = bt::State(r.tree());
  copy = bt::State(r.tree());
  wakes.wait(1);
}

TEST(ThreadedAction, ResultIsSharedByCopiesOfTheStateWhichCannotBeSavedMeanwhile) {
  bt::Registry registry;
  Gate gate;
  threaded_action(registry, std::make_shared<Threads>(), "Work", {bt::output<int>("n")}, [&](Job& job) {
    gate.wait();
    job.output("n", 7);
    return Status::kSuccess;
  });
  Wakes wakes;
  bt::Runner r = runner("<Work n=\"{n}\"/>", registry, wakes);
  EXPECT_TRUE(bt::save(r.tree(), r.state()));
  r.tick();
  EXPECT_EQ(bt::save(r.tree(), r.state()).error().code, "bt.unsavable");
  EXPECT_THAT(bt::save(r.tree(), r.state()).error().message,
              HasSubstr("its work is in a thread: save when it is not running, or make it a class with on_start()"));
  bt::State copy = r.state();
  EXPECT_EQ(copy, r.state());
  gate.open();
  wakes.wait(1);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  bt::Effects effects;
  EXPECT_EQ(bt::step(r.tree(), copy, bt::Input::tick(), TimePoint{}, effects).status, Status::kSuccess);
  EXPECT_EQ(*bt::entry(r.tree(), copy, "n"), Value(7));
  EXPECT_EQ(copy, r.state());
  EXPECT_TRUE(bt::save(r.tree(), copy));
}

TEST(ThreadedAction, IsDoneWithinTheTickWhereThereAreNoThreads) {
  bt::Registry registry;
  threaded_action(registry, std::make_shared<Threads>(0), "Work", {bt::output<int>("n")}, [](Job& job) {
    job.output("n", 1);
    return Status::kSuccess;
  });
  Wakes wakes;
  bt::Runner r = runner("<Work n=\"{n}\"/>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kSuccess);
}

TEST(Threads, WorkNoMoreAtATimeThanTheyMay) {
  bt::Registry registry;
  std::mutex mutex;
  int working = 0;
  int most = 0;
  threaded_action(registry, std::make_shared<Threads>(2), "Work", {}, [&](Job& job) {
    {
      const std::lock_guard lock(mutex);
      most = std::max(most, ++working);
    }
    job.sleep_for(milliseconds(1));
    const std::lock_guard lock(mutex);
    --working;
    return Status::kSuccess;
  });
  std::string body = "<Parallel success_count=\"-1\">";
  for (int i = 0; i < 20; ++i) body += "<Work/>";
  Wakes wakes;
  bt::Runner r = runner(body + "</Parallel>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kRunning);
  wakes.wait(20);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_LE(most, 2);
}

TEST(Threads, RefuseMoreJobsThanMayWait) {
  // First: the registry's threads still use them when the test is over.
  Wakes wakes;
  Gate gate;
  bt::Registry registry;
  const auto threads = std::make_shared<Threads>(1);
  threaded_action(registry, threads, "Work", {}, [&](Job&) {
    gate.wait();
    return Status::kSuccess;
  });
  std::string body = "<Parallel>";
  for (std::size_t i = 0; i < Threads::kWaitingMax + 2; ++i) body += "<Work/>";
  bt::Runner r = runner(body + "</Parallel>", registry, wakes);
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_THAT(r.error()->message, HasSubstr("more than 1000 jobs wait for one of 1 threads"));
  gate.open();
}

TEST(CoroutineAction, IsRunningWhileItWaitsAndGoesOnWhereItStood) {
  bt::Registry registry;
  bool arrived = false;
  std::string log;
  coroutine_action(registry, "Deliver", {bt::input<std::string>("to"), bt::output<int>("n")},
                   [&](Coroutine& self) -> Task {
                     log += "to " + self->input_or<std::string>("to", "?") + ";";
                     co_await self.next_tick();
                     log += "on;";
                     co_await self.until([&] { return arrived; });
                     co_await self.sleep(milliseconds(100));
                     log += "there;";
                     if (!self->output("n", 1)) co_return Status::kFailure;
                     co_return Status::kSuccess;
                   });
  bt::Runner r(tree("<Deliver to=\"hall\" n=\"{n}\"/>", registry));
  EXPECT_EQ(r.tick(TimePoint(milliseconds(0))), Status::kRunning);
  EXPECT_EQ(log, "to hall;");
  EXPECT_EQ(r.tick(TimePoint(milliseconds(10))), Status::kRunning);
  EXPECT_EQ(log, "to hall;on;");
  EXPECT_EQ(r.tick(TimePoint(milliseconds(20))), Status::kRunning);
  arrived = true;
  EXPECT_EQ(r.tick(TimePoint(milliseconds(30))), Status::kRunning);
  EXPECT_EQ(r.tick(TimePoint(milliseconds(129))), Status::kRunning);
  EXPECT_EQ(log, "to hall;on;");
  EXPECT_EQ(r.tick(TimePoint(milliseconds(130))), Status::kSuccess);
  EXPECT_EQ(log, "to hall;on;there;");
  EXPECT_EQ(r.tick(TimePoint(milliseconds(140))), Status::kRunning);  // anew
  EXPECT_EQ(log, "to hall;on;there;to hall;");
}

TEST(CoroutineAction, CleansUpWhenHalted) {
  bt::Registry registry;
  int opened = 0;
  struct Gripper {
    explicit Gripper(int& count) : open(count) { ++open; }
    ~Gripper() { --open; }
    int& open;
  };
  coroutine_action(registry, "Hold", {}, [&](Coroutine& self) -> Task {
    const Gripper gripper(opened);
    for (;;) co_await self.next_tick();
  });
  bt::Runner r(tree("<Hold/>", registry));
  r.tick();
  EXPECT_EQ(opened, 1);
  r.halt();
  EXPECT_EQ(opened, 0);
  r.tick();
  EXPECT_EQ(opened, 1);
}

Task twice(Coroutine& self, int& count) {
  for (int i = 0; i < 2; ++i) {
    ++count;
    co_await self.next_tick();
  }
  if (count > 2) throw std::runtime_error("too often");
  co_return Status::kSuccess;
}

TEST(CoroutineAction, MayAwaitOthersWhoseExceptionsPassThrough) {
  bt::Registry registry;
  int count = 0;
  coroutine_action(registry, "Outer", {}, [&](Coroutine& self) -> Task {
    if (co_await twice(self, count) != Status::kSuccess) co_return Status::kFailure;
    co_return co_await twice(self, count);
  });
  bt::Runner r(tree("<Outer/>", registry));
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(count, 2);
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_THAT(r.error()->message, HasSubstr("too often"));
}

TEST(CoroutineAction, SaysSoWhereItCannotGoOn) {
  bt::Registry registry;
  coroutine_action(registry, "Wait", {}, [](Coroutine& self) -> Task {
    co_await self.next_tick();
    co_return Status::kRunning;
  });
  bt::Runner r(tree("<Wait/>", registry));
  EXPECT_TRUE(bt::save(r.tree(), r.state()));
  r.tick();
  EXPECT_EQ(bt::save(r.tree(), r.state()).error().code, "bt.unsavable");
  EXPECT_THAT(bt::save(r.tree(), r.state()).error().message,
              HasSubstr("it is a coroutine on its way: save when it is not running, or make it a class with"));
  bt::State copy = r.state();
  bt::Effects effects;
  EXPECT_EQ(bt::step(r.tree(), copy, bt::Input::tick(), TimePoint{}, effects).kind, bt::StepResult::Kind::kFailed);
  EXPECT_THAT(effects.error->message, HasSubstr("cannot be copied"));
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_THAT(r.error()->message, HasSubstr("returned RUNNING, which is no result"));
}

TEST(Executor, TicksUntilTheRootCompletes) {
  bt::Registry registry;
  int count = 0;
  coroutine_action(registry, "Five", {}, [&](Coroutine& self) -> Task {
    for (; count < 5; ++count) co_await self.next_tick();
    co_return Status::kSuccess;
  });
  Executor executor(tree("<Five/>", registry), {.period = milliseconds(1)});
  EXPECT_EQ(executor.run(), Status::kSuccess);
  EXPECT_EQ(executor.ticks(), 6u);
  EXPECT_EQ(executor.run(), Status::kSuccess);
  EXPECT_EQ(executor.ticks(), 7u);
}

TEST(Executor, IsWokenByANodeATimerAndAThread) {
  bt::Registry registry;
  threaded_action(registry, std::make_shared<Threads>(), "Work", {}, [](Job&) { return Status::kSuccess; });
  Executor executor(tree("<AsyncSequence><AlwaysSuccess/><Sleep msec=\"1\"/><Work/></AsyncSequence>", registry),
                    {.period = hours(1)});
  EXPECT_EQ(executor.run(), Status::kSuccess);
}

TEST(ThreadedAction, WithAnOutputThatNobodyAsksForSucceeds) {
  bt::Registry registry;
  threaded_action(registry, std::make_shared<Threads>(0), "Plan", {bt::output<int>("steps")}, [](Job& job) {
    job.output("steps", 3);
    return Status::kSuccess;
  });
  bt::Runner r(tree("<Plan/>", registry));
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_FALSE(r.error().has_value());
}

TEST(Executor, HaltedByACoroutineHaltsWhenTheTickEnds) {
  bt::Registry registry;
  Executor* at_work = nullptr;
  bool is_gone = false;
  struct Frame {
    bool* is_gone;
    ~Frame() { *is_gone = true; }
  };
  coroutine_action(registry, "Halt", {}, [&](Coroutine& self) -> Task {
    const Frame frame{&is_gone};
    at_work->runner().halt();
    EXPECT_FALSE(is_gone);
    co_await self.next_tick();
    co_return Status::kSuccess;
  });
  Executor executor(tree("<Halt/>", registry));
  at_work = &executor;
  EXPECT_EQ(executor.run(), Status::kIdle);
  EXPECT_TRUE(is_gone);
  EXPECT_FALSE(executor.error().has_value());
}

TEST(Executor, EndsWhenAnotherThreadHaltsIt) {
  bt::Registry registry;
  std::atomic<bool> halted = false;
  struct Forever {
    std::function<void()> started;
    std::atomic<bool>* halted;
    Status on_start(bt::Context&) {
      started();
      return Status::kRunning;
    }
    Status on_running(bt::Context&) { return Status::kRunning; }
    void on_halted(bt::Context&) { *halted = true; }
  };
  Gate started;
  registry.add<Forever>("Forever", Forever{[&] { started.open(); }, &halted});
  Executor executor(tree("<Forever/>", registry), {.period = hours(1)});
  std::thread other([&] {
    started.wait();
    executor.halt();
  });
  EXPECT_EQ(executor.run(), Status::kIdle);
  other.join();
  EXPECT_TRUE(halted);
}

TEST(Executor, SaysWhichNodeHasNotComeBack) {
  bt::Registry registry;
  Gate begun;
  Gate gate;
  registry.action("Hang", [&](bt::Context&) {
    begun.open();
    gate.wait();
    return Status::kSuccess;
  });
  Executor executor(tree("<Sequence><AlwaysSuccess/><Hang name=\"At the door\"/></Sequence>", registry));
  EXPECT_FALSE(executor.pending());
  std::thread runs([&] { executor.run(); });
  begun.wait();
  executor.halt();
  const auto call = executor.pending();
  EXPECT_TRUE(call);
  if (call) {
    EXPECT_EQ(call->path, "At the door");
    EXPECT_EQ(call->id, "Hang");
    EXPECT_GE(call->lasted, Duration(0));
  }
  gate.open();
  runs.join();
  EXPECT_FALSE(executor.pending());
}

TEST(Executor, HaltedBeforeItRunsDoesNotRun) {
  const bt::Registry registry;
  Executor executor(tree("<KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure>", registry));
  executor.halt();
  EXPECT_EQ(executor.run(), Status::kIdle);
  EXPECT_EQ(executor.ticks(), 0u);
}

TEST(Executor, CountsPeriodsThatATickTookLongerThan) {
  bt::Registry registry;
  coroutine_action(registry, "Slow", {}, [](Coroutine& self) -> Task {
    const auto end = std::chrono::steady_clock::now() + milliseconds(5);
    while (std::chrono::steady_clock::now() < end) {
    }
    co_await self.next_tick();
    co_return Status::kSuccess;
  });
  Executor executor(tree("<Slow/>", registry), {.period = milliseconds(1)});
  EXPECT_EQ(executor.run(), Status::kSuccess);
  EXPECT_GE(executor.missed(), 4u);
  EXPECT_EQ(executor.ticks(), 2u);
}

}  // namespace
}  // namespace sentree::exec
