#include "sentree/project/project.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "sentree/project/plan.h"
#include "sentree/text/read_fence.h"

namespace sentree::project {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;

// A folder of its own for each test.
class Folder {
 public:
  explicit Folder(const std::string& name = "")
      : path_(std::filesystem::path(testing::TempDir()) /
              (testing::UnitTest::GetInstance()->current_test_info()->name() + name)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_ / "scenarios");
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name) << content;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Messages without the folder's path.
std::vector<std::string> messages(const Diagnostics& diagnostics, const Folder& folder) {
  std::vector<std::string> texts;
  for (const Diagnostic& diagnostic : diagnostics) {
    std::string text = to_string(diagnostic);
    const std::string prefix = folder.path().string() + "/";
    if (text.starts_with(prefix)) text = text.substr(prefix.size());
    texts.push_back(text);
  }
  return texts;
}

TEST(Units, AreReadWithTheirBounds) {
  EXPECT_EQ(parse_duration("40 ms"), milliseconds(40));
  EXPECT_EQ(parse_duration("1.5s"), milliseconds(1500));
  EXPECT_EQ(parse_duration("2 min"), seconds(120));
  EXPECT_EQ(parse_duration("87600 h"), std::chrono::hours(87600));
  EXPECT_EQ(parse_duration("1e300 s"), std::nullopt);
  EXPECT_EQ(parse_duration("2"), std::nullopt);
  EXPECT_EQ(parse_duration("-2 s"), std::nullopt);
  EXPECT_EQ(parse_duration("soon"), std::nullopt);
  EXPECT_EQ(parse_rate("10 Hz"), milliseconds(100));
  EXPECT_EQ(parse_rate("0 Hz"), std::nullopt);
  EXPECT_EQ(parse_rate("10 kHz"), std::nullopt);
}

TEST(Pattern, StarStandsForAnyText) {
  EXPECT_TRUE(matches_pattern("navigation.*", "navigation.gotoTarget.request"));
  EXPECT_TRUE(matches_pattern("*.halt", "Sub.GoTo.halt"));
  EXPECT_TRUE(matches_pattern("a*b*c", "a-b-b-c"));
  EXPECT_FALSE(matches_pattern("a*b*c", "a-c-b"));
  EXPECT_FALSE(matches_pattern("navigation", "navigation.x"));
  EXPECT_TRUE(matches_pattern("*", ""));
}

TEST(Project, OfARecordingReadsNothingElse) {
  const Folder outside("Outside");
  outside.write("mission.xml", "<root BTCPP_format='4'><BehaviorTree ID='M'><AlwaysSuccess/></BehaviorTree></root>");
  outside.write("robot.req", "r: always mission.tick.");
  const Folder folder;
  const std::string elsewhere = outside.path().string();
  const auto codes = [&] {
    std::vector<std::string> found;
    for (const Diagnostic& diagnostic : check_project(folder.path())) found.push_back(diagnostic.code);
    return found;
  };
  folder.write("sentree.yaml", "mission: {file: " + elsewhere + "/mission.xml}\n");
  EXPECT_THAT(codes(), ElementsAre());
  const text::SealedFolder seal(folder.path());
  EXPECT_THAT(codes(), ElementsAre("file.outside"));
  folder.write("sentree.yaml", "mission: {file: m.xml}\n");
  folder.write("m.xml", "<root BTCPP_format='4'><include path='" + elsewhere +
                            "/mission.xml'/><BehaviorTree ID='N'><SubTree ID='M'/></BehaviorTree></root>");
  EXPECT_THAT(codes(), testing::Contains("file.outside"));
}

TEST(Project, AnEventHasSeveralSources) {
  const Folder folder;
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\n"
               "monitors:\n"
               "  - file: a.scxml\n"
               "    events:\n"
               "      went:\n"
               "        - {on: [n.goto*.request, n.follow.request], from: Go*, data: {to: args.name}, when: changed}\n"
               "        - {on: n.stop.request}\n"
               "      level: {on: b.get.reply, data: {v: result}, when: value < last}\n"
               "      bad: {when: changed}\n"
               "      near: {on: n.x.request, data: {v: result}, when: chnged}\n");
  const auto loaded = load_project(folder.path());
  EXPECT_THAT(messages(loaded.diagnostics, folder),
              ElementsAre("sentree.yaml:9:12: event \"bad\" needs \"on\": the observations that it stands for",
                          "sentree.yaml:9:19: event \"bad\" has no \"data\" that could change",
                          "sentree.yaml:10:56: when of event \"near\" is \"chnged\"; did you mean \"changed\"?"));
}

TEST(Project, AModelHasNoOtherKeys) {
  const Folder folder;
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\n"
               "models:\n"
               "  - {file: models/hall.scxml, serves: [door, lamp]}\n"
               "  - {file: models/x.scxml, serve: door}\n");
  const auto loaded = load_project(folder.path());
  EXPECT_THAT(messages(loaded.diagnostics, folder),
              ElementsAre("sentree.yaml:4:28: model has no key \"serve\"; did you mean \"serves\"?"));
}

TEST(Project, IsReadWhole) {
  const Folder folder;
  folder.write(
      "sentree.yaml",
      "mission: {file: m.xml, tree: Main, rate: 20 Hz}\n"
      "services:\n  battery: {interface: robot.thrift/Battery, at: sim}\n"
      "skills:\n  GoTo: {file: skills/g.scxml, at: 'unix:/tmp/x'}\n"
      "monitors:\n  - {file: monitors/a.scxml, violated: bad, events: {low: {on: b.c.reply, data: {level: result}}}}\n"
      "deadlines: {call: 10 ms, condition: 20 ms}\n");
  const auto loaded = load_project(folder.path());
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  const Project& project = *loaded.value;
  EXPECT_EQ(project.period, milliseconds(50));
  EXPECT_EQ(project.service("battery")->interface, "Battery");
  EXPECT_EQ(project.skill("x", "GoTo")->at, "unix:/tmp/x");
  EXPECT_EQ(project.monitors[0].name, "a");
  EXPECT_THAT(project.monitors[0].violated, ElementsAre("bad"));
  EXPECT_EQ(project.monitors[0].events[0].data[0].second, "result");
  EXPECT_EQ(project.deadlines.condition, milliseconds(20));
}

TEST(Project, SaysWhereRunsAreShown) {
  const Folder folder;
  const auto load = [&](const std::string& lines) {
    return load_project(folder.write("sentree.yaml", "mission: {file: mission.xml}\n" + lines));
  };
  const auto loaded = load("groot: 1700\nfoxglove: \"0.0.0.0:0\"\nyarp_server: true\n");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  EXPECT_EQ(loaded.value->groot, "1700");
  EXPECT_EQ(loaded.value->foxglove, "0.0.0.0:0");
  EXPECT_EQ(loaded.value->yarp_server, "true");
  const auto nowhere = load("groot: false\nfoxglove: false\nyarp_server: false\n");
  ASSERT_TRUE(nowhere.ok());
  EXPECT_EQ(nowhere.value->groot + nowhere.value->foxglove + nowhere.value->yarp_server, "");
  EXPECT_THAT(
      messages(load("groot: 99999999\nfoxglove: here\nyarp_server: 10000\n").diagnostics, folder),
      ElementsAre("sentree.yaml:2:8: groot: \"99999999\" is neither true, false, a port from 2 to 65532 nor HOST:PORT "
                  "such as 127.0.0.1:1667",
                  "sentree.yaml:3:11: foxglove: \"here\" is neither true, false, a port from 0 to 65535 nor HOST:PORT "
                  "such as 127.0.0.1:8765",
                  "sentree.yaml:4:14: yarp_server: \"10000\" is neither true, false nor HOST:PORT such as "
                  "127.0.0.1:10000"));
  for (const char* wrong :
       {"groot: 65534\n", "groot: \":1667\"\n", "foxglove: \"1.2.3.4:\"\n", "yarp_server: \"h:0\"\n"})
    EXPECT_FALSE(load(wrong).ok()) << wrong;
}

TEST(Project, ReportsAllProblemsAtOnce) {
  const Folder folder;
  folder.write("sentree.yaml",
               "mission: {tree: Main, rate: fast}\n"
               "sevices: {}\n"
               "services:\n  battery: {interface: Battery}\n"
               "monitors: {}\n"
               "deadlines: {call: 90 ms}\n");
  const auto loaded = load_project(folder.path());
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(
      messages(loaded.diagnostics, folder),
      ElementsAre("sentree.yaml:1:10: mission needs \"file\"",
                  "sentree.yaml:1:29: rate \"fast\" is not a rate such as 10 Hz, from 0.01 to 1000 Hz",
                  "sentree.yaml:4:24: interface \"Battery\" must be FILE.thrift/SERVICE, e.g. robot.thrift/Battery, or "
                  "of ROS PACKAGE/srv/NAME, e.g. std_srvs/srv/SetBool",
                  "sentree.yaml:5:11: \"monitors\" of the project must be a list",
                  "sentree.yaml:6:12: deadlines must nest: call (90 ms) < condition (80 ms) < tick budget (100 ms); "
                  "otherwise a slow call is judged by the wrong one",
                  "sentree.yaml:2:1: the project has no key \"sevices\"; did you mean \"services\"?"));
}

TEST(Project, SaysWhereTheOtherOfANameIs) {
  const Folder folder;
  folder.write("two.req", "a: never event(mission.tick).\nb: never event(mission.tick).\n");
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\n"
               "models:\n  - {file: m/arm.scxml, serves: [x]}\n  - {file: n/arm.scxml, serves: [y]}\n"
               "monitors:\n  - {file: m/gentle.scxml}\n  - {file: n/gentle.scxml}\n"
               "  - {file: two.req}\n  - {file: two.req}\n");
  std::vector<std::string> texts = messages(load_project(folder.path()).diagnostics, folder);
  for (std::string& text : texts) {
    for (std::size_t at = 0; (at = text.find(folder.path().string() + "/")) != std::string::npos;)
      text.erase(at, folder.path().string().size() + 1);
  }
  EXPECT_THAT(texts,
              ElementsAre("sentree.yaml:4:5: two models are named \"arm\"; the other is at sentree.yaml:3:5; give "
                          "one another name with \"name\"",
                          "sentree.yaml:7:5: two monitors are named \"gentle\"; the other is at sentree.yaml:6:5; "
                          "give one another name with \"name\"",
                          "sentree.yaml:9:5: two.req is named at sentree.yaml:8:5 already; take one of the two "
                          "out"));
}

TEST(Project, SaysWhatAProjectIsWhenThereIsNone) {
  const auto loaded = load_project("/nonexistent/project");
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_EQ(to_string(loaded.diagnostics[0]),
            "/nonexistent/project: no such file; a project is a folder with a sentree.yaml (sentree init makes one)");
}

TEST(Scenario, SaysWhereItNamesAProjectThatIsNotThere) {
  const Folder folder;
  folder.write("scenario.yaml", "duration: 1 s\nproject: nowhere\n");
  const auto loaded = load_scenario(folder.path() / "scenario.yaml");
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  const std::string said = to_string(loaded.diagnostics[0]);
  EXPECT_NE(said.find("scenario.yaml:2:"), std::string::npos) << said;
  EXPECT_NE(said.find("nowhere: no such file"), std::string::npos) << said;
}

TEST(Scenario, ChangesItsProjectAndSaysWhatToExpect) {
  const Folder folder;
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\nservices:\n  battery: {interface: robot.thrift/Battery, at: sim}\n"
               "monitors:\n  - {file: monitors/a.scxml, violated: [bad]}\n");
  const auto file = folder.write(
      "scenarios/s.yaml",
      "clock: {real: 20}\nseed: 7\n"
      "override:\n  skills: {GoTo: {file: skills/other.scxml}}\n  services: {battery: {at: 'tcp://127.0.0.1:1'}}\n"
      "timeline:\n  - {at: 2 s, call: simulation.setBatteryCharge, args: {percent: 10}}\n"
      "delays:\n  - {message: GoTo.halt, by: 300 ms}\n"
      "expect: {mission: SUCCESS, monitors: {a: violated}}\n");
  const auto loaded = load_scenario(file);
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  const Scenario& scenario = *loaded.value;
  EXPECT_EQ(scenario.name, "s");
  EXPECT_FALSE(scenario.virtual_time);
  EXPECT_EQ(scenario.factor, 20.0);
  EXPECT_EQ(scenario.seed, 7U);
  EXPECT_EQ(scenario.project.skill("", "GoTo")->file.path, "skills/other.scxml");
  EXPECT_EQ(scenario.project.service("battery")->at, "tcp://127.0.0.1:1");
  EXPECT_EQ(std::get<intervention::Call>(scenario.timeline[0].what).method, "simulation.setBatteryCharge");
  EXPECT_EQ(scenario.timeline[0].at, TimePoint(seconds(2)));
  EXPECT_EQ(scenario.delays[0].by, milliseconds(300));
  EXPECT_EQ(scenario.verdicts.at("a"), "violated");
}

TEST(Scenario, DelaysOfTheWholeRunNeedATimeAndHaveNoNumber) {
  const Folder folder;
  folder.write("sentree.yaml", "mission: {file: m.xml}\n");
  const auto file = folder.write("scenarios/s.yaml",
                                 "delays:\n  - {message: GoTo.halt}\n  - {message: GoTo.tick, by: 1 s, count: 2}\n");
  EXPECT_THAT(messages(load_scenario(file).diagnostics, folder),
              ElementsAre("scenarios/s.yaml:2:5: a delay needs \"by\"",
                          "scenarios/s.yaml:3:42: what stands in `delays:` is for the whole run; a delay of so many "
                          "messages is an entry of `timeline:`, {at: 0 s, delay: {message: …, by: …, count: …}}"));
}

TEST(Scenario, NullFalsifiesWhatMayBeAbsent) {
  const Folder folder;
  std::filesystem::create_directories(folder.path() / "interfaces");
  folder.write("interfaces/s.thrift",
               "struct State { 1: double level, 2: optional string note }\nservice S { State get() }\n");
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\nservices: {s: {interface: s.thrift/S, at: 'tcp://127.0.0.1:1'}}\n");
  folder.write("m.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><AlwaysSuccess/></BehaviorTree></root>");
  const auto found = [&](const std::string& falsify) {
    const auto file = folder.write("scenarios/s.yaml",
                                   "timeline:\n  - {at: 1 s, falsify: {call: s.get, " + falsify + "}}\nclock: real\n");
    auto scenario = load_scenario(file);
    if (!scenario.ok()) return messages(scenario.diagnostics, folder);
    return messages(prepare(std::move(*scenario.value)).diagnostics, folder);
  };
  EXPECT_THAT(found("path: note, value: null"), ElementsAre());
  EXPECT_THAT(found("path: level, value: null"),
              ElementsAre("scenarios/s.yaml:2:5: falsify s.get: level: expected double, got null"));
  EXPECT_THAT(found("path: note"), ElementsAre("scenarios/s.yaml:2:24: \"falsify\" needs \"value\""));
}

TEST(Scenario, RefusesWhatItCannotExpect) {
  const Folder folder;
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\nmonitors:\n  - {file: monitors/battery.scxml, violated: [bad]}\n");
  const auto file = folder.write("scenarios/s.yaml",
                                 "clock: fast\nexpect: {mission: GOOD, monitors: {batery: violated, battery: fine}}\n"
                                 "processes: {p: {component: camera, listen: 'tcp://127.0.0.1:0'}}\n");
  EXPECT_THAT(
      messages(load_scenario(file).diagnostics, folder),
      ElementsAre("scenarios/s.yaml:1:8: clock must be virtual, real, or {real: FACTOR} with a factor up to 1000",
                  "scenarios/s.yaml:3:28: component \"camera\" is not known; there is \"sim\"",
                  "scenarios/s.yaml:2:19: mission \"GOOD\" must be SUCCESS, FAILURE or RUNNING",
                  "scenarios/s.yaml:2:36: the project has no monitor \"batery\"; did you mean \"battery\"?",
                  "scenarios/s.yaml:2:63: verdict \"fine\" must be violated, satisfied, undecided or owed"));
}

TEST(Scenario, ThatKillsALeafOfAnotherProcessHearsWhatToKill) {
  const Folder folder;
  folder.write("m.xml",
               "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Sequence><Action ID=\"Go\" name=\"Home\"/>"
               "<Action ID=\"Wave\" name=\"Hello\"/></Sequence></BehaviorTree></root>");
  folder.write("sentree.yaml", "mission: {file: m.xml}\nskills: {Wave: {at: 'tcp://127.0.0.1:9'}}\n");
  for (const char* const skill : {"Go", "Wave"}) {
    folder.write(std::string("skills/") + skill + ".scxml",
                 "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" initial=\"success\">"
                 "<final id=\"success\"/></scxml>");
  }
  const auto file = folder.write("scenarios/s.yaml",
                                 "clock: real\nprocesses: {Go: {skill: Go, listen: 'unix:{run}/go.sock'}}\n"
                                 "override: {skills: {Go: {at: '{Go}'}}}\n"
                                 "timeline:\n  - {at: 1 s, kill: Home}\n  - {at: 1 s, kill: Hello}\n");
  auto scenario = load_scenario(file);
  ASSERT_TRUE(scenario.ok());
  EXPECT_THAT(
      messages(prepare(std::move(*scenario.value)).diagnostics, folder),
      ElementsAre("scenarios/s.yaml:5:5: \"Home\" runs in the process \"Go\": kill that, with all leaves that it "
                  "runs",
                  "scenarios/s.yaml:6:5: \"Hello\" runs at tcp://127.0.0.1:9, where nobody here can kill it"));
}

// A project with a service at an address, and what is said of it with a scenario.
std::vector<std::string> said_of(const Folder& folder, const std::string& at, const std::string& scenario,
                                 const std::string& more = "") {
  std::filesystem::create_directories(folder.path() / "interfaces");
  folder.write("interfaces/s.thrift", "service S { i32 get() }\n");
  folder.write("m.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><AlwaysSuccess/></BehaviorTree></root>");
  folder.write("sentree.yaml",
               "mission: {file: m.xml}\nservices:\n  s: {interface: s.thrift/S, at: '" + at + "'}\n" + more);
  folder.write("scenarios/s.yaml", scenario);
  return messages(check_project(folder.path()), folder);
}

TEST(Scenario, InVirtualTimeIsToldWhatIsElsewhere) {
  const Folder folder;
  const std::string expects = "expect: {mission: SUCCESS}\n";
  EXPECT_THAT(said_of(folder, "tcp://127.0.0.1:1", expects + "clock: real\n"), ElementsAre());
  const auto why = ::testing::HasSubstr(
      "sentree.yaml:3:3) runs in another process, which has no virtual time: the scenario needs clock: real");
  for (const std::string& clock : {std::string(), std::string("clock: virtual\n")}) {
    EXPECT_THAT(said_of(folder, "tcp://127.0.0.1:1", clock + expects),
                ElementsAre(::testing::AllOf(::testing::StartsWith("scenarios/s.yaml:1:"), why)))
        << "where it can be mended";
  }
  EXPECT_THAT(said_of(folder, "tcp:/127.0.0.1:1", expects), ElementsAre(::testing::StartsWith("sentree.yaml:3:3: ")))
      << "what is no address is told once";
}

TEST(Scenario, MakesUnreachableWhatIsThere) {
  const Folder folder;
  const auto told = [&](const std::string& call) {
    return said_of(folder, "tcp://127.0.0.1:1",
                   "clock: real\ntimeline:\n  - {at: 1 s, unreachable: " + call + "}\nexpect: {mission: SUCCESS}\n");
  };
  EXPECT_THAT(told("s"),
              ElementsAre(::testing::EndsWith("no service has a method \"s\"; all methods of s are \"s.*\"")));
  EXPECT_THAT(told("s.gett"), ElementsAre(::testing::EndsWith("did you mean \"s.get\"?")));
}

TEST(Project, SaysWhereKeysOfScenariosBelong) {
  const Folder folder;
  EXPECT_THAT(said_of(folder, "tcp://127.0.0.1:1", "clock: real\nexpect: {mission: SUCCESS}\n", "clock: real\n"),
              ElementsAre("sentree.yaml:4:1: the project has no key \"clock\": clock stands in a scenario, such as "
                          "scenarios/NAME.yaml"));
}

TEST(Scenario, OfAProjectAloneHasTheNameOfItsFolder) {
  const Folder folder;
  folder.write("sentree.yaml", "mission: {file: mission.xml}\n");
  for (const char* suffix : {"", "/", "/."}) {
    auto project = load_project(folder.path().string() + suffix);
    ASSERT_TRUE(project.ok());
    EXPECT_EQ(plain_scenario(std::move(*project.value)).name, "OfAProjectAloneHasTheNameOfItsFolder") << suffix;
  }
}

}  // namespace
}  // namespace sentree::project
