// Projects broken in one way each, and the exact message that a user gets.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;

struct Broken {
  const char* name;
  const char* file;     // in examples/recharge
  const char* before;   // replaced …
  const char* after;    // … by this; both null: the file is removed
  const char* message;  // without the project's folder
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

const Broken kBroken[] = {
    {"MalformedXml", "mission.xml", "</BehaviorTree>", "</BehaviourTree>",
     "mission.xml:30:3: </BehaviourTree> closes <BehaviorTree>"},
    {"UnknownLeaf", "mission.xml", "<WaitForUser name=\"WaitForUser\"/>", "<WaitForUsr name=\"WaitForUser\"/>",
     "mission.xml:22:11: there is no node \"WaitForUsr\"; did you mean \"WaitForUser\"?"},
    {"MissingSkillFile", "skills/WaitForUser.scxml", nullptr, nullptr,
     "mission.xml:22:11: file \"skills/WaitForUser.scxml\": no such file; `sentree add skill WaitForUser` makes one"},
    {"MisspeltPort", "mission.xml", "threshold=\"30\"", "treshold=\"30\"",
     "mission.xml:14:57: BatteryLevelAbove has no port \"treshold\" in the TreeNodesModel; did you mean "
     "\"threshold\"?"},
    {"TwoRootTrees", "mission.xml", "  <TreeNodesModel>",
     "  <BehaviorTree ID=\"Main\"><AlwaysSuccess/></BehaviorTree>\n  <TreeNodesModel>",
     "mission.xml:32:21: there are two BehaviorTrees \"Main\"; the other is at mission.xml:10:3"},
    {"BadChartTarget", "skills/BatteryLevelAbove.scxml", "target=\"success\"/>", "target=\"succes\"/>",
     "skills/BatteryLevelAbove.scxml:14:83: transition target \"succes\" is not a state; did you mean \"success\"?"},
    {"ScriptSyntax", "skills/BatteryLevelAbove.scxml", "&gt; threshold", "&gt; (threshold",
     "skills/BatteryLevelAbove.scxml:14:23: \"_event.data.result.percentage * 100 > (threshold\" does not parse: "
     "SyntaxError: parse error"},
    {"UnknownService", "skills/BatteryLevelAbove.scxml", "target=\"battery\"", "target=\"batery\"",
     "skills/BatteryLevelAbove.scxml:11:35: service \"batery\" is not in sentree.yaml; did you mean \"battery\"?"},
    {"UnknownMethod", "skills/BatteryLevelAbove.scxml", "event=\"getBatteryState\"", "event=\"getBateryState\"",
     "skills/BatteryLevelAbove.scxml:11:51: service \"battery\" (Battery) has no method \"getBateryState\"; did you "
     "mean \"getBatteryState\"?"},
    {"WrongArgumentType", "skills/AtLocation.scxml", "expr=\"linear_tolerance\"", "expr=\"'near'\"",
     "skills/AtLocation.scxml:8:5: warning: data \"linear_tolerance\" is never used\nskills/AtLocation.scxml:16:9: "
     "argument \"linear_tolerance\" of Navigation.checkNearToLocation: expected double, got string \"near\""},
    {"TruncatedMap", "world/house.pgm", nullptr, "P5\n10 10\n255\nabc",
     "world/house.pgm: the image ends after 3 of 100 cells; the file was cut off, fetch it again"},
    {"UnknownDestination", "mission.xml", "destination=\"kitchen\"", "destination=\"kichen\"",
     "mission.xml:27:9: \"kichen\", the destination of GoToKitchen, is no location or area of world/world.yaml; did "
     "you mean \"kitchen\"?"},
    {"OutcomeThatIsNone", "skills/GoToLocation.scxml", "<final id=\"halted\"/>",
     "<final id=\"halted\"/><final id=\"stopped\"/>",
     "skills/GoToLocation.scxml:107:23: warning: state \"stopped\" is never entered: no transition of a reachable "
     "state "
     "leads to it\nskills/GoToLocation.scxml:107:23: top-level <final id=\"stopped\"> is no outcome of a skill; use "
     "success, failure or halted"},
    {"ToleranceTooNarrow", "skills/AtLocation.scxml", "expr=\"0.3\"", "expr=\"0.01\"",
     "skills/AtLocation.scxml:16:9: linear_tolerance of 0.01 m is narrower than navigation's 0.1 m: the robot can stop "
     "where this skill does not see it arrived"},
    {"ToleranceTooWide", "skills/AtLocation.scxml", "expr=\"0.3\"", "expr=\"3\"",
     "skills/AtLocation.scxml:16:9: linear_tolerance of 3 m is not below the charging station's 0.5 m: the robot can "
     "wait where the station does not charge it"},
    {"UnknownMonitorState", "sentree.yaml", "violated: [failure]}\n  - ", "violated: [failed]}\n  - ",
     "sentree.yaml:10:5: monitor \"battery\": \"failed\" is no state of monitors/battery.scxml"},
    {"GateOfNoCall", "sentree.yaml", "violated: [failure]}\n  - ",
     "violated: [failure], gate: [batery.getBatteryState]}\n  - ",
     "sentree.yaml:10:64: gate \"batery.getBatteryState\" of monitor \"battery\" matches no call of the project "
     "(SERVICE.METHOD); did you mean \"battery.getBatteryState\"?"},
    {"GateThatIsDeaf", "sentree.yaml", "violated: [failure]}\n  - ",
     "violated: [failure], gate: [\"navigation.*\"]}\n  - ",
     "sentree.yaml:10:64: monitor \"battery\" listens to none of the requests that it is to gate, so it would let all "
     "of them pass"},
    {"NoInterface", "sentree.yaml", "robot.thrift/Battery", "robots.thrift/Battery",
     "sentree.yaml:6:3: interface file \"robots.thrift\" is neither in the project's interfaces/ nor among those of "
     "Sentree"},
    {"TestControlAsService", "skills/BatteryLevelAbove.scxml", "target=\"battery\"", "target=\"simulation\"",
     "skills/BatteryLevelAbove.scxml:11:35: service \"simulation\" is test control; skills cannot reach it, scenarios "
     "can"},
    {"BadAddress", "sentree.yaml", "Battery,    at: sim", "Battery,    at: 'http://here'",
     "sentree.yaml:6:3: service \"battery\": address \"http://here\" begins with none of the known schemes; an address "
     "is unix:/path, tcp://host:port or tls://host:port"},
    {"AttributeNobodyDeclared", "mission.xml", "threshold=\"30\"", "threshold=\"30\" carrier=\"tcp\"",
     "mission.xml:14:72: warning: attribute \"carrier\" of BatteryLevelAbove is declared nowhere and is kept"},

    // What would make a monitor or a skill blind.
    {"EventOfNoMethod", "monitors/battery.scxml", "battery.getBatteryState.reply\" target=\"failure\"",
     "battery.getBateryState.reply\" target=\"failure\"",
     "monitors/battery.scxml:11:5: event \"battery.getBateryState.reply\" never comes: nothing in this project is "
     "observed so; did you mean \"battery.getBatteryState.reply\"?"},
    {"SourceOfNoLeaf", "monitors/battery.scxml", "=== 'BatteryLevelAbove30'\" target=\"get\"",
     "=== 'BatteryLevelAbove'\" target=\"get\"",
     "monitors/battery.scxml:7:23: 'BatteryLevelAbove' is no leaf of the mission; did you mean "
     "\"BatteryLevelAbove30\"?"},
    {"MisspeltMember", "skills/BatteryLevelAbove.scxml", "result.percentage", "result.percentge",
     "skills/BatteryLevelAbove.scxml:14:23: _event.data.result.percentge: BatteryState has no member \"percentge\"; "
     "did you mean \"percentage\"?"},
    {"MisspeltMemberOfAList", "skills/GoToLocation.scxml", "'ABORTED'", "['ABORTED'].lngth",
     "skills/GoToLocation.scxml:90:25: it.lngth: a list has no member \"lngth\"; did you mean \"length\"?"},
    {"MisspeltEnumerator", "skills/GoToLocation.scxml", "=== 'GOAL_REACHED'", "=== 'GOAL_REACHD'",
     "skills/GoToLocation.scxml:88:25: 'GOAL_REACHD' is no NavigationStatus; did you mean \"GOAL_REACHED\"?"},
    {"MisspeltEnumeratorInAList", "skills/GoToLocation.scxml", "'ABORTED'", "'ABORTD'",
     "skills/GoToLocation.scxml:90:25: 'ABORTD' is no NavigationStatus; did you mean \"ABORTED\"?"},
    {"NameOfNoData", "skills/BatteryLevelAbove.scxml", "&gt; threshold", "&gt; treshold",
     "skills/BatteryLevelAbove.scxml:6:5: warning: data \"threshold\" is never "
     "used\nskills/BatteryLevelAbove.scxml:14:23: \"treshold\" is declared nowhere: no <data> is called so; did you "
     "mean \"threshold\"?"},
    {"RatioComparedWithPercent", "monitors/battery.scxml", "percentage * 100 &lt; 20", "percentage &lt; 20",
     "monitors/battery.scxml:12:23: _event.data.result.percentage is a ratio from 0 to 1, and 20 is beyond; write 0.2, "
     "or multiply the value by 100"},
    {"VerdictOutOfReach", "monitors/battery.scxml", "target=\"failure\"", "target=\"idle\"",
     "monitors/battery.scxml:19:3: warning: state \"failure\" is never entered: no transition of a reachable state "
     "leads to it\nmonitors/battery.scxml:19:3: monitor \"battery\" can never be violated by state \"failure\": no "
     "transition of a reachable state leads to it"},
    {"InputWithoutValue", "mission.xml", " threshold=\"30\"", "",
     "mission.xml:14:11: input \"threshold\" of BatteryLevelAbove30 has no value, and skills/BatteryLevelAbove.scxml:6 "
     "needs one: write threshold=\"…\" here, or give the <data> an expr"},
    {"InputComparedWithAnEvent", "mission.xml", " destination=\"kitchen\"", "",
     "mission.xml:27:9: input \"destination\" of GoToKitchen has no value, and skills/GoToLocation.scxml:11 needs one: "
     "write destination=\"…\" here, or give the <data> an expr"},
    {"EntryThatNothingWrites", "mission.xml", "threshold=\"30\"", "threshold=\"{level}\"",
     "mission.xml:14:11: input \"threshold\" of BatteryLevelAbove30 reads blackboard entry \"level\", which nothing in "
     "the tree writes"},
    {"OutcomeOfNoCall", "skills/AtLocation.scxml", "navigation.checkNearToLocation.error error",
     "navigation.checkNearToLocation.eror error",
     "skills/AtLocation.scxml:22:5: event \"navigation.checkNearToLocation.eror\" never comes: a call ends with .reply "
     "or .error; did you mean \"navigation.checkNearToLocation.error\"?"},
    {"PlaceOfNoWorld", "requirements/recharge.req", "destination = kitchen", "destination = kitchn",
     "requirements/recharge.req:15:43: \"kitchn\" is no name in the mission, its world or its models, so nothing makes "
     "destination "
     "that; did you mean \"kitchen\"?"},
    {"PlaceOfNoWorldInAReply", "requirements/recharge.req", "always level >= 20 %.",
     "always level >= 20 % and reply(navigation.getNavigationState).target_name != kitchn.",
     "requirements/recharge.req:12:80: warning: \"kitchn\" is no name in the mission, its world or its models, so "
     "nothing makes reply(navigation.getNavigationState).target_name that; did you mean \"kitchen\"?"},
    {"NameOfNoChoice", "requirements/recharge.req", "always level >= 20 %.",
     "always level >= 20 % and not event(observation(robot.choice where name = plugs_n)).",
     "requirements/recharge.req:12:76: \"plugs_n\" is no name in the mission, its world or its models, so nothing "
     "makes "
     "name that; did you mean \"plugs_in\"?"},
    {"ValueOfNoChoice", "requirements/recharge.req", "always level >= 20 %.",
     "always level >= 20 % and not event(observation(robot.choice where name = plugs_in and value = tru)).",
     "requirements/recharge.req:12:97: warning: \"tru\" is no name in the mission, its world or its models, so nothing "
     "makes value that; did you mean \"true\"?"},
    {"OutputOfNoSkill", "requirements/recharge.req", "always level >= 20 %.",
     "always level >= 20 % and not event(observation(GoToKitchen.tick.reply where outputs.reason = NO_VALID_PAT)).",
     "requirements/recharge.req:12:96: warning: \"NO_VALID_PAT\" is no name in the mission, its world or its models, "
     "so "
     "nothing makes outputs.reason that; did you mean \"NO_VALID_PATH\"?"},
    {"UnreadableRequirements", "requirements/recharge.req", "within 10 ticks", "within 10 tiks",
     "requirements/recharge.req:16:64: expected a unit of the bound (ms, s, min, h, ticks, events), got \"tiks\"; did "
     "you mean \"ticks\"?"},
    {"SkillOfNoLeaf", "sentree.yaml",
     "monitors:", "skills: {BatteryLevelAbov: {file: skills/BatteryLevelAbove-buggy.scxml}}\nmonitors:",
     "sentree.yaml:9:10: the mission has no leaf \"BatteryLevelAbov\"; did you mean \"BatteryLevelAbove\"?"},
    {"RenamedEventThatNobodyHears", "sentree.yaml", "violated: [failure]}\n  - ",
     "violated: [failure], events: {tick: {on: mission.tick}}}\n  - ",
     "monitors/battery.scxml:6:5: event \"battery.getBatteryState.request\" never comes: \"events\" of monitor "
     "\"battery\" in sentree.yaml does not name it\nmonitors/battery.scxml:11:5: event "
     "\"battery.getBatteryState.reply\" never comes: \"events\" of monitor \"battery\" in sentree.yaml does not name "
     "it\nmonitors/battery.scxml:13:5: event \"battery.getBatteryState.reply\" never comes: \"events\" of monitor "
     "\"battery\" in sentree.yaml does not name it\nmonitors/battery.scxml:15:5: event "
     "\"battery.getBatteryState.error\" never comes: \"events\" of monitor \"battery\" in sentree.yaml does not name "
     "it\nsentree.yaml:10:73: monitor \"battery\": its chart has no transition for event \"tick\""},
    {"MainTreeOfNoTree", "mission.xml", "main_tree_to_execute=\"Main\"", "main_tree_to_execute=\"Man\"",
     "mission.xml:9:24: warning: there is no BehaviorTree \"Man\"; did you mean \"Main\"?"},
    {"TagWithoutBracket", "mission.xml", "<WaitForUser", ")WaitForUser",
     "mission.xml:17:9: warning: text inside <ReactiveSequence> means nothing: \")WaitForUser\""},
    {"NothingAsEnumerator", "skills/GoToLocation.scxml", "=== 'GOAL_REACHED'", "=== ''",
     "skills/GoToLocation.scxml:88:25: '' is no NavigationStatus"},
    {"TransitionWithoutBracket", "skills/BatteryNotRecharging.scxml", "<transition", ")transition",
     "skills/BatteryNotRecharging.scxml:5:3: warning: text inside <state> means nothing: \")transition\""},
    {"AddressOfASkill", "sentree.yaml", "monitors:", "skills: {WaitForUser: {at: \"user://here\"}}\nmonitors:",
     "sentree.yaml:9:10: skill \"WaitForUser\": address \"user://here\" begins with none of the known schemes; an "
     "address is unix:/path, tcp://host:port or tls://host:port"},
    {"AttributeOfAPort", "mission.xml", "<input_port name=\"threshold\" type", "<input_port name=\"threshold\" tpye",
     "mission.xml:34:36: warning: attribute \"tpye\" of a port means nothing; did you mean \"type\"?"},
    {"PlaceThatIsAssigned", "monitors/recharge.scxml", "expr=\"'station'\"", "expr=\"'statoin'\"",
     "monitors/recharge.scxml:37:41: warning: nothing else in this project makes target 'statoin'; did you mean "
     "\"station\"?"},
    {"NodeWhoseNameHasADot", "mission.xml", "name=\"GoToKitchen\"", "name=\"Go.To\"",
     "mission.xml:27:23: warning: name=\"Go.To\": a '.' is between the parts of a path; give the node another "
     "name\nsentree.yaml:19:33: nothing of this run that can be killed is called \"GoToKitchen\""},
    {"NodeThatIsNamedAsAnEntry", "mission.xml", "name=\"GoToKitchen\"", "name=\"{Go}\"",
     "mission.xml:27:23: warning: name=\"{Go}\": a name is text, and no entry of the blackboard takes its place; give "
     "the node another "
     "name\nsentree.yaml:19:33: nothing of this run that can be killed is called \"GoToKitchen\""},
    {"NoEntry", "mission.xml", "reason=\"{reason}\"", "reason=\"{}\"",
     "mission.xml:27:64: warning: \"{}\" names no entry of the blackboard, so it is a text of two brackets; write "
     "reason=\"{name}\""},
    {"InputOfASubTree", "mission.xml",
     "<GoToLocation name=\"GoToKitchen\" destination=\"kitchen\" reason=\"{reason}\"/>",
     "<SubTree ID=\"Go\" nmae=\"Go\" plcae=\"kitchen\"/></ReactiveFallback></ReactiveSequence></BehaviorTree>"
     "<BehaviorTree ID=\"Go\"><ReactiveSequence><ReactiveFallback>"
     "<GoToLocation name=\"GoToKitchen\" destination=\"{place}\"/>",
     "mission.xml:27:26: warning: nothing in tree \"Go\" reads or writes \"nmae\"; did you mean \"name\"?\n"
     "mission.xml:27:36: warning: nothing in tree \"Go\" reads or writes \"plcae\"; did you mean \"place\"?\n"
     "mission.xml:27:164: input \"destination\" of SubTree.GoToKitchen reads blackboard entry \"place\", "
     "which "
     "nothing in the tree writes\n"
     "sentree.yaml:19:33: nothing of this run that can be killed is called \"GoToKitchen\"; did you mean "
     "\"SubTree.GoToKitchen\"?"},
    {"TwoWordsThatAreCompared", "requirements/recharge.req", "destination = kitchen", "robot = kitchen",
     "requirements/recharge.req:15:35: \"robot\" and \"kitchen\" are words that stand for themselves; one of them "
     "should be defined by let"},
};

class BrokenProject : public testing::TestWithParam<Broken> {};

void edit(const fs::path& file, const Broken& broken) {
  if (broken.after == nullptr) {
    ASSERT_TRUE(fs::remove(file));
    return;
  }
  if (broken.before == nullptr) {
    std::ofstream(file) << broken.after;
    return;
  }
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::string content = text.str();
  const auto at = content.find(broken.before);
  ASSERT_NE(at, std::string::npos) << "the example no longer has " << broken.before;
  content.replace(at, std::string(broken.before).size(), broken.after);
  std::ofstream(file) << content;
}

TEST_P(BrokenProject, IsReportedExactly) {
  const Broken& broken = GetParam();
  const fs::path folder = fs::path(testing::TempDir()) / (std::string("broken-") + broken.name);
  fs::remove_all(folder);
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder, fs::copy_options::recursive);
  edit(folder / broken.file, broken);
  auto project = load_project(folder);
  ASSERT_TRUE(project.ok());
  const auto plan = prepare(plain_scenario(std::move(*project.value)));
  std::string messages;
  for (const Diagnostic& diagnostic : plan.diagnostics) {
    std::string text = to_string(diagnostic);
    for (auto at = text.find(folder.string() + "/"); at != std::string::npos; at = text.find(folder.string() + "/")) {
      text.erase(at, folder.string().size() + 1);
    }
    messages += (messages.empty() ? "" : "\n") + text;
  }
  EXPECT_EQ(messages, broken.message);
  fs::remove_all(folder);
}

// One after the other in one folder, as an editor sees them: what is known of before never changes what is said.
TEST(PartCache, SaysTheSameAsAFreshLook) {
  const fs::path folder = fs::path(testing::TempDir()) / "broken-part-cache";
  fs::remove_all(folder);
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder, fs::copy_options::recursive);
  fs::create_directory(folder / "interfaces");
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "interfaces/robot.thrift", folder / "interfaces/robot.thrift");
  PartCache cache;
  EXPECT_THAT(check_project(folder, cache), testing::IsEmpty());
  std::vector<Broken> edits(std::begin(kBroken), std::end(kBroken));
  edits.push_back({"MemberOfAnInterface", "interfaces/robot.thrift", "percentage", "percent", ""});
  edits.push_back({"PlaceOfTheWorld", "world/world.yaml", "  kitchen: [", "  larder: [", ""});
  for (const Broken& broken : edits) {
    const fs::path file = folder / broken.file;
    std::stringstream before;
    before << std::ifstream(file).rdbuf();
    edit(file, broken);
    EXPECT_EQ(check_project(folder, cache), check_project(folder)) << broken.name;
    EXPECT_THAT(check_project(folder, cache), testing::Not(testing::IsEmpty())) << broken.name;
    std::ofstream(file) << before.str();
    EXPECT_THAT(check_project(folder, cache), testing::IsEmpty()) << "after " << broken.name;
  }
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Table, BrokenProject, testing::ValuesIn(kBroken),
                         [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace sentree::project
