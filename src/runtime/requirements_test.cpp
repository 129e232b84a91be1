#include "sentree/project/requirements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "sentree/base/temporary_folder.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kRequirementsExample = std::string(SENTREE_SOURCE_DIR) + "/examples/recharge";

// The recharge mission, watched by the requirements of one file.
class Watched {
 public:
  explicit Watched(const std::string& requirements)
      : file_(std::filesystem::path(testing::TempDir()) /
              (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".req")) {
    std::ofstream(file_) << requirements;
  }
  ~Watched() { std::filesystem::remove(file_); }

  [[nodiscard]] project::Scenario scenario(const std::string& name = "normal") const {
    project::Scenario scenario =
        std::move(*project::load_scenario(kRequirementsExample + "/scenarios/" + name + ".yaml").value);
    scenario.project.monitors.clear();
    scenario.verdicts.clear();
    project::MonitorEntry entry;
    entry.name = file_.stem().string();
    entry.file.path = file_.string();
    scenario.project.monitors = project::expand_requirements(scenario.project, std::move(entry));
    return scenario;
  }
  [[nodiscard]] std::vector<std::string> findings() const {
    std::vector<std::string> all;
    for (const Diagnostic& diagnostic : prepare(scenario()).diagnostics) all.push_back(diagnostic.message);
    return all;
  }

 private:
  std::filesystem::path file_;
};

TEST(Requirements, BecomeAMonitorEach) {
  const Watched watched(
      "let l = reply(battery.getBatteryState).percentage\nlow: always l > 0.2.\nhigh: always l <= 1.\n");
  const auto plan = prepare(watched.scenario());
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  std::vector<std::string> names;
  for (const monitor::Model& model : plan.value->monitors) names.push_back(model.name());
  EXPECT_THAT(names, ElementsAre("low", "high"));
}

TEST(Requirements, AreCheckedAgainstTheProject) {
  EXPECT_THAT(Watched("R: always reply(battery.getBatteryState).percntage > 0.2.\n").findings(),
              ElementsAre(HasSubstr("BatteryState has no member \"percntage\"; did you mean \"percentage\"?")));
  EXPECT_THAT(Watched("R: always reply(battery.getBatteryState).percentage > 20 %.\n").findings(),
              ElementsAre(HasSubstr("is in ratio, 20 % in %; multiply the first by 100")));
  EXPECT_THAT(
      Watched("R: always reply(battery.getBatteryState from BatteryLevelAbov30).percentage > 0.2.\n").findings(),
      ElementsAre(HasSubstr("no leaf \"BatteryLevelAbov30\"; did you mean \"BatteryLevelAbove30\"?")));
  EXPECT_THAT(Watched("R: always reply(navigation.getNavigationState).status != REACHED.\n").findings(),
              ElementsAre(HasSubstr("\"REACHED\" is no NavigationStatus")));
  EXPECT_THAT(Watched("R: never event(request(navigation.followPath)).\n").findings(),
              ElementsAre(HasSubstr("no skill calls navigation.followPath")));
  EXPECT_THAT(Watched("let x = 3\n").findings(), ElementsAre(HasSubstr("holds no requirement")));
  EXPECT_THAT(Watched("R: alway true.\n").findings(), ElementsAre(HasSubstr("did you mean \"always\"?")));
}

TEST(Requirements, OfTheTwelveHaveNothingToComplainAbout) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/requirements");
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
  const auto plan = prepare(project::plain_scenario(std::move(*project.value)));
  for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan.value->monitors.size(), 12U);
}

// The written requirement and the chart drawn by hand decide at the same instant, and tell of the same trigger.
TEST(Requirements, DecideAsTheChartsDrawnByHand) {
  for (const bool first : {true, false}) {
    auto loaded = project::load_scenario(kRequirementsExample + "/scenarios/" +
                                         (first ? "experiment1" : "experiment2") + ".yaml");
    const auto plan = prepare(std::move(*loaded.value));
    const RunReport report = runtime::Run(*plan.value, {}).execute();
    const auto find = [&](const std::string& name) {
      return *std::find_if(report.monitors.begin(), report.monitors.end(),
                           [&](const auto& m) { return m.name == name; });
    };
    const MonitorReport drawn = find(first ? "battery" : "recharge");
    const MonitorReport written = find(first ? "never_empty" : "turns_to_station");
    ASSERT_TRUE(drawn.decision && written.decision);
    EXPECT_EQ(written.decision->at, drawn.decision->at);
    EXPECT_EQ(written.decision->deciding, drawn.decision->deciding);
    ASSERT_TRUE(written.explanation);
    EXPECT_FALSE(written.leaf.empty());
    if (first) continue;
    EXPECT_EQ(written.explanation->trigger->name, "battery.getBatteryState.reply");
  }
}

// The tick of that instant would have been in time; the run ended before it.
TEST(Requirements, WhatIsDueWhenTheRunEndsStaysOpen) {
  const Watched watched(
      "on_time: event(mission.tick) at least every 500 ms.\ntoo_rare: event(mission.tick) at least every 499 ms.\n");
  project::Scenario scenario = watched.scenario();
  scenario.project.period = std::chrono::milliseconds(500);
  scenario.duration = std::chrono::seconds(1);
  const auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  const RunReport report = runtime::Run(*plan.value, {}).execute();
  ASSERT_EQ(report.ended, TimePoint(std::chrono::seconds(1)));
  ASSERT_EQ(report.monitors.size(), 2U);
  EXPECT_EQ(report.monitors[0].verdict, monitor::Verdict::kUndecided);
  ASSERT_TRUE(report.monitors[1].decision);
  EXPECT_EQ(report.monitors[1].decision->at, TimePoint(std::chrono::milliseconds(499)));
}

// It has just completed and would begin anew: that is no end of its own.
TEST(Requirements, WhatIsDueWhenAMissionThatIsRepeatedIsCutOffStaysOpen) {
  const TemporaryFolder folder("repeated");
  const auto write = [&](const char* name, const char* text) { std::ofstream(folder.path() / name) << text; };
  write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><AlwaysSuccess/></BehaviorTree></root>");
  write("r.req", "on_time: event(mission.tick) at least every 500 ms.\n");
  write("sentree.yaml", "mission: {file: mission.xml, rate: 2 Hz, repeat: true}\nmonitors: [{file: r.req}]\n");
  auto project = project::load_project(folder.path());
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
  project::Scenario scenario = project::plain_scenario(std::move(*project.value));
  scenario.virtual_time = true;
  scenario.duration = std::chrono::seconds(1);
  const auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  const RunReport report = runtime::Run(*plan.value, {}).execute();
  EXPECT_TRUE(report.timed_out);
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  ASSERT_EQ(report.monitors.size(), 1U);
  EXPECT_EQ(report.monitors[0].verdict, monitor::Verdict::kUndecided);
}

}  // namespace
}  // namespace sentree::runtime
