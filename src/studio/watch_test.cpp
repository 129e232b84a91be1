#include "sentree/studio/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "sentree/bt/load.h"
#include "sentree/groot/client.h"
#include "sentree/groot/publisher.h"

namespace sentree::studio {
namespace {

using namespace project::intervention;

using ::testing::HasSubstr;

struct Waiting {
  static bt::Status on_start(bt::Context&) { return bt::Status::kRunning; }
  static bt::Status on_running(bt::Context&) { return bt::Status::kRunning; }
};

// Another program, which ticks a tree, and somebody who watches it.
class WatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!groot::is_built()) GTEST_SKIP() << "built without ZeroMQ";
    registry.action("Count", [](bt::Context&) { return bt::Status::kSuccess; });
    registry.add<Waiting>("Wait");
    auto tree = bt::load(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><ReactiveSequence name="all">
        <Script code="n := 7"/><Count/><Wait name="wait"/></ReactiveSequence></BehaviorTree></root>)",
                         {.registry = &registry});
    ASSERT_TRUE(tree.ok());
    executor = std::make_unique<exec::Executor>(std::move(*tree.value),
                                                exec::ExecutorOptions{.period = std::chrono::milliseconds(1)});
    auto started = groot::Publisher::start(*executor, {.port = 0});
    ASSERT_TRUE(started.has_value()) << to_string(started.error());
    publisher = std::move(*started);
    auto found = Watch::start("zmq://127.0.0.1:" + std::to_string(publisher->server().ports().groot2));
    ASSERT_TRUE(found.has_value()) << to_string(found.error());
    watch = std::move(*found);
    listeners.observations.emplace_back([this](const Message& message) {
      note(message.name + " " + message.source + " " +
           std::string(message.data.find("to") != nullptr ? message.data.find("to")->text() : ""));
    });
    listeners.blackboard = [this](TimePoint, const Value& entries) { note(to_json(entries)); };
    program = std::thread([this] { result = executor->run(); });
    follower = std::thread([this] { report = watch->follow(listeners); });
  }
  void TearDown() override {
    if (watch) watch->stop();
    if (follower.joinable()) follower.join();
    if (publisher) publisher->let_go();
    if (executor) executor->halt();
    if (program.joinable()) program.join();
  }
  void note(std::string what) {
    const std::lock_guard lock(mutex);
    seen.insert(std::move(what));
    changed.notify_all();
  }
  bool comes(const std::string& what) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(20), [&] { return seen.contains(what); });
  }
  bt::Registry registry;
  std::unique_ptr<exec::Executor> executor;
  std::unique_ptr<groot::Publisher> publisher;
  std::unique_ptr<Watch> watch;
  WatchListeners listeners;
  runtime::RunReport report;
  bt::Status result = bt::Status::kIdle;
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::string> seen;
  std::thread program;
  std::thread follower;
};

TEST_F(WatchTest, SeesTreeStatusesAndBlackboard) {
  EXPECT_EQ(watch->plan().tree.id(), "Main");
  EXPECT_EQ(watch->plan().tree.size(), 4u);
  EXPECT_TRUE(comes("node.status wait RUNNING"));
  EXPECT_TRUE(comes("node.status Count SUCCESS"));
  EXPECT_TRUE(comes("mission.tick mission "));
  EXPECT_TRUE(comes(R"({"":{"n":7}})"));
  TearDown();
  EXPECT_EQ(report.mission, bt::Status::kRunning);
  EXPECT_GT(report.observations, 0u);
}

TEST_F(WatchTest, StopsTheProgramAtABreakpointAndLetsItGoOn) {
  runtime::Steering& steering = watch->steering();
  const auto id = steering.apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "Count"});
  ASSERT_TRUE(id.has_value()) << to_string(id.error());
  EXPECT_EQ(steering.wait_paused().stopped_at, "before Count");
  EXPECT_TRUE(comes("scenario.breakpoint scenario "));
  EXPECT_TRUE(comes("scenario.injection studio "));
  EXPECT_EQ(steering.standing().size(), 1u);
  EXPECT_EQ(steering.apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "Count"}).error().code,
            "steering.taken");
  EXPECT_TRUE(steering.resume().has_value());
  EXPECT_EQ(steering.wait_paused().breakpoint, id->id);  // it is reached in the next tick too
  EXPECT_TRUE(steering.apply(Clear{id->id}).has_value());
  EXPECT_EQ(steering.status().state, runtime::Steering::State::kRunning);
  EXPECT_EQ(steering.apply(Clear{id->id}).error().code, "steering.unknown-id");
}

TEST_F(WatchTest, ForcesAResult) {
  EXPECT_TRUE(comes("node.status wait RUNNING"));
  runtime::Steering& steering = watch->steering();
  ASSERT_TRUE(steering.apply(Force{"Count", "FAILURE"}).has_value());
  program.join();
  EXPECT_EQ(result, bt::Status::kFailure);
  EXPECT_TRUE(comes("node.status all FAILURE"));
}

TEST_F(WatchTest, RefusesWhatAPublisherCannotDo) {
  runtime::Steering& steering = watch->steering();
  EXPECT_EQ(steering.pause().error().code, "steering.elsewhere");
  EXPECT_EQ(steering.step().error().code, "steering.elsewhere");
  EXPECT_EQ(steering.apply(Breakpoint{.target = "*"}).error().code, "steering.elsewhere");
  EXPECT_EQ(steering.apply(Force{"Count", "RUNNING"}).error().code, "steering.elsewhere");
  EXPECT_EQ(steering.apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "nobody"}).error().code,
            "steering.unknown-node");
}

TEST_F(WatchTest, TakesItsBreakpointsAwayWhenItEnds) {
  ASSERT_TRUE(watch->steering().apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "Count"}).has_value());
  EXPECT_EQ(watch->steering().wait_paused().state, runtime::Steering::State::kPaused);
  watch->stop();
  follower.join();
  auto other = groot::Client::connect("127.0.0.1:" + std::to_string(publisher->server().ports().groot2));
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ((*other)->ask(groot::Ask::kDumpHooks)->body, "[]");
  EXPECT_EQ(watch->steering().wait_paused().state, runtime::Steering::State::kEnded);
}

TEST(WatchedMission, IsNotExecutedHere) {
  if (!groot::is_built()) GTEST_SKIP() << "built without ZeroMQ";
  bt::Tree tree = std::move(
      *bt::load(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Do" when="{t}"/></BehaviorTree></root>)",
                {.partial = true})
           .value);
  groot::Scene scene;
  scene.begin(*groot::describe(tree), groot::TreeId{1});
  const auto server = groot::Server::start(scene, nullptr, {.port = 0});
  ASSERT_TRUE(server.has_value());
  const auto watch = Watch::start("127.0.0.1:" + std::to_string((*server)->ports().groot2));
  ASSERT_TRUE(watch.has_value()) << to_string(watch.error());
  runtime::Run run((*watch)->plan(), {});
  EXPECT_THAT(run.execute().error, HasSubstr("not here"));
  // Another tree ends the following.
  scene.begin(*groot::describe(tree), groot::TreeId{2});
  (void)(*watch)->follow({});
  EXPECT_TRUE((*watch)->other_tree());
}

}  // namespace
}  // namespace sentree::studio
