#include "sentree/runtime/stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace sentree::runtime {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

Message named(std::string name) {
  Message message;
  message.name = std::move(name);
  return message;
}

// Runs a real scheduler in a thread as long as it lives.
class Running {
 public:
  explicit Running(Scheduler& scheduler) : scheduler_(scheduler), thread_([this] { (void)scheduler_.run(); }) {}
  ~Running() {
    scheduler_.stop();
    thread_.join();
  }

 private:
  Scheduler& scheduler_;
  std::thread thread_;
};

// The decision, waited for.
class Decision {
 public:
  Stream::Decided told() {
    return [this](mission::Admission admission) {
      const std::lock_guard lock(mutex_);
      ++times_;
      admission_ = std::move(admission);
      changed_.notify_all();
    };
  }
  mission::Admission wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return times_ > 0; });
    return admission_;
  }
  int times() {
    const std::lock_guard lock(mutex_);
    return times_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int times_ = 0;
  mission::Admission admission_;
};

TEST(Stream, JudgesARequestBeforeItIsPublished) {
  const auto scheduler = make_virtual_scheduler();
  Stream stream(*scheduler);
  std::vector<std::string> seen;
  stream.subscribe([&](const Message& message) { seen.push_back(message.name); });
  const Stream::Judge judge = [](const Message& message) {
    return message.name == "bad" ? std::optional(mission::Veto{"shield", "bad"}) : std::nullopt;
  };
  const auto bad = stream.publish_if(named("bad"), judge, kNever, {});
  ASSERT_TRUE(bad);
  ASSERT_TRUE(bad->veto);
  EXPECT_EQ(bad->veto->by, "shield");
  const auto good = stream.publish_if(named("good"), judge, kNever, {});
  ASSERT_TRUE(good);
  EXPECT_FALSE(good->veto);
  EXPECT_THAT(seen, testing::ElementsAre("good"));
}

TEST(Stream, NothingComesBetweenJudgementAndPublication) {
  const auto scheduler = make_real_scheduler();
  Stream stream(*scheduler);
  std::uint64_t last_seen = 0;
  std::uint64_t judged_after = 0;
  int misplaced = 0;
  stream.subscribe([&](const Message& message) {
    if (message.name == "gated" && message.sequence != judged_after + 1) ++misplaced;
    last_seen = message.sequence;
  });
  {
    const Running running(*scheduler);
    constexpr int kRounds = 300;
    std::atomic<int> round = 0;
    std::vector<std::thread> others;
    for (int i = 0; i < 3; ++i) {
      others.emplace_back([&] {
        // A burst around each judgement.
        for (int seen = 0; seen < kRounds;) {
          round.wait(seen);
          seen = round;
          for (int n = 0; n < 20; ++n) stream.publish(named("other"));
        }
      });
    }
    int published = 0;
    std::uint64_t count = 0;
    for (int i = 0; i < kRounds; ++i) {
      Decision decision;
      // Asked while others publish, as a snapshot asks.
      EXPECT_GE(stream.published(), count);
      count = stream.published();
      ++round;
      round.notify_all();
      const auto now = stream.publish_if(
          named("gated"),
          [&](const Message&) {
            judged_after = last_seen;
            return std::optional<mission::Veto>();
          },
          kNever, decision.told());
      EXPECT_FALSE(now);
      published += decision.wait().veto ? 0 : 1;
    }
    for (std::thread& other : others) other.join();
    EXPECT_GT(published, 0);
  }
  stream.flush();
  EXPECT_EQ(misplaced, 0);
}

TEST(Stream, LosesWhatNobodyTakesAndSaysSo) {
  const auto scheduler = make_real_scheduler();
  Stream stream(*scheduler);
  std::mutex mutex;
  std::condition_variable changed;
  bool released = false;
  std::size_t seen = 0;
  std::int64_t told = 0;
  stream.subscribe([&](const Message& message) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return released; });
    if (message.name == "observer.lost") told += *message.data.find("count")->as_int();
    if (message.name == "full") ++seen;
  });
  {
    const Running running(*scheduler);
    // One is being listened to; the others fill the queue.
    while (stream.lost() == 0) stream.publish(named("full"));
    EXPECT_GE(stream.published(), Stream::kPendingMax);
    {
      const std::lock_guard lock(mutex);
      released = true;
    }
    changed.notify_all();
    stream.publish(named("last"));
  }
  stream.flush();
  EXPECT_EQ(told, 1);
  EXPECT_EQ(seen + 1, stream.published() - 2);
}

TEST(Stream, AJudgeThatIsStuckRefuses) {
  const auto scheduler = make_real_scheduler();
  Stream stream(*scheduler);
  std::mutex mutex;
  std::condition_variable changed;
  bool released = false;
  bool published = false;
  stream.subscribe([&](const Message& message) { published = published || message.name == "gated"; });
  {
    const Running running(*scheduler);
    Decision decision;
    stream.publish_if(
        named("gated"),
        [&](const Message&) {
          std::unique_lock lock(mutex);
          changed.wait(lock, [&] { return released; });
          return std::optional<mission::Veto>();
        },
        TimePoint(), decision.told());
    const mission::Admission admission = decision.wait();
    ASSERT_TRUE(admission.veto);
    EXPECT_THAT(admission.veto->reason, HasSubstr("in time"));
    {
      const std::lock_guard lock(mutex);
      released = true;
    }
    changed.notify_all();
    // Whatever the judge says now comes too late: a second request is decided after it.
    Decision second;
    stream.publish_if(
        named("second"), [](const Message&) { return std::optional<mission::Veto>(); }, kNever, second.told());
    EXPECT_FALSE(second.wait().veto);
    EXPECT_EQ(decision.times(), 1);
  }
  stream.flush();
  EXPECT_FALSE(published);
}

}  // namespace
}  // namespace sentree::runtime
