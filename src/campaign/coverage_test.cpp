#include "sentree/campaign/coverage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace sentree::campaign {
namespace {

using ::testing::HasSubstr;

using Kind = Coverage::Kind;

// Runs a scenario of the recharge example.
void run(const std::string& name, Coverage& coverage) {
  auto scenario =
      project::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) / "examples/recharge/scenarios" / name);
  ASSERT_TRUE(scenario.ok());
  auto plan = project::prepare(std::move(*scenario.value));
  ASSERT_TRUE(plan.ok());
  runtime::RunOptions options;
  CoverageWatch watch(*plan.value, coverage, options);
  const auto report = runtime::Run(*plan.value, std::move(options)).execute();
  ASSERT_TRUE(report.error.empty()) << report.error;
  watch.finish(report);
}

// Whether the thing whose name ends so is reached; a failure if there is none, or several.
bool is_reached(const Coverage& coverage, Kind kind, const std::string& of, const std::string& what) {
  std::vector<bool> found;
  for (const auto& [thing, reached] : coverage.things()) {
    if (thing.kind == kind && thing.of.ends_with(of) && thing.what == what) found.push_back(reached);
  }
  EXPECT_EQ(found.size(), 1U) << of << ": " << what;
  return !found.empty() && found.front();
}

TEST(Coverage, IsWhatAllRunsTogetherHaveReached) {
  const std::string kGuard =
      "asking on battery.getBatteryState.reply if _event.data.result.percentage * 100 > threshold → success";
  Coverage coverage;
  run("normal.yaml", coverage);
  EXPECT_TRUE(is_reached(coverage, Kind::kNode, "BatteryLevelAbove30", "SUCCESS"));
  EXPECT_FALSE(is_reached(coverage, Kind::kNode, "BatteryLevelAbove30", "FAILURE"));
  EXPECT_TRUE(is_reached(coverage, Kind::kNode, "GoToKitchen", "RUNNING"));
  EXPECT_FALSE(is_reached(coverage, Kind::kNode, "GoToStation", "RUNNING"));
  EXPECT_TRUE(is_reached(coverage, Kind::kMethod, "battery.getBatteryState", "reply"));
  EXPECT_FALSE(is_reached(coverage, Kind::kMethod, "battery.getBatteryState", "late"));
  EXPECT_TRUE(is_reached(coverage, Kind::kRequirement, "never_empty", ""));
  EXPECT_FALSE(is_reached(coverage, Kind::kRequirement, "turns_to_station", ""));
  EXPECT_TRUE(is_reached(coverage, Kind::kGuard, "BatteryLevelAbove.scxml", kGuard + ": true"));
  EXPECT_FALSE(is_reached(coverage, Kind::kGuard, "BatteryLevelAbove.scxml", kGuard + ": false"));
  const auto before = coverage.all();
  EXPECT_GT(coverage.count(Kind::kTransition).reached, 0U);
  EXPECT_LT(coverage.count(Kind::kTransition).reached, coverage.count(Kind::kTransition).of);
  EXPECT_THAT(coverage.to_text(), HasSubstr("never turns_to_station put to the test"));

  run("recharge.yaml", coverage);
  EXPECT_TRUE(is_reached(coverage, Kind::kNode, "BatteryLevelAbove30", "FAILURE"));
  EXPECT_TRUE(is_reached(coverage, Kind::kNode, "GoToStation", "RUNNING"));
  EXPECT_TRUE(is_reached(coverage, Kind::kRequirement, "turns_to_station", ""));
  EXPECT_TRUE(is_reached(coverage, Kind::kGuard, "BatteryLevelAbove.scxml", kGuard + ": false"));
  EXPECT_EQ(coverage.all().of, before.of);
  EXPECT_GT(coverage.all().reached, before.reached);

  // A chart that replaces another is one more to reach.
  run("experiment2.yaml", coverage);
  EXPECT_GT(coverage.all().of, before.of);
  const Value value = coverage.to_value();
  EXPECT_EQ(value.at({"all", "reached"})->number(), static_cast<double>(coverage.all().reached));
  EXPECT_EQ(value.find("not_reached")->as_list()->size(), coverage.all().of - coverage.all().reached);
}

TEST(Coverage, OfSeveralRunsAddsUp) {
  Coverage together, other;
  run("normal.yaml", together);
  run("no-path.yaml", other);
  const Coverage first = together;
  together.add(other);
  for (const auto& [thing, reached] : together.things()) {
    const bool here = first.things().contains(thing) && first.things().at(thing);
    const bool there = other.things().contains(thing) && other.things().at(thing);
    EXPECT_EQ(reached, here || there) << thing.of << ": " << thing.what;
  }
  EXPECT_GT(together.all().reached, first.all().reached);
}

// States that a chart only passes through are reached too.
TEST(Coverage, OfAChartIsEveryStateOnTheWayOfATransitionTaken) {
  Coverage coverage;
  run("normal.yaml", coverage);
  std::size_t taken = 0;
  for (const auto& [thing, reached] : coverage.things()) {
    if (thing.kind != Kind::kTransition || !reached) continue;
    ++taken;
    const auto arrow = thing.what.rfind("→ ");
    if (arrow == std::string::npos) continue;
    EXPECT_TRUE(is_reached(coverage, Kind::kState, thing.of, thing.what.substr(arrow + std::string("→ ").size())))
        << thing.what;
  }
  EXPECT_GT(taken, 3U);
}

}  // namespace
}  // namespace sentree::campaign
