#include "sentree/campaign/quick_runs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "sentree/base/temporary_folder.h"
#include "sentree/campaign/runner.h"

namespace sentree::campaign {
namespace {

const std::filesystem::path kRecharge = std::filesystem::path(SENTREE_SOURCE_DIR) / "examples" / "recharge";

std::unique_ptr<Runner> runner_of(const std::filesystem::path& vary) {
  auto runner = Runner::load(kRecharge, vary);
  for (const Diagnostic& diagnostic : runner.diagnostics) {
    if (diagnostic.severity == Severity::kError) ADD_FAILURE() << to_string(diagnostic);
  }
  return runner.ok() ? std::move(*runner.value) : nullptr;
}

// As many runs of one campaign, remembered and executed: the rows and the numbers of observations are equal.
void expect_alike(const std::filesystem::path& vary, std::uint64_t campaign, std::uint64_t runs) {
  const auto quick = runner_of(vary);
  const auto whole = runner_of(vary);
  ASSERT_TRUE(quick && whole);
  whole->forgo_memory();
  for (std::uint64_t run = 1; run <= runs; ++run) {
    const std::uint64_t seed = seed_of(campaign, run);
    const Draw draw = quick->drawing().draw(seed);
    const Runner::Executed remembered = quick->execute(draw);
    const Runner::Executed executed = whole->execute(draw);
    EXPECT_EQ(csv_line(quick->row(run, seed, remembered), {}), csv_line(whole->row(run, seed, executed), {}));
    ASSERT_EQ(remembered.report.has_value(), executed.report.has_value()) << "seed " << seed;
    if (!executed.report) continue;
    EXPECT_EQ(remembered.report->observations, executed.report->observations) << "seed " << seed;
    EXPECT_EQ(remembered.report->ended, executed.report->ended) << "seed " << seed;
  }
}

TEST(QuickRuns, SayWhatExecutedRunsSay) { expect_alike(kRecharge / "campaign.yaml", 7, 25); }

// The filter, obstacles and a killed skill, at other times in each run.
TEST(QuickRuns, AlsoWithAFilterAndObstacles) {
  const TemporaryFolder folder("quick");
  const std::filesystem::path vary = folder.path() / "vary.yaml";
  std::ofstream(vary) << R"(duration: 10 min
override:
  world: {localization: {method: amcl}, people: {anna: {plugs_in_at: dock, below: 30 %}}}
parameters:
  world.battery.initial: {uniform: [35 %, 60 %]}
  world.start:           {choice: [start, study, bedroom]}
timeline:
  - {call: simulation.addObstacle, args: {id: box, centre: {x: 9.5, y: 5.0}, radius: 0.2}, at: {uniform: [5 s, 60 s]}}
  - {kill: GoToStation, at: {uniform: [60 s, 90 s]}, probability: 0.3}
)";
  expect_alike(vary, 3, 6);
}

TEST(QuickRuns, KnowTheStepsOfRunsBefore) {
  const auto runner = runner_of(kRecharge / "campaign.yaml");
  ASSERT_TRUE(runner);
  const auto quick = QuickRuns::of(runner->plan());
  ASSERT_TRUE(quick);
  project::Scenario scenario = runner->plan().scenario;
  scenario.timeline.clear();
  ASSERT_TRUE(quick->run(scenario, *runner->plan().world));
  const std::uint64_t first = quick->steps_executed();
  ASSERT_TRUE(quick->run(scenario, *runner->plan().world));
  EXPECT_EQ(quick->steps_executed(), first) << "the same run again";
  for (scenario.seed = 2; scenario.seed < 6; ++scenario.seed) ASSERT_TRUE(quick->run(scenario, *runner->plan().world));
  EXPECT_LT(quick->steps_executed(), 2 * first) << "a chart's steps are few";
}

}  // namespace
}  // namespace sentree::campaign
