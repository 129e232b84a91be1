#include "sentree/runtime/detail/telemetry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sentree/project/plan.h"
#include "sentree/runtime/inside.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;

struct Seen {
  RunReport report;
  std::vector<Message> messages;

  [[nodiscard]] std::vector<Message> named(const std::string& name) const {
    std::vector<Message> found;
    for (const Message& message : messages) {
      if (message.name == name) found.push_back(message);
    }
    return found;
  }
};

project::Plan plan_of(const char* scenario) {
  auto loaded = project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples/telemetry/scenarios" / scenario);
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

Seen run(const project::Plan& plan, RunOptions options = {}) {
  Seen seen;
  options.listeners.push_back([&](const Message& message) { seen.messages.push_back(message); });
  Run run(plan, std::move(options));
  seen.report = run.execute();
  EXPECT_EQ(seen.report.error, "");
  return seen;
}

TEST(Telemetry, PublishesEachTopicAtItsRate) {
  const Seen seen = run(plan_of("low.yaml"));
  EXPECT_EQ(seen.report.mission, bt::Status::kSuccess);
  const auto battery = seen.named("robot.battery.request");
  const auto position = seen.named("robot.position.request");
  ASSERT_EQ(battery.size(), 12U) << "at 0 s, 0.5 s … 5.5 s";
  ASSERT_EQ(position.size(), 6U);
  for (std::size_t i = 0; i < battery.size(); ++i) {
    EXPECT_EQ(battery[i].source, "sim");
    EXPECT_EQ(battery[i].target, "robot");
    EXPECT_EQ(battery[i].time, TimePoint(i * std::chrono::milliseconds(500)));
  }
  EXPECT_NEAR(battery.back().data.find("args")->find("state")->find("percentage")->number(), 0.25, 0.01);
  EXPECT_TRUE(seen.named("robot.battery.reply").empty());
}

TEST(Telemetry, OfAPartThatIsKilledNothingIsPublished) {
  const auto battery = run(plan_of("silent.yaml")).named("robot.battery.request");
  ASSERT_FALSE(battery.empty());
  EXPECT_LE(battery.back().time, TimePoint(std::chrono::seconds(4)));
}

TEST(Telemetry, GoesOnWhereACopyOfTheRunBegins) {
  const project::Plan plan = plan_of("low.yaml");
  std::optional<mission::State> state;
  RunOptions options;
  options.on_begin = [&](RunInside& inside) {
    inside.scheduler().at(inside.director(), TimePoint(std::chrono::milliseconds(2700)), mission::Rank::kTimer,
                          [&] { state = inside.capture(); });
  };
  const Seen whole = run(plan, std::move(options));
  ASSERT_TRUE(state);
  RunOptions again;
  again.from = &*state;
  const Seen rest = run(plan, std::move(again));
  ASSERT_LT(rest.messages.size(), whole.messages.size());
  const std::size_t before = whole.messages.size() - rest.messages.size();
  for (std::size_t i = 0; i < rest.messages.size(); ++i)
    ASSERT_EQ(to_json(rest.messages[i]), to_json(whole.messages[before + i])) << i;
}

}  // namespace
}  // namespace sentree::runtime
