// The reference mission, examples/recharge, in virtual time.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using std::chrono::milliseconds;
using testing::IsEmpty;

const std::string kExample = std::string(SENTREE_SOURCE_DIR) + "/examples/recharge";

project::Scenario scenario(const std::string& name) {
  auto loaded = project::load_scenario(kExample + "/scenarios/" + name + ".yaml");
  EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : to_string(loaded.diagnostics.front()));
  return std::move(*loaded.value);
}

struct Ran {
  RunReport report;
  std::vector<Message> messages;
};

Ran run(project::Scenario scenario) {
  auto plan = prepare(std::move(scenario));
  for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  Ran ran;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) { ran.messages.push_back(message); });
  ran.report = Run(*plan.value, std::move(options)).execute();
  return ran;
}

std::string log(const std::vector<Message>& messages) {
  std::string text;
  for (const Message& message : messages) text += to_json(message) + "\n";
  return text;
}

monitor::Verdict verdict(const RunReport& report, const std::string& name) {
  for (const MonitorReport& monitor : report.monitors) {
    if (monitor.name == name) return monitor.verdict;
  }
  ADD_FAILURE() << "no monitor " << name;
  return monitor::Verdict::kUndecided;
}

class EachScenario : public testing::TestWithParam<const char*> {};

TEST_P(EachScenario, HoldsAndIsTheSameEveryTime) {
  const Ran first = run(scenario(GetParam()));
  EXPECT_THAT(first.report.unmet, IsEmpty());
  EXPECT_THAT(first.report.problems, IsEmpty());
  const Ran second = run(scenario(GetParam()));
  EXPECT_TRUE(log(first.messages) == log(second.messages)) << "two runs with one seed differ";
}

INSTANTIATE_TEST_SUITE_P(Recharge, EachScenario,
                         testing::Values("normal", "recharge", "experiment1", "experiment2", "no-path", "shield",
                                         "unshielded"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::erase(name, '-');
                           return name;
                         });

// Whatever the phase of the injection within a tick, each experiment violates its own monitor and not the other.
TEST(Experiments, DoNotDependOnThePhaseOfTheInjection) {
  for (int phase_ms = 0; phase_ms < 100; phase_ms += 10) {
    SCOPED_TRACE("injected " + std::to_string(phase_ms) + " ms after a tick");
    for (const bool first : {true, false}) {
      project::Scenario experiment = scenario(first ? "experiment1" : "experiment2");
      experiment.timeline[0].at += milliseconds(phase_ms);
      const RunReport report = run(std::move(experiment)).report;
      EXPECT_EQ(verdict(report, "battery"), first ? monitor::Verdict::kViolated : monitor::Verdict::kUndecided);
      EXPECT_EQ(verdict(report, "recharge"), first ? monitor::Verdict::kUndecided : monitor::Verdict::kViolated);
    }
  }
}

TEST(Experiments, TheSecondIsViolatedAtTheEleventhTickAfterItsTrigger) {
  const Ran ran = run(scenario("experiment2"));
  const auto& decision = *ran.report.monitors[1].decision;
  ASSERT_TRUE(decision.deciding);
  EXPECT_EQ(decision.deciding->name, "mission.tick");
  // The trigger is the battery reading among the witness.
  const auto trigger = std::find_if(decision.witness.begin(), decision.witness.end(),
                                    [](const Message& m) { return m.name == "battery.getBatteryState.reply"; });
  ASSERT_NE(trigger, decision.witness.end());
  EXPECT_EQ(decision.deciding->tick, trigger->tick + 11);
}

std::vector<Message> of(const std::vector<Message>& messages, const std::string& name, const std::string& source = "") {
  std::vector<Message> found;
  for (const Message& message : messages) {
    if (message.name == name && (source.empty() || message.source == source)) found.push_back(message);
  }
  return found;
}

TEST(GoToLocation, StopsItsOwnGoalAlthoughTheNextLeafIsTickedFirst) {
  const Ran ran = run(scenario("experiment1"));
  const auto goals = of(ran.messages, "navigation.gotoTargetByLocationName.reply");
  ASSERT_EQ(goals.size(), 2U);
  EXPECT_EQ(goals[0].source, "GoToKitchen");
  EXPECT_EQ(goals[1].source, "GoToStation");
  const auto stops = of(ran.messages, "navigation.stopNavigation.request", "GoToKitchen");
  ASSERT_EQ(stops.size(), 1U);
  EXPECT_GT(stops[0].sequence,
            of(ran.messages, "navigation.gotoTargetByLocationName.request", "GoToStation")[0].sequence);
  EXPECT_EQ(*stops[0].data.at({"args", "goal_id"}), *goals[0].data.at({"result", "goal_id"}));
}

// The old leaf's halt arrives long after the new leaf's goal: the robot must go on to the station all the same.
TEST(GoToLocation, AHaltThatArrivesLateDoesNotStopTheNewGoal) {
  project::Scenario late = scenario("experiment1");
  late.delays.push_back({.message = "GoToKitchen.halt", .by = milliseconds(700), .span = {}});
  const Ran ran = run(std::move(late));
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  const auto at_station = of(ran.messages, "navigation.checkNearToLocation.reply", "AtStation");
  ASSERT_FALSE(at_station.empty());
  EXPECT_EQ(*at_station.back().data.find("result"), Value(true));
}

// Halted before the goal's id has arrived.
TEST(GoToLocation, StopsAGoalWhoseIdArrivesAfterTheHalt) {
  project::Scenario late = scenario("experiment1");
  late.timeline[0].at = TimePoint(milliseconds(250));
  late.delays.push_back({.message = "navigation.gotoTargetByLocationName", .by = milliseconds(900), .span = {}});
  const Ran ran = run(std::move(late));
  const auto goals = of(ran.messages, "navigation.gotoTargetByLocationName.reply", "GoToKitchen");
  const auto stops = of(ran.messages, "navigation.stopNavigation.request", "GoToKitchen");
  ASSERT_EQ(goals.size(), 1U);
  ASSERT_EQ(stops.size(), 1U);
  EXPECT_GT(goals[0].sequence, of(ran.messages, "GoToKitchen.halt.request")[0].sequence);
  EXPECT_EQ(*stops[0].data.at({"args", "goal_id"}), *goals[0].data.at({"result", "goal_id"}));
  EXPECT_EQ(*of(ran.messages, "navigation.checkNearToLocation.reply", "AtStation").back().data.find("result"),
            Value(true));
}

TEST(Recharge, TellsTheStoryOfThePaper) {
  const Ran ran = run(scenario("recharge"));
  std::vector<std::string> story;
  std::string last;
  for (const Message& message : ran.messages) {
    if (message.name == "navigation.gotoTargetByLocationName.request")
      story.push_back("go to " + std::string(message.data.at({"args", "name"})->text()));
    if (message.name == "WaitForUser.tick.request" && last != "wait") story.push_back(last = "wait");
    if (message.name == "scenario.injection") story.push_back(std::string(message.data.find("what")->text()));
    if (message.name == "WaitForUser.halt.request") story.push_back("full");
  }
  EXPECT_THAT(story, testing::ElementsAre("go to kitchen", "go to station", "wait", "simulation.plugIn", "full",
                                          "go to kitchen"));
}

TEST(Gate, AVetoIsAnObservationWithoutARequest) {
  const Ran ran = run(scenario("shield"));
  EXPECT_THAT(of(ran.messages, "navigation.gotoTargetByLocationName.request", "GoToKitchen"), IsEmpty());
  const auto vetoes = of(ran.messages, "navigation.gotoTargetByLocationName.error", "GoToKitchen");
  ASSERT_EQ(vetoes.size(), 1U);
  EXPECT_EQ(vetoes[0].data.find("kind")->text(), "vetoed");
  EXPECT_EQ(vetoes[0].data.find("vetoed_by")->text(), "shield");
  EXPECT_EQ(*vetoes[0].data.at({"args", "name"}), Value("kitchen"));
  EXPECT_EQ(ran.report.monitors.back().vetoes, 1U);
}

// A run that ends while a skill owes an answer leaves no robot that drives on.
TEST(TheEnd, HaltsALeafThatHasNotAnsweredYet) {
  project::Scenario cut = scenario("normal");
  cut.delays.push_back({.message = "GoToKitchen.tick", .by = std::chrono::milliseconds(250), .span = {}});
  cut.duration = std::chrono::seconds(2);
  cut.expect_nothing();
  const Ran ran = run(std::move(cut));
  const auto asked = of(ran.messages, "GoToKitchen.tick.request", "mission");
  const auto answered = of(ran.messages, "GoToKitchen.tick.reply", "GoToKitchen");
  ASSERT_GT(asked.size(), answered.size()) << "it owes no answer";
  EXPECT_THAT(of(ran.messages, "GoToKitchen.cancel", "mission"), IsEmpty());
  EXPECT_EQ(of(ran.messages, "GoToKitchen.halt.reply", "GoToKitchen").size(), 1U);
  EXPECT_EQ(of(ran.messages, "navigation.stopNavigation.request", "GoToKitchen").size(), 1U);
}

// The same with a thread per skill, and with the skill in a process of its own.
TEST(Gate, DecidesAlikeInThreads) {
  project::Scenario shielded = scenario("shield");
  shielded.virtual_time = false;
  shielded.factor = 20;
  shielded.project.deadlines = scenario("distributed").project.deadlines;
  const Ran ran = run(std::move(shielded));
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  EXPECT_THAT(of(ran.messages, "navigation.gotoTargetByLocationName.request", "GoToKitchen"), IsEmpty());
}

// A chart with event names of its own, written for another system, watches through renaming.
TEST(ForeignMonitor, RunsUnmodified) {
  project::Scenario experiment = scenario("experiment1");
  experiment.project.monitors.push_back({.name = "foreign",
                                         .file = {"../../tests/projects/foreign-monitor/BatteryLevel.scxml", {}},
                                         .violated = {"failure"},
                                         .events = {{.event = "batteryLevelChanged",
                                                     .on = {"battery.getBatteryState.reply"},
                                                     .data = {{"level", "result.percentage * 100"}},
                                                     .span = {}}},
                                         .span = {}});
  EXPECT_EQ(verdict(run(std::move(experiment)).report, "foreign"), monitor::Verdict::kViolated);
}

}  // namespace
}  // namespace sentree::runtime
