#include "sentree/runtime/steering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/runtime/detail/steering_fixture.h"

namespace sentree::runtime {
namespace {

using namespace project::intervention;

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

using State = Steering::State;

TEST(Steering, BeginsPausedWithNothingDone) {
  SteeredRunFixture run(recharge_scenario("normal"));
  EXPECT_EQ(run.steering().wait_paused().state, State::kPaused);
  EXPECT_TRUE(run.messages.empty());
  EXPECT_EQ(run.steering().time(), TimePoint());
  run.finish();
  EXPECT_EQ(run.report.mission, bt::Status::kSuccess);
  EXPECT_EQ(run.steering().status().state, State::kEnded);
}

TEST(Steering, StepsOneTickAtATime) {
  SteeredRunFixture run(recharge_scenario("normal"));
  for (std::size_t tick = 1; tick <= 5; ++tick) {
    EXPECT_EQ(run.step().state, State::kPaused);
    EXPECT_EQ(run.count("mission.tick"), tick);
  }
  run.step(7);
  EXPECT_EQ(run.count("mission.tick"), 12U);
  EXPECT_EQ(run.messages.back().tick, 12U);
}

TEST(Steering, OwesEachStepThatWasAskedFor) {
  SteeredRunFixture run(recharge_scenario("normal"));
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) EXPECT_TRUE(run.steering().step(1).has_value());
  while (run.steering().time() < TimePoint(milliseconds(100 * (kSteps - 1)))) run.steering().wait_paused();
  EXPECT_EQ(run.steering().wait_paused().state, State::kPaused);
  EXPECT_EQ(run.count("mission.tick"), static_cast<std::size_t>(kSteps));
}

TEST(Steering, RunsUntilEverythingBeforeATimeHasHappened) {
  SteeredRunFixture run(recharge_scenario("normal"));
  EXPECT_EQ(run.run_until(milliseconds(1000)).state, State::kPaused);
  // Ticks at 0, 100, … 900 ms; the one at 1000 ms is not before it.
  EXPECT_EQ(run.count("mission.tick"), 10U);
  EXPECT_EQ(run.steering().time(), TimePoint(milliseconds(1000)));
  run.run_until(milliseconds(1001));
  EXPECT_EQ(run.count("mission.tick"), 11U);
}

TEST(Steering, LeavesNoTraceOfPauses) {
  SteeredRunFixture straight(recharge_scenario("experiment1"));
  straight.finish();
  SteeredRunFixture paused(recharge_scenario("experiment1"));
  paused.step(3);
  EXPECT_TRUE(paused.steering().pause().has_value());
  EXPECT_TRUE(paused.steering().pause().has_value());  // twice is once
  paused.run_until(seconds(15));
  EXPECT_TRUE(paused.steering().set_factor(1000).has_value());
  paused.step(5);
  EXPECT_TRUE(paused.steering().set_factor(0).has_value());
  paused.finish();
  EXPECT_TRUE(straight.log() == paused.log()) << "a paused run is another run";
}

TEST(Steering, StepsToTheEndAndThenSaysSo) {
  project::Scenario scenario = recharge_scenario("normal");
  scenario.duration = seconds(2);
  SteeredRunFixture run(std::move(scenario));
  EXPECT_EQ(run.step(1000).state, State::kEnded);
  const auto refused = run.steering().step(1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, "steering.ended");
  EXPECT_EQ(run.steering().pause().error().code, "steering.ended");
  EXPECT_EQ(run.steering().apply(Call{"simulation.plugIn", Map()}).error().code, "steering.ended");
  EXPECT_EQ(run.steering().run_until(TimePoint(seconds(5))).error().code, "steering.ended");
}

TEST(Steering, CallsATestControlWhilePausedAndItIsObserved) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(seconds(3));
  const auto outcome = run.steering().apply(Call{"simulation.setBatteryCharge", Map{{"percent", 10.0}}});
  ASSERT_TRUE(outcome.has_value()) << to_string(outcome.error());
  EXPECT_TRUE(outcome->outcome.ok) << outcome->outcome.message;
  EXPECT_EQ(run.messages.back().name, "scenario.injection");
  EXPECT_EQ(run.messages.back().source, "studio");
  EXPECT_EQ(run.messages.back().time, TimePoint(seconds(3)));
  EXPECT_EQ(run.steering().status().state, State::kPaused);
  run.finish();
  EXPECT_TRUE(run.report.any_violated());
}

TEST(Steering, RefusesASpeedOutOfBounds) {
  SteeredRunFixture run(recharge_scenario("normal"));
  for (const double factor : {-1.0, 1e-6, 1e6}) {
    const auto refused = run.steering().set_factor(factor);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "steering.factor");
    EXPECT_THAT(refused.error().message, HasSubstr("from 0.001 to 1000"));
  }
}

TEST(Steering, RefusesARunsOwnThread) {
  RunOptions options;
  Steering* steering = nullptr;
  std::string code;
  options.on_begin = [&](RunInside& inside) { steering = &inside.steering(); };
  options.listeners.push_back([&](const Message& message) {
    if (message.name == "mission.tick" && message.tick == 1)
      code = steering->apply(Call{"simulation.plugIn", Map()}).error().code;
  });
  SteeredRunFixture run(recharge_scenario("normal"), std::move(options));
  run.step(2);
  EXPECT_EQ(code, "steering.inside");
}

TEST(Steering, StopsAPausedMissionInOrder) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(seconds(3));
  EXPECT_TRUE(run.steering().apply(Stop{}).has_value());
  EXPECT_EQ(run.steering().wait_paused().state, State::kEnded);
  EXPECT_GT(run.count("GoToKitchen.halt.reply"), 0U);
}

TEST(Steering, AnInterruptHaltsAPausedMission) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(seconds(3));
  run.run().interrupt();
  EXPECT_EQ(run.steering().wait_paused().state, State::kEnded);
  EXPECT_GT(run.count("GoToKitchen.halt.reply"), 0U);
}

}  // namespace
}  // namespace sentree::runtime
