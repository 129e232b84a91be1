// What a person does to a run: what comes of it, and that it can be repeated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/scenario_text.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/replay/recording.h"
#include "sentree/runtime/detail/steering_fixture.h"

namespace sentree::replay {

using namespace runtime;  // most of what is tested here is the run itself
namespace {

using namespace project::intervention;

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

using State = runtime::Steering::State;

Message last(const SteeredRunFixture& run, std::string_view name) {
  for (auto message = run.messages.rbegin(); message != run.messages.rend(); ++message) {
    if (message->name == name) return *message;
  }
  ADD_FAILURE() << "no " << name;
  return {};
}

std::string status_of_last_tick(const SteeredRunFixture& run, const std::string& leaf) {
  return std::string(last(run, leaf + ".tick.reply").data.find("status")->text());
}

TEST(Kill, FailsTheLeafOfASkillUntilItIsRestarted) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2050));
  EXPECT_EQ(status_of_last_tick(run, "GoToKitchen"), "RUNNING");
  ASSERT_TRUE(run.steering().apply(Kill{"AtKitchen"}).has_value());
  EXPECT_EQ(last(run, "scenario.injection").data, Value(Map{{"kill", "AtKitchen"}, {"what", "kill"}}));
  run.step();
  EXPECT_EQ(status_of_last_tick(run, "AtKitchen"), "FAILURE");
  EXPECT_EQ(last(run, "AtKitchen.tick.reply").data.at({"outputs", "reason"})->text(), "the skill was killed");
  const auto requests = run.count("localization.getCurrentPosition.request");
  run.step(3);
  EXPECT_EQ(run.count("localization.getCurrentPosition.request"), requests);
  EXPECT_EQ(run.steering().apply(Kill{"AtKitchen"}).error().code, "steering.part-state");
  ASSERT_TRUE(run.steering().apply(Restart{"AtKitchen"}).has_value());
  EXPECT_EQ(run.steering().apply(Restart{"AtKitchen"}).error().code, "steering.part-state");
  run.finish();
  EXPECT_EQ(run.report.mission, bt::Status::kSuccess);
}

TEST(Kill, AnActionInMidRunFailsTheMissionAndAnswersLateRepliesNobody) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2000));
  ASSERT_TRUE(run.steering().apply(Delay{"navigation.*.reply", milliseconds(30)}).has_value());
  // Between a request and its delayed reply.
  run.run_until(milliseconds(2010));
  ASSERT_TRUE(run.steering().apply(Kill{"GoToKitchen"}).has_value());
  run.finish();
  EXPECT_EQ(run.report.mission, bt::Status::kFailure);
  EXPECT_THAT(run.report.reason, HasSubstr("the skill was killed"));
}

TEST(Kill, WhileHaltingEndsTheHalt) {
  project::Scenario scenario = recharge_scenario("normal");
  SteeredRunFixture run(std::move(scenario));
  run.run_until(milliseconds(2050));
  ASSERT_TRUE(run.steering().apply(Delay{"navigation.stopNavigation", seconds(1)}).has_value());
  // The battery gets low: the leaf is halted, and its skill waits for its goal to be cancelled.
  ASSERT_TRUE(run.steering().apply(Call{"simulation.setBatteryCharge", Map{{"percent", 20}}}).has_value());
  run.run_until(milliseconds(2150));
  EXPECT_EQ(run.count("GoToKitchen.halt.request"), 1U);
  EXPECT_EQ(run.count("GoToKitchen.halt.reply"), 0U);
  ASSERT_TRUE(run.steering().apply(Kill{"GoToKitchen"}).has_value());
  run.run_until(milliseconds(2160));
  EXPECT_EQ(run.count("GoToKitchen.halt.reply"), 1U);
}

TEST(Kill, MakesSimulatedServicesUnreachable) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2050));
  ASSERT_TRUE(run.steering().apply(Kill{"battery"}).has_value());
  run.step();
  const Message error = last(run, "battery.getBatteryState.error");
  EXPECT_EQ(error.data.find("kind")->text(), "unreachable");
  EXPECT_EQ(status_of_last_tick(run, "BatteryLevelAbove30"), "FAILURE");
  const auto outcome = run.steering().apply(Call{"battery.getBatteryCharge", Map()});
  ASSERT_TRUE(outcome.has_value());
  EXPECT_EQ(outcome->outcome.kind_word(), "unreachable");
  // Other services of the simulator, and its test control, go on.
  EXPECT_TRUE(run.steering().apply(Call{"navigation.getNavigationStatus", Map()})->outcome.ok);
  EXPECT_TRUE(run.steering().apply(Call{"simulation.plugIn", Map()})->outcome.ok);
  ASSERT_TRUE(run.steering().apply(Restart{"battery"}).has_value());
  ASSERT_TRUE(run.steering().apply(Kill{"sim"}).has_value());
  EXPECT_EQ(run.steering().apply(Call{"battery.getBatteryCharge", Map()})->outcome.kind_word(), "unreachable");
  ASSERT_TRUE(run.steering().apply(Restart{"sim"}).has_value());
  EXPECT_TRUE(run.steering().apply(Call{"battery.getBatteryCharge", Map()})->outcome.ok);
}

TEST(Kill, NamesWhatThereIs) {
  SteeredRunFixture run(recharge_scenario("normal"));
  const auto refused = run.steering().apply(Kill{"GoToKitchn"});
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().message, HasSubstr("did you mean \"GoToKitchen\"?"));
  EXPECT_THAT(run.steering().apply(Kill{"never_empty"}).error().message, HasSubstr("give it a process of its own"));
  EXPECT_EQ(run.steering().parts().size(), 7U + run.plan().services.size() + 1U);
}

TEST(Falsify, ChangesWhatAServiceAnswersSoManyTimes) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2050));
  const auto id = run.steering().apply(Falsify{"battery.getBatteryState", "percentage", 0.1, 2});
  ASSERT_TRUE(id.has_value()) << to_string(id.error());
  EXPECT_EQ(id->id, 1U);
  EXPECT_EQ(run.steering().standing().size(), 1U);
  for (int tick = 0; tick < 2; ++tick) {
    run.step();
    EXPECT_EQ(last(run, "battery.getBatteryState.reply").data.at({"result", "percentage"})->number(), 0.1);
    EXPECT_EQ(status_of_last_tick(run, "BatteryLevelAbove30"), "FAILURE");
  }
  EXPECT_TRUE(run.steering().standing().empty());
  run.step();
  EXPECT_EQ(status_of_last_tick(run, "BatteryLevelAbove30"), "SUCCESS");
  EXPECT_EQ(run.steering().apply(Clear{id->id}).error().code, "steering.unknown-id");
}

TEST(Falsify, RefusesWhatDoesNotFit) {
  SteeredRunFixture run(recharge_scenario("normal"));
  runtime::Steering& steering = run.steering();
  EXPECT_THAT(steering.apply(Falsify{"battery.getBatteryStat", "", 1}).error().message,
              HasSubstr("did you mean \"battery.getBatteryState\"?"));
  EXPECT_THAT(steering.apply(Falsify{"battery.getBatteryState", "percentag", 1}).error().message,
              HasSubstr("did you mean \"percentage\"?"));
  EXPECT_THAT(steering.apply(Falsify{"battery.getBatteryState", "percentage", "low"}).error().message,
              HasSubstr("double"));
  EXPECT_THAT(steering.apply(Falsify{"battery.getBatteryState", "percentage.x", 1}).error().message,
              HasSubstr("no member"));
  EXPECT_TRUE(run.messages.empty()) << "what is refused is no observation";
}

TEST(Delay, HoldsBackAReply) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2000));
  ASSERT_TRUE(run.steering().apply(Delay{"battery.getBatteryState.reply", milliseconds(30), 1}).has_value());
  run.run_until(milliseconds(2300));
  std::vector<Duration> took;
  TimePoint asked{};
  for (const Message& message : run.messages) {
    if (message.name == "battery.getBatteryState.request") asked = message.time;
    if (message.name == "battery.getBatteryState.reply" && message.time >= TimePoint(milliseconds(2000)))
      took.push_back(message.time - asked);
  }
  EXPECT_THAT(took, testing::ElementsAre(milliseconds(30), Duration(0), Duration(0)));
}

TEST(Delay, RefusesAMessageThatThereIsNot) {
  SteeredRunFixture run(recharge_scenario("normal"));
  EXPECT_THAT(run.steering().apply(Delay{"GoToKitchen.tik", seconds(1)}).error().message,
              HasSubstr("did you mean \"GoToKitchen.tick\"?"));
  EXPECT_EQ(run.steering().apply(Delay{"battery.*", Duration(0)}).error().code, "steering.delay");
}

TEST(Force, ReplacesTheNextAnswerOfARunningLeaf) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.run_until(milliseconds(2050));
  ASSERT_TRUE(run.steering().apply(Force{"GoToKitchen", "SUCCESS", 1}).has_value());
  run.step();
  EXPECT_EQ(status_of_last_tick(run, "GoToKitchen"), "SUCCESS");
  EXPECT_EQ(*last(run, "GoToKitchen.tick.reply").data.find("forced")->as_bool(), true);
  // Its skill had not ended: it is cancelled with its leaf.
  EXPECT_EQ(run.count("GoToKitchen.cancel"), 1U);
  run.finish();
  EXPECT_EQ(run.report.mission, bt::Status::kSuccess);
}

TEST(Force, StandsUntilItIsCleared) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.step();
  const auto id = run.steering().apply(Force{"BatteryLevelAbove30", "FAILURE"});
  ASSERT_TRUE(id.has_value());
  for (int tick = 0; tick < 3; ++tick) {
    run.step();
    EXPECT_EQ(status_of_last_tick(run, "BatteryLevelAbove30"), "FAILURE");
  }
  EXPECT_EQ(run.steering().standing()[0].used, 3U);
  ASSERT_TRUE(run.steering().apply(Clear{id->id}).has_value());
  run.step();
  EXPECT_EQ(status_of_last_tick(run, "BatteryLevelAbove30"), "SUCCESS");
}

TEST(Force, GivesTheTruthLaterToALeafThatWasForcedToRun) {
  SteeredRunFixture run(recharge_scenario("no-path"));
  const auto id = run.steering().apply(Force{"GoToKitchen", "RUNNING"});
  ASSERT_TRUE(id.has_value());
  run.step(5);
  EXPECT_EQ(status_of_last_tick(run, "GoToKitchen"), "RUNNING");
  EXPECT_EQ(run.steering().status().state, State::kPaused);
  ASSERT_TRUE(run.steering().apply(Clear{id->id}).has_value());
  run.finish();
  EXPECT_EQ(run.report.mission, bt::Status::kFailure);
  EXPECT_THAT(run.report.reason, HasSubstr("NO_VALID_PATH"));
}

TEST(Force, RefusesAConditionThatRuns) {
  SteeredRunFixture run(recharge_scenario("normal"));
  EXPECT_THAT(run.steering().apply(Force{"AtKitchen", "RUNNING", 1}).error().message, HasSubstr("is a condition"));
  EXPECT_THAT(run.steering().apply(Force{"AtKichen", "FAILURE", 1}).error().message,
              HasSubstr("did you mean \"AtKitchen\"?"));
  EXPECT_THAT(run.steering().apply(Force{"AtKitchen", "FAILUER", 1}).error().message,
              HasSubstr("did you mean \"FAILURE\"?"));
}

TEST(Breakpoint, HoldsAtTheInstantOfANodesStatus) {
  SteeredRunFixture run(recharge_scenario("normal"));
  const auto id =
      run.steering().apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "GoToKitchen", .status = "RUNNING"});
  ASSERT_TRUE(id.has_value()) << to_string(id.error());
  ASSERT_TRUE(run.steering().resume().has_value());
  const runtime::Steering::Status status = run.steering().wait_paused();
  EXPECT_EQ(status.state, State::kPaused);
  EXPECT_EQ(status.breakpoint, id->id);
  EXPECT_EQ(status.stopped_at, "GoToKitchen is RUNNING");
  const Message hit = last(run, "scenario.breakpoint");
  EXPECT_EQ(run.messages.back().time, hit.time) << "nothing happened at a later instant";
  ASSERT_TRUE(run.steering().apply(Clear{id->id}).has_value());
  run.finish();
  EXPECT_EQ(run.count("scenario.breakpoint"), 1U);
  EXPECT_EQ(run.report.mission, bt::Status::kSuccess);
}

TEST(Breakpoint, HoldsWhenAMonitorEntersAState) {
  SteeredRunFixture run(recharge_scenario("experiment1"));
  const auto id = run.steering().apply(
      Breakpoint{.point = Breakpoint::Point::kState, .target = "monitor:battery", .state = "failure"});
  ASSERT_TRUE(id.has_value()) << to_string(id.error());
  (void)run.steering().resume();
  EXPECT_EQ(run.steering().wait_paused().stopped_at, "monitor:battery entered failure");
  EXPECT_EQ(last(run, "monitor.violated").time, run.messages.back().time);
}

TEST(Breakpoint, HoldsWhenASkillEntersAStateAndNotWhileItIsInIt) {
  SteeredRunFixture run(recharge_scenario("recharge"));
  run.run_until(milliseconds(2050));
  // It is there already; it comes back when the battery has been charged.
  ASSERT_TRUE(
      run.steering()
          .apply(Breakpoint{.point = Breakpoint::Point::kState, .target = "skill:GoToKitchen", .state = "moving"})
          .has_value());
  (void)run.steering().resume();
  EXPECT_EQ(run.steering().wait_paused().stopped_at, "skill:GoToKitchen entered moving");
  EXPECT_GT(run.steering().time(), TimePoint(seconds(100)));
  run.finish();
  EXPECT_EQ(run.count("scenario.breakpoint"), 1U);
}

TEST(Breakpoint, HoldsAtEachMessage) {
  SteeredRunFixture run(recharge_scenario("normal"));
  run.step();
  const auto id = run.steering().apply(Breakpoint{.target = "battery.getBatteryState.request"});
  ASSERT_TRUE(id.has_value());
  for (std::size_t hit = 1; hit <= 3; ++hit) {
    (void)run.steering().resume();
    EXPECT_EQ(run.steering().wait_paused().breakpoint, id->id);
    EXPECT_EQ(last(run, "scenario.breakpoint").tick, hit + 1);
  }
}

TEST(Breakpoint, RefusesWhatIsNotThere) {
  SteeredRunFixture run(recharge_scenario("normal"));
  EXPECT_THAT(
      run.steering().apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = "BeAtKitchn"}).error().message,
      HasSubstr("did you mean \"BeAtKitchen\"?"));
  EXPECT_THAT(run.steering()
                  .apply(Breakpoint{.point = Breakpoint::Point::kState, .target = "monitor:batery", .state = "failure"})
                  .error()
                  .message,
              HasSubstr("did you mean \"monitor:battery\"?"));
  EXPECT_THAT(run.steering()
                  .apply(Breakpoint{.point = Breakpoint::Point::kState, .target = "monitor:battery", .state = "failur"})
                  .error()
                  .message,
              HasSubstr("did you mean \"failure\"?"));
  EXPECT_EQ(run.steering().apply(Breakpoint{.target = ""}).error().code, "steering.pattern");
}

TEST(Standing, IsBounded) {
  SteeredRunFixture run(recharge_scenario("normal"));
  for (std::size_t i = 0; i < mission::Faults::kStandingMax; ++i)
    ASSERT_TRUE(run.steering().apply(Breakpoint{.target = "nothing"}).has_value());
  EXPECT_EQ(run.steering().apply(Breakpoint{.target = "nothing"}).error().code, "steering.too-many");
}

// A copy of examples/recharge to write scenarios into.
class Repeated : public testing::Test {
 protected:
  void SetUp() override {
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder_.path() / "recharge",
             fs::copy_options::recursive);
  }

  project::Scenario load(const std::string& name) {
    auto loaded = project::load_scenario(folder_.path() / "recharge/scenarios" / (name + ".yaml"));
    EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
    return std::move(*loaded.value);
  }
  project::Scenario load_text(const std::string& text) {
    EXPECT_TRUE(text::write_file(folder_.path() / "recharge/scenarios/again.yaml", text).has_value());
    return load("again");
  }

  const TemporaryFolder folder_{"test"};
};

std::string log_of(project::Scenario scenario, runtime::RunReport* report = nullptr) {
  auto plan = prepare(std::move(scenario));
  for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  std::string log;
  runtime::RunOptions options;
  options.listeners.push_back([&](const Message& message) { log += to_json(message) + "\n"; });
  const runtime::RunReport ran = runtime::Run(*plan.value, std::move(options)).execute();
  if (report != nullptr) *report = ran;
  return log;
}

// The first line in which two logs differ.
std::string difference(const std::string& a, const std::string& b) {
  std::size_t at = 0;
  while (at < a.size() && at < b.size() && a[at] == b[at]) ++at;
  if (at == a.size() && at == b.size()) return "";
  const auto line = [&](const std::string& text) {
    const auto begin = text.rfind('\n', at == 0 ? 0 : at - 1);
    const auto from = begin == std::string::npos ? 0 : begin + 1;
    return text.substr(from, text.find('\n', at) - from);
  };
  return "was  " + line(a) + "\nis   " + line(b);
}

// Does something to the run, or nothing if that is refused now.
void intervene(runtime::Steering& steering, std::mt19937& random) {
  const auto one_of = [&](std::vector<std::string> all) { return all[random() % all.size()]; };
  const std::string part =
      one_of({"GoToKitchen", "AtKitchen", "GoToStation", "WaitForUser", "battery", "navigation", "sim"});
  switch (random() % 12) {
    case 0: (void)steering.apply(Kill{part}); break;
    case 1:
    case 2: (void)steering.apply(Restart{part}); break;
    case 3:
      (void)steering.apply(Delay{one_of({"GoToKitchen.tick", "battery.*", "navigation.*.reply", "GoToKitchen.halt"}),
                                 milliseconds(1 + random() % 40), random() % 3});
      break;
    case 4:
      (void)steering.apply(Falsify{"battery.getBatteryState", "percentage", static_cast<double>(random() % 100) / 100.0,
                                   1 + random() % 3});
      break;
    case 5:
      (void)steering.apply(
          Force{one_of({"AtKitchen", "BatteryLevelAbove30", "AtStation"}), one_of({"SUCCESS", "FAILURE"}), 1});
      break;
    case 6: (void)steering.apply(Force{"GoToKitchen", one_of({"FAILURE", "RUNNING"}), random() % 2}); break;
    case 7: (void)steering.apply(Clear{1 + random() % 8}); break;
    case 8: (void)steering.apply(Breakpoint{.target = one_of({"mission.status", "GoToKitchen.*"})}); break;
    case 9:
      (void)steering.apply(
          Breakpoint{.point = Breakpoint::Point::kState, .target = "monitor:battery", .state = "failure"});
      break;
    case 10: (void)steering.apply(Call{"simulation.plugIn", Map()}); break;
    default:
      (void)steering.apply(
          Call{"simulation.setBatteryCharge", Map{{"percent", 0.5 * static_cast<double>(random() % 200)}}});
  }
}

TEST_F(Repeated, AsAScenarioARunIsTheSameByteForByte) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 6; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const text::ReadLog files;
    project::Scenario scenario = load(std::vector<std::string>{"normal", "experiment1", "experiment2"}[random() % 3]);
    scenario.duration = seconds(60);
    scenario.seed = random();
    const std::string path = (folder_.path() / "run.mcap").string();
    auto plan = prepare(scenario);
    ASSERT_TRUE(plan.ok());
    RunRecorder recorder(*plan.value, files.files(), std::move(*record::FileSink::create(path)), {});
    runtime::RunOptions options;
    recorder.install(options);
    std::string live;
    std::string text;
    {
      SteeredRunFixture run(std::move(scenario), std::move(options));
      Duration now{};
      for (int i = 0; i < 12; ++i) {
        now += Duration(random() % 5'000'000'000U);
        if (run.run_until(now).state == State::kEnded) break;
        for (auto n = 1 + random() % 3; n > 0; --n) intervene(run.steering(), random);
      }
      // Breakpoints hold it on its way to the end.
      while (run.steering().status().state != State::kEnded) {
        (void)run.steering().resume();
        run.steering().wait_paused();
      }
      run.finish();
      live = run.log();
      recorder.finish(run.report);
      text = *run.steering().scenario();
    }
    runtime::RunReport report;
    const std::string again = log_of(load_text(text), &report);
    ASSERT_EQ(difference(live, again), "") << text;
    auto recorded = RecordedRun::open(path);
    ASSERT_TRUE(recorded.has_value());
    const auto recorded_text = recorded_scenario_text(*recorded);
    ASSERT_TRUE(recorded_text.has_value()) << to_string(recorded_text.error());
    const std::string from_recording = log_of(load_text(*recorded_text), &report);
    ASSERT_EQ(difference(live, from_recording), "") << *recorded_text;
    EXPECT_THAT(report.unmet, testing::IsEmpty()) << *recorded_text;
  }
}

TEST_F(Repeated, AScenarioKeepsItsOverridesAndSaysWhatWasDone) {
  SteeredRunFixture run(load("experiment1"));
  run.run_until(milliseconds(12'345));
  ASSERT_TRUE(run.steering().apply(Falsify{"battery.getBatteryState", "percentage", 0.5, 1}).has_value());
  ASSERT_TRUE(run.steering().apply(Call{"simulation.setBatteryCharge", Map{{"percent", 42.0}}}).has_value());
  EXPECT_EQ(*run.steering().scenario(),
            "description: \"the battery is forced to 10 %; requirement 1 is violated\"\n"
            "clock: virtual\n"
            "seed: 1\n"
            "override:\n"
            "  world: {battery: {initial: 100 %}}\n"
            "timeline:\n"
            "  - {at: 12.345 s, source: studio, falsify: {call: battery.getBatteryState, path: percentage, value: 0.5, "
            "count: 1}}\n"
            "  - {at: 12.345 s, source: studio, call: simulation.setBatteryCharge, args: {percent: 42.0}}\n"
            "  - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}\n"
            "duration: 120 s\n");
}

TEST_F(Repeated, ATimelineSaysItsMistakesWithTheirPlace) {
  const auto code = [&](const std::string& entry) {
    (void)text::write_file(folder_.path() / "recharge/scenarios/again.yaml",
                           "timeline:\n  - {at: 1 s, " + entry + "}\n");
    auto loaded = project::load_scenario(folder_.path() / "recharge/scenarios/again.yaml");
    if (!loaded.ok()) return loaded.diagnostics.front().code;
    const auto plan = prepare(std::move(*loaded.value));
    if (plan.diagnostics.empty()) return std::string();
    EXPECT_EQ(plan.diagnostics.front().span.line, 2U);
    return plan.diagnostics.front().code;
  };
  EXPECT_EQ(code("stop: mission"), "");
  EXPECT_EQ(code("kill: battery"), "");
  EXPECT_EQ(code("kill: batery"), "scenario.kill");
  EXPECT_EQ(code("stop: battery"), "scenario.stop");
  EXPECT_EQ(code("clear: 0"), "scenario.clear");
  EXPECT_EQ(code("call: nowhere"), "scenario.call");
  EXPECT_EQ(code("delay: {message: battery.*}"), "project.missing-key");
  EXPECT_EQ(code("delay: {message: battery.*, by: 1 s, count: 0}"), "scenario.count");
  EXPECT_EQ(code("delay: {message: batery.*, by: 1 s}"), "steering.unknown-message");
  EXPECT_EQ(code("falsify: {call: battery.getBatteryState, path: percentage}"), "project.missing-key");
  EXPECT_EQ(code("falsify: {call: battery.getBatteryState, path: percent, value: 1}"), "steering.path");
  EXPECT_EQ(code("force: {leaf: AtKitchen, status: IDLE}"), "scenario.status");
  EXPECT_EQ(code("force: {leaf: AtKichen, status: FAILURE}"), "steering.unknown-leaf");
  EXPECT_EQ(code("breakpoint: {status: RUNNING}"), "scenario.breakpoint");
  EXPECT_EQ(code("breakpoint: {node: Root, status: RUNING}"), "scenario.status");
  EXPECT_EQ(code("kill: battery, restart: battery"), "scenario.timeline");
  EXPECT_EQ(code("kill: battery, source: nobody"), "scenario.source");
  EXPECT_EQ(code("source: studio"), "project.missing-key");
}

}  // namespace
}  // namespace sentree::replay
