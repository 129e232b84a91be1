#include "sentree/studio/detail/steering_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <optional>

#include "sentree/studio/detail/test_support.h"
#include "sentree/studio/server.h"

namespace sentree::studio {
namespace {

using testing::ElementsAre;

// What requests "hang" wait for.
class Gate {
 public:
  ~Gate() { open(); }
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    ++arrived_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return is_open_; });
  }
  void await_arrival() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return arrived_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  int arrived_ = 0;
};

// What a queue has done.
class Outcomes {
 public:
  void add(const SteeringQueue::Outcome& outcome) {
    const std::lock_guard lock(mutex_);
    ids_.push_back(outcome.id);
    changed_.notify_all();
  }
  std::vector<std::int64_t> await(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ids_.size() >= count; });
    return ids_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::int64_t> ids_;
};

SteeringQueue::Steer hanging(Gate& gate) {
  return [&gate](const std::string& op, const Value& request) -> Result<Value> {
    if (request.find("hang") != nullptr) gate.pass();
    return Value(op);
  };
}

const Value kHang = Map{{"hang", true}};

TEST(SteeringQueue, PausesWhileACallHangsAndKeepsTheOrderOfTheRest) {
  Gate gate;
  Outcomes outcomes;
  SteeringQueue queue(hanging(gate), [&](const SteeringQueue::Outcome& outcome) { outcomes.add(outcome); });
  queue.put({1, 1, "call", kHang});
  queue.put({1, 2, "call", Map()});
  queue.put({2, 3, "kill", Map()});
  queue.put({1, 4, "pause", Map()});
  queue.put({2, 5, "resume", Map()});
  EXPECT_THAT(outcomes.await(2), ElementsAre(4, 5));
  gate.open();
  EXPECT_THAT(outcomes.await(5), ElementsAre(4, 5, 1, 2, 3));
}

TEST(SteeringQueue, DropsWhatWaitsForAPageThatIsGone) {
  Gate gate;
  Outcomes outcomes;
  SteeringQueue queue(hanging(gate), [&](const SteeringQueue::Outcome& outcome) { outcomes.add(outcome); });
  queue.put({1, 1, "call", kHang});
  gate.await_arrival();
  queue.put({1, 2, "call", Map()});
  queue.put({2, 3, "call", Map()});
  queue.forget(1);
  gate.open();
  EXPECT_THAT(outcomes.await(2), ElementsAre(1, 3));
}

TEST(SteeringQueue, EndsOnceWhatItCarriesOutIsDone) {
  Gate gate;
  Outcomes outcomes;
  {
    SteeringQueue queue(hanging(gate), [&](const SteeringQueue::Outcome& outcome) { outcomes.add(outcome); });
    queue.put({1, 1, "call", kHang});
    gate.await_arrival();
    queue.put({1, 2, "call", kHang});
    gate.open();
  }
  EXPECT_THAT(outcomes.await(0), testing::Contains(1));
}

// A server whose run changes all the time and whose steering may hang.
class HangingRun : public testing::Test {
 protected:
  HangingRun() : plan_(recharge_plan("experiment1", std::chrono::seconds(1))), subject_(plan_), history_(subject_) {
    auto server = Server::start(
        subject_, history_,
        {.update = {}, .facts = [this] { return RunFacts{.missed_ticks = ++looks_}; }, .steer = hanging(gate_)}, {});
    EXPECT_TRUE(server.has_value());
    server_ = std::move(*server);
  }
  ~HangingRun() override { gate_.open(); }

  static std::string request(int id, const std::string& op, const std::string& more = "") {
    return R"({"op":")" + op + R"(","id":)" + std::to_string(id) + more + "}";
  }
  static void expect_deltas(TestClient& page) {
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(page.next("delta").is_null());
  }
  static std::int64_t answered(TestClient& page) {
    const Value answer = page.next("answer");
    return answer.is_null() ? -1 : *answer.find("id")->as_int();
  }

  const project::Plan plan_;
  const Subject subject_;
  History history_;
  std::uint64_t looks_ = 0;  // of the thread that composes
  Gate gate_;
  std::unique_ptr<Server> server_;
};

TEST_F(HangingRun, EveryPageGetsItsDeltasAndAnswers) {
  TestClient one(server_->port());
  TestClient other(server_->port());
  one.send(request(1, "call", R"(,"hang":true)"));
  gate_.await_arrival();
  expect_deltas(one);
  expect_deltas(other);
  one.send(request(2, "layout"));
  EXPECT_EQ(answered(one), 2);
  one.send(request(3, "pause"));
  EXPECT_EQ(answered(one), 3);
  other.send(request(1, "kill"));
  other.send(request(2, "seek", R"(,"time":0)"));
  EXPECT_EQ(answered(other), 2);
  gate_.open();
  EXPECT_EQ(answered(one), 1);
  EXPECT_EQ(answered(other), 1);
}

TEST_F(HangingRun, APageHasNoMoreRequestsWaitingThanTheBound) {
  TestClient page(server_->port());
  page.send(request(1, "call", R"(,"hang":true)"));
  gate_.await_arrival();
  for (std::size_t i = 1; i < kRequestsMax; ++i) page.send(request(static_cast<int>(i) + 1, "call"));
  // All of them wait, and the page is still there.
  expect_deltas(page);
  page.send(request(static_cast<int>(kRequestsMax) + 1, "call"));
  EXPECT_TRUE(page.next("never").is_null());
  TestClient other(server_->port());
  expect_deltas(other);
}

}  // namespace
}  // namespace sentree::studio
