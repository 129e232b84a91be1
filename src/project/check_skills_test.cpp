#include "sentree/project/detail/check_skills.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/check_unnamed.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct ExampleEdit {
  const char* file;
  const char* before;  // null: the file is new
  const char* after;
};

// What is said of an example with these changes.
std::vector<std::string> told_of(const char* example, const std::vector<ExampleEdit>& edits) {
  const TemporaryFolder temporary("check-skills");
  const fs::path folder = temporary.path() / "project";
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples" / example, folder, fs::copy_options::recursive);
  for (const ExampleEdit& edit : edits) {
    std::string content = edit.after;
    if (edit.before != nullptr) {
      std::stringstream text;
      text << std::ifstream(folder / edit.file).rdbuf();
      content = text.str();
      const auto at = content.find(edit.before);
      EXPECT_NE(at, std::string::npos) << "the example no longer has " << edit.before;
      content.replace(at, std::string(edit.before).size(), edit.after);
    }
    std::ofstream(folder / edit.file) << content;
  }
  std::vector<std::string> messages;
  for (const Diagnostic& diagnostic : check_project(folder)) messages.push_back(to_string(diagnostic));
  return messages;
}

TEST(CheckSkills, TellsWhatTheyGiveBackToNobody) {
  const char* const said = "Find has no output port \"prat\"; did you mean \"part\"?";
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "name=\"part\"", "name=\"prat\""}}),
              Contains(HasSubstr(said)));
  // What is nearly called so, where the port is given too, is another.
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "<param name=\"part\"",
                                          "<param name=\"prat\" expr=\"found\"/><param name=\"part\""}}),
              Not(Contains(HasSubstr("prat"))));
}

// What a port without a type gives is text, also where it looks like a number.
TEST(CheckSkills, TellsThatAPortWithoutATypeIsNeverANumber) {
  const char* const ports = R"(<input_port name="percent" type="double"/>)";
  const ExampleEdit untyped{"mission.xml", ports, R"(<input_port name="percent"/>)"};
  const ExampleEdit entry{"mission.xml", "percent=\"20\"", "percent=\"{percent}\""};
  const auto asks = [](const char* condition) {
    return ExampleEdit{"skills/BatteryAbove.scxml", "_event.data.result.percentage * 100 &gt; percent", condition};
  };
  const auto said = Contains(AllOf(HasSubstr("they are never equal; port \"percent\" has no type"),
                                   HasSubstr("<input_port name=\"percent\" type=\"int\"/>")));
  EXPECT_THAT(told_of("minimal", {untyped, asks("_event.data.result.percentage === percent")}), said);
  EXPECT_THAT(told_of("minimal", {untyped, asks("_event.data.result.percentage * 100 === percent")}), said);
  EXPECT_THAT(told_of("minimal", {asks("_event.data.result.percentage === percent")}), Not(said));
  EXPECT_THAT(told_of("minimal", {untyped, asks("_event.data.result.percentage == percent")}), Not(said));
  EXPECT_THAT(told_of("minimal", {untyped, asks("percent === '20'")}), testing::IsEmpty());
  EXPECT_THAT(told_of("minimal", {untyped, entry, asks("_event.data.result.percentage === percent")}), Not(said));
}

TEST(CheckSkills, KnowsWhatListsAndExceptionsHave) {
  EXPECT_THAT(told_of("pick-and-place",
                      {{"interfaces/cell.thrift", "string findPart", "list<string> findPart"},
                       {"skills/Find.scxml", "_event.data.result !== ''", "_event.data.result.lenght === 1"}}),
              Contains(HasSubstr("a list has no member \"lenght\"; did you mean \"length\"?")));
  EXPECT_THAT(told_of("pick-and-place",
                      {{"skills/Find.scxml", "event=\"camera.findPart error\"",
                        "event=\"camera.findPart.error\" cond=\"_event.data.exception.Jammed.why === 'x'\""}}),
              Contains(HasSubstr("an exception of findPart has no member \"Jammed\"")));
  EXPECT_THAT(
      told_of("pick-and-place", {{"skills/Find.scxml", "event=\"camera.findPart error\"",
                                  "event=\"camera.findPart.error\" cond=\"_event.data.kind === 'interrupted'\""}}),
      Not(Contains(HasSubstr("interrupted"))));
}

TEST(CheckSkills, LooksIntoInvokedCharts) {
  const auto told_of_child = [](const std::string& child) {
    return told_of("pick-and-place",
                   {{"skills/Find.scxml", "  <final id=\"success\"",
                     "  <state id=\"unused\"><invoke src=\"../Child.scxml\"/></state>\n  <final id=\"success\""},
                    {"Child.scxml", nullptr, child.c_str()}});
  };
  EXPECT_THAT(told_of_child("<scxml version=\"1.0\"><state id=\"a\"><onentry><send type=\"thrift\" target=\"camra\" "
                            "event=\"findPart\"/></onentry></state></scxml>"),
              Contains(HasSubstr("service \"camra\" is not in sentree.yaml; did you mean \"camera\"?")));
  EXPECT_THAT(told_of_child("<scxml version=\"1.0\"><state id=\"a\"><transition target=\"b\"/></state></scxml>"),
              Contains(HasSubstr("the invoked chart cannot be loaded")));
  EXPECT_THAT(
      told_of("pick-and-place", {{"skills/Find.scxml", "  <final id=\"success\"",
                                  "  <state id=\"s\"><invoke src=\"Gone.scxml\"/></state>\n  <final id=\"success\""}}),
      Contains(HasSubstr("\"Gone.scxml\" cannot be invoked")));
}

// What it calls is called.
TEST(CheckSkills, KnowsWhatInvokedChartsCall) {
  const auto messages =
      told_of("recharge", {{"skills/BatteryLevelAbove.scxml",
                            "<onentry>\n      <send type=\"thrift\" target=\"battery\" event=\"getBatteryState\"/>\n"
                            "    </onentry>",
                            "<invoke src=\"../Child.scxml\" id=\"child\" autoforward=\"true\"/>"},
                           {"Child.scxml", nullptr,
                            "<scxml version=\"1.0\"><state id=\"a\"><onentry><send type=\"thrift\" "
                            "target=\"battery\" event=\"getBatteryState\"/></onentry></state></scxml>"}});
  EXPECT_THAT(messages, Not(Contains(HasSubstr("never calls battery.getBatteryState"))));
}

TEST(CheckSkills, SubscribeForChartsThatTheyForwardTo) {
  const auto told = [](const char* autoforward) {
    const std::string outer = fmt::format(
        "<scxml version=\"1.0\"><state id=\"a\"><invoke src=\"Child.scxml\" id=\"child\" autoforward=\"{}\"/>"
        "<transition event=\"done.invoke.child\" target=\"success\"/><transition event=\"halt\" "
        "target=\"halted\"/></state><final id=\"success\"/><final id=\"halted\"/></scxml>",
        autoforward);
    return told_of("topics", {{"skills/WaitUntilLow.scxml", nullptr, outer.c_str()},
                              {"skills/Child.scxml", nullptr,
                               "<scxml version=\"1.0\"><state id=\"a\"><transition event=\"battery.state\" "
                               "target=\"b\"/></state><final id=\"b\"/></scxml>"}});
  };
  const char* const unheard = "skills/WaitUntilLow.scxml has no transition for that event";
  EXPECT_THAT(told("true"), Not(Contains(HasSubstr(unheard))));
  EXPECT_THAT(told("false"), Contains(HasSubstr(unheard)));
}

TEST(CheckSkills, KnowWhatInvokedChartsSend) {
  const auto told = [](const char* sent, const char* target) {
    const std::string child = fmt::format(
        "<scxml version=\"1.0\"><state id=\"a\"><onentry><send event=\"{}\" target=\"{}\"/></onentry>"
        "<transition event=\"{}\"/></state></scxml>",
        sent, target, sent);
    return told_of("pick-and-place",
                   {{"skills/Find.scxml", "  <final id=\"success\"",
                     "  <state id=\"s\"><invoke src=\"Child.scxml\"/><transition event=\"seen\" target=\"success\"/>"
                     "</state>\n  <final id=\"success\""},
                    {"skills/Child.scxml", nullptr, child.c_str()}});
  };
  const char* const said = "event \"seen\" never arrives";
  EXPECT_THAT(told("seen", "#_parent"), Not(Contains(HasSubstr(said))));
  EXPECT_THAT(told("other", "#_parent"), Contains(HasSubstr(said)));
  EXPECT_THAT(told("seen", "#_internal"), Contains(HasSubstr(said)));
  // Of a chart that is not known, anything.
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "  <final id=\"success\"",
                                          "  <state id=\"s\"><invoke srcexpr=\"'a' + 'b'\"/><transition event=\"seen\" "
                                          "target=\"success\"/></state>\n  <final id=\"success\""}}),
              Not(Contains(HasSubstr(said))));
}

TEST(CheckSkills, TellsOfAnActionThatNeverEnds) {
  const auto told = [](const char* more) {
    const std::string chart = fmt::format(
        "<scxml version=\"1.0\" xmlns=\"http://www.w3.org/2005/07/scxml\"><state id=\"a\">{}</state>{}</scxml>", more,
        std::string_view(more).find("halted") == std::string_view::npos ? "" : "<final id=\"halted\"/>");
    return told_of("recharge", {{"skills/WaitForUser.scxml", nullptr, chart.c_str()}});
  };
  const char* const said = "the skill never ends, and its leaf is RUNNING until it is halted";
  EXPECT_THAT(told("<onentry><send event=\"again\" delay=\"1s\"/></onentry><transition event=\"again\" target=\"a\"/>"),
              Contains(AllOf(HasSubstr(said), HasSubstr("warning"), HasSubstr("skills/WaitForUser.scxml:1:1"))));
  // Where it is meant.
  EXPECT_THAT(told(""), Not(Contains(HasSubstr(said))));
  EXPECT_THAT(told("<onentry><send event=\"again\" delay=\"1s\"/></onentry><transition event=\"again\" target=\"a\"/>"
                   "<transition event=\"halt\" target=\"halted\"/>"),
              Not(Contains(HasSubstr(said))));
}

TEST(CheckSkills, TellsOfAnOutcomeThatEndsNothing) {
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "<final id=\"failure\"/>", "<state id=\"failure\"/>"}}),
              Contains(HasSubstr("state \"failure\" has no way out and ends nothing: write <final id=\"failure\"/>")));
}

TEST(CheckMonitors, TellsOfSendsThatNobodyReceives) {
  EXPECT_THAT(told_of("recharge", {{"monitors/battery.scxml", "<state id=\"failure\"/>",
                                    "<state id=\"s\"><onentry><send type=\"thrift\" target=\"navigation\" "
                                    "event=\"stopNavigation\"/></onentry></state>\n  <state id=\"failure\"/>"}}),
              Contains(HasSubstr("a monitor only watches: nobody receives its <send type=\"thrift\">")));
}

// A member that what a list holds lacks, wherever the list goes.
TEST(CheckSkills, KnowsWhatListsHold) {
  const ExampleEdit part{"interfaces/cell.thrift", "service Camera {\n  string findPart()",
                         "struct Part { 1: string label, 2: list<i32> sizes }\n"
                         "service Camera {\n  list<Part> findPart(), map<string, Part> shelf()"};
  const auto told = [&](const char* condition, const char* assigned = "_event.data.result[0].label") {
    return told_of("pick-and-place", {part,
                                      {"skills/Find.scxml", "_event.data.result !== ''", condition},
                                      {"skills/Find.scxml", "expr=\"_event.data.result\"", assigned}});
  };
  const char* const kFound = "expr=\"_event.data.result[0].label\"";
  EXPECT_THAT(
      told("_event.data.result[0].lable === 'mug'", kFound),
      Contains(HasSubstr("_event.data.result[0].lable: Part has no member \"lable\"; did you mean \"label\"?")));
  EXPECT_THAT(told("_event.data.result[0]['lable'] === 'mug'", kFound), Contains(HasSubstr("no member \"lable\"")));
  EXPECT_THAT(told("_event.data.result[0].sizes[1] === 'big'", kFound), Contains(HasSubstr("they are never equal")));
  EXPECT_THAT(told("_event.data.result.length > 0",
                   "expr=\"''\"/><foreach array=\"_event.data.result\" item=\"one\" index=\"i\"><assign "
                   "location=\"found\" expr=\"one.lable + i.lable\"/></foreach><log"),
              Contains(HasSubstr("one.lable: Part has no member \"lable\"")));
  for (const char* right : {"_event.data.result[0].label === 'mug' || _event.data.result[1].sizes.length > 2",
                            "_event.data.result[0].sizes[0] > 3 || _event.data.result[0]['label'] !== ''"})
    EXPECT_THAT(told(right, kFound), Not(Contains(HasSubstr("Find.scxml")))) << right;
}

TEST(CheckSkills, TellsOfRecordsThatAnInterfaceRefuses) {
  const auto told = [](const char* argument) {
    const std::string sent = std::string("event=\"pick\"><param name=\"part\" expr=\"") + argument + "\"/>";
    return told_of("pick-and-place",
                   {{"interfaces/cell.thrift", "service Arm {\n  void pick(1: string part)",
                     "union Thing { 1: string name, 2: i32 number }\nstruct Part { 1: Thing thing, 2: string colour }\n"
                     "service Arm {\n  void pick(1: Part part)"},
                    {"skills/Pick.scxml", "event=\"pick\"><param name=\"part\" expr=\"part\"/>", sent.c_str()}});
  };
  EXPECT_THAT(told("{thing: {name: 'mug', number: 3}, colour: part}"),
              Contains(HasSubstr("param \"part\".thing: union Thing holds one member, got \"name\" and \"number\"")));
  EXPECT_THAT(told("{thing: {name: part}}"), Contains(HasSubstr("Pick.scxml:")));
  EXPECT_THAT(told("{thing: {name: part}}"), Contains(HasSubstr("param \"part\".colour is missing")));
  EXPECT_THAT(told("{thing: {name: part}, colour: 'red'}"), Not(Contains(HasSubstr("Pick.scxml:"))));
}

TEST(CheckSkills, TellsOfPortsThatAreNoWordOfAnInterface) {
  const auto told = [](const char* bin, const char* type) {
    const std::string written = std::string("<Place name=\"Place\" bin=\"") + bin + "\"/>";
    const std::string declared = std::string("name=\"bin\" type=\"") + type + "\"";
    return told_of("pick-and-place",
                   {{"interfaces/cell.thrift", "service Arm {", "enum Bin { LEFT, RIGHT }\nservice Arm {"},
                    {"interfaces/cell.thrift", "place(1: string bin)", "place(1: Bin bin)"},
                    {"mission.xml", "<Place name=\"Place\" bin=\"left\"/>", written.c_str()},
                    {"mission.xml", "name=\"bin\" type=\"std::string\"", declared.c_str()}});
  };
  for (const char* type : {"std::string", "Bin"}) {
    EXPECT_THAT(told("LEFFT", type),
                Contains(HasSubstr("port \"bin\" of Place: \"LEFFT\" is no Bin; did you mean \"LEFT\"?")));
    EXPECT_THAT(told("middle", type), Contains(HasSubstr("\"middle\" is no Bin; there are LEFT, RIGHT")));
    for (const char* right : {"LEFT", "Bin.RIGHT", "1", "{part}"})
      EXPECT_THAT(told(right, type), Not(Contains(HasSubstr("is no Bin")))) << right;
  }
}

TEST(CheckSkills, TellsOfEntriesThatNobodyWritesForOtherNodesToo) {
  EXPECT_THAT(told_of("pick-and-place", {{"mission.xml", "num_cycles=\"3\"", "num_cycles=\"{rounds}\""}}),
              Contains(HasSubstr("mission.xml:6:7: port \"num_cycles\" of AllParts reads blackboard entry "
                                 "\"rounds\", which nothing in the tree writes")));
}

TEST(CheckScenarios, TellOfBreakpointsAtWhatNobodySays) {
  const auto told = [](const char* message) {
    const std::string scenario = std::string("timeline:\n  - {at: 1 s, breakpoint: {message: \"") + message + "\"}}\n";
    return told_of("pick-and-place", {{"scenarios/b.yaml", nullptr, scenario.c_str()}});
  };
  EXPECT_THAT(
      told("arm.pick.rply"),
      Contains(HasSubstr("b.yaml:2:5: warning: nothing in this project is observed as \"arm.pick.rply\", so it is "
                         "never reached; did you mean \"arm.pick.reply\"?")));
  EXPECT_THAT(told("amr.*"), Contains(HasSubstr("never reached")));
  for (const char* right : {"arm.pick.reply", "arm.*", "*.error", "mission.tick", "Find.log"})
    EXPECT_THAT(told(right), Not(Contains(HasSubstr("b.yaml")))) << right;
}

TEST(CheckMonitors, TellOfSourcesThatNeverSaySo) {
  const auto told = [](const char* on, const char* from) {
    const std::string entry =
        std::string("monitors:\n  - {file: m.scxml, events: {seen: {on: ") + on + ", from: \"" + from + "\"}}}";
    return told_of(
        "pick-and-place",
        {{"sentree.yaml", "monitors:", entry.c_str()},
         {"m.scxml", nullptr,
          "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\"><state><transition event=\"seen\" "
          "target=\"violated\"/></state><final id=\"violated\"/></scxml>"}});
  };
  EXPECT_THAT(told("arm.pick.request", "Place"),
              Contains(HasSubstr("event \"seen\" never comes from \"Place\": no leaf that is called so says "
                                 "arm.pick.request")));
  EXPECT_THAT(told("Find.log", "Place"), Contains(HasSubstr("never comes from")));
  EXPECT_THAT(told("arm.pick.request", "Place*"), Contains(HasSubstr("never comes from")));
  for (const auto& [on, from] : {std::pair("arm.pick.request", "Pick"),
                                 {"arm.*", "Place"},
                                 {"Find.*", "Find"},
                                 {"arm.pick.request", "P*"},
                                 {"arm.pick.request", "scenario"}})
    EXPECT_THAT(told(on, from), Not(Contains(HasSubstr("never comes from")))) << on << " " << from;
}

TEST(CheckSkills, TellsOfEntriesThatNobodyWritesAtAnyNode) {
  const auto told = [](const std::string& nodes) {
    return told_of("minimal",
                   {{"mission.xml", "<GoTo name=\"GoToDoor\"", (nodes + "<GoTo name=\"GoToDoor\"").c_str()}});
  };
  const char* const nobody = " reads blackboard entry \"n\", which nothing in the tree writes";
  for (const auto& [nodes, said] : std::vector<std::pair<std::string, std::string>>{
           {"<Sleep msec=\"{n}\"/>", "port \"msec\" of Sleep"},
           {"<Delay delay_msec=\"{n}\"><AlwaysSuccess/></Delay>", "port \"delay_msec\" of Delay"},
           {"<Timeout msec=\"{n}\"><AlwaysSuccess/></Timeout>", "port \"msec\" of Timeout"},
           {"<Repeat num_cycles=\"{n}\"><AlwaysSuccess/></Repeat>", "port \"num_cycles\" of Repeat"},
           {"<RetryUntilSuccessful num_attempts=\"{n}\"><AlwaysSuccess/></RetryUntilSuccessful>",
            "port \"num_attempts\""},
           {"<SetBlackboard value=\"1\" output_key=\"{n}\"/>", "port \"output_key\" of SetBlackboard"}}) {
    EXPECT_THAT(told(nodes),
                Contains(testing::AllOf(HasSubstr(said), HasSubstr(std::string(nobody) + ", so its tick fails"),
                                        Not(HasSubstr("warning")))));
    EXPECT_THAT(told("<Script code=\"n := 1\"/>" + nodes), Not(Contains(HasSubstr(nobody))));
  }
  EXPECT_THAT(
      told("<Switch2 variable=\"{n}\" case_1=\"1\" case_2=\"2\"><AlwaysSuccess/><AlwaysSuccess/><AlwaysSuccess/>"
           "</Switch2>"),
      Contains(HasSubstr("warning: port \"variable\" of Switch2" + std::string(nobody) + ", so its last child")));
  EXPECT_THAT(
      told("<LoopDouble queue=\"{n}\" value=\"{v}\"><AlwaysSuccess/></LoopDouble>"),
      Contains(HasSubstr("warning: port \"queue\" of LoopDouble" + std::string(nobody) + ", so there is no element")));
}

TEST(CheckSkills, TellsOfActionsThatHaltEachOtherForEver) {
  const auto told = [](const std::string& nodes) {
    return told_of("minimal",
                   {{"mission.xml", "<GoTo name=\"GoToDoor\"", (nodes + "<GoTo name=\"GoToDoor\"").c_str()}});
  };
  const std::string far = "<GoTo name=\"Far\" place=\"door\"/>";
  const std::string near = "<Sequence><GoTo name=\"Near\" place=\"desk\"/></Sequence>";
  const auto never = Contains(HasSubstr("warning: Near never gets to its end: Far before it is an action"));
  EXPECT_THAT(told("<ReactiveSequence>" + far + near + "</ReactiveSequence>"), never);
  EXPECT_THAT(told("<ReactiveFallback>" + far + near + "</ReactiveFallback>"), never);
  EXPECT_THAT(told("<Sequence>" + far + near + "</Sequence>"), Not(never));
  EXPECT_THAT(told("<ReactiveSequence><BatteryAbove name=\"Charged\" percent=\"20\"/>" + near + "</ReactiveSequence>"),
              Not(Contains(HasSubstr("never gets to its end"))));
}

// Of a project whose only leaf stands in a BehaviorTree that two SubTrees have.
std::string told_of_fetching(const std::string& given, const std::string& more, const std::string& requirement,
                             const std::string& scenario) {
  const TemporaryFolder temporary("check-fetching");
  const auto write = [&](const std::string& file, const std::string& content) {
    fs::create_directories((temporary.path() / file).parent_path());
    std::ofstream(temporary.path() / file) << content;
  };
  write("sentree.yaml",
        "mission: {file: mission.xml}\nservices:\n  arm: {interface: arm.thrift/Arm, at: tcp://127.0.0.1:4}\n"
        "monitors:\n  - {file: a.req}\n" +
            more);
  write("interfaces/arm.thrift", "service Arm {\n  bool take(1: string thing)\n}\n");
  write("mission.xml",
        "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><Sequence>"
        "<SubTree ID=\"Fetch\" name=\"FetchCup\" thing=\"cup\"/><SubTree ID=\"Fetch\" name=\"FetchPot\" thing=\"pot\"/>"
        "</Sequence></BehaviorTree><BehaviorTree ID=\"Fetch\"><Action ID=\"Grasp\" " +
            given + "/></BehaviorTree></root>\n");
  write("skills/Grasp.scxml",
        "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" initial=\"asking\">"
        "<datamodel><data id=\"thing\"/></datamodel><state id=\"asking\"><onentry><send type=\"thrift\" target=\"arm\" "
        "event=\"take\"><param name=\"thing\" expr=\"thing\"/></send></onentry>"
        "<transition event=\"halt\" target=\"halted\"/><transition event=\"arm.take.reply\" target=\"success\"/>"
        "<transition event=\"arm.take.error error\" target=\"failure\"/></state><final id=\"success\"/>"
        "<final id=\"failure\"/><final id=\"halted\"/></scxml>\n");
  write("a.req", "R: " + requirement + "\n");
  write("scenarios/a.yaml", "clock: real\nduration: 1 s\nexpect: {mission: SUCCESS}\n" + scenario);
  std::string all;
  for (const Diagnostic& found : check_project(temporary.path())) {
    Diagnostic one = found;
    one.span.file = fs::path(one.span.file).filename();
    all += to_string(one) + "\n";
  }
  return all;
}

TEST(CheckSkills, KnowsLeavesInSubTreesByTheirLastName) {
  const std::string given = "thing=\"{thing}\"";
  const std::string sound = "always request(arm.take).thing != pot.";
  EXPECT_EQ(told_of_fetching(given, "", sound, ""), "");
  EXPECT_THAT(
      told_of_fetching(given, "skills:\n  FetchCup.Grasp: {file: skills/Grasp.scxml}\n", sound, ""),
      HasSubstr("sentree.yaml:7:3: \"FetchCup.Grasp\" is a leaf's name in messages; skills go by the leaf's own "
                "name or ID: write \"Grasp\""));
  const char* const both = "; did you mean \"FetchCup.Grasp\" or \"FetchPot.Grasp\"?";
  for (const char* const entry : {"kill: Grasp", "force: {leaf: Grasp, status: FAILURE}"}) {
    EXPECT_THAT(told_of_fetching(given, "", sound, std::string("timeline:\n  - {at: 1 s, ") + entry + "}\n"),
                HasSubstr(both))
        << entry;
  }
  EXPECT_THAT(told_of_fetching(given, "", sound, "timeline:\n  - {at: 1 s, delay: {message: Grasp.tick, by: 1 s}}\n"),
              HasSubstr("; did you mean \"FetchCup.Grasp.tick\" or \"FetchPot.Grasp.tick\"?"));
  EXPECT_THAT(told_of_fetching(given, "", "never node(Grasp) in FAILURE.", ""), HasSubstr(both));
  EXPECT_THAT(told_of_fetching(given, "", "always request(arm.take from Grasp).thing != pot.", ""), HasSubstr(both));
  EXPECT_THAT(told_of_fetching(given, "", sound, "timeline:\n  - {at: 1 s, kill: Grasp, restart: Grasp}\n"),
              HasSubstr("; it has kill and restart, make two entries of it"));
}

TEST(CheckSkills, TellsOfALeafInTwoSubTreesOnce) {
  const std::string all = told_of_fetching("", "", "always request(arm.take).thing != cup.", "");
  EXPECT_THAT(all, HasSubstr("input \"thing\" of FetchCup.Grasp has no value"));
  EXPECT_THAT(all, Not(HasSubstr("input \"thing\" of FetchPot.Grasp")));
}

TEST(CheckSkills, KnowsTheTextsThatSubTreesAreGiven) {
  EXPECT_THAT(told_of_fetching("thing=\"{thing}\"", "", "always request(arm.take).thing != pott.", ""),
              HasSubstr("did you mean \"pot\"?"));
}

TEST(CheckSkills, NamesTheLeavesOfOneName) {
  const std::vector<ExampleEdit> twice{{"mission.xml", "name=\"GoToDesk\"", "name=\"GoToDoor\""}};
  const auto told = [&](ExampleEdit edit) {
    std::vector<ExampleEdit> edits = twice;
    edits.push_back(edit);
    return told_of("minimal", edits);
  };
  EXPECT_THAT(told_of("minimal", twice),
              Contains(HasSubstr("warning: two leaves are called \"GoToDoor\", this one and that at")));
  EXPECT_THAT(
      told({"scenarios/k.yaml", nullptr, "timeline:\n  - {at: 1 s, kill: GoToDoor}\n"}),
      Contains(HasSubstr("is called \"GoToDoor\"; several leaves have that name: say GoToDoor__3 or GoToDoor__4")));
  for (const char* requirement : {"R: never event(GoToDoor.halt).",
                                  "R: never request(navigation.stopNavigation from "
                                  "GoToDoor)."}) {
    EXPECT_THAT(told({"requirements/battery.req", nullptr, requirement}),
                Contains(HasSubstr("several leaves are called \"GoToDoor\"; say GoToDoor__3")))
        << requirement;
  }
  const std::vector<std::string> both =
      told({"sentree.yaml", "monitors:", "skills: {GoToDoor: {file: skills/GoTo.scxml}}\nmonitors:"});
  EXPECT_THAT(both, Not(Contains(HasSubstr("would be that of")))) << "one skill is that of both";
  EXPECT_THAT(
      told_of("minimal", {{"mission.xml", "name=\"BatteryOk\"", "name=\"GoToDoor\""},
                          {"sentree.yaml", "monitors:", "skills: {GoToDoor: {file: skills/GoTo.scxml}}\nmonitors:"}}),
      Contains(HasSubstr("skill \"GoToDoor\" would be that of leaves of several IDs: GoToDoor__2 "
                         "(BatteryAbove), GoToDoor__3 (GoTo); give one of them another name")));
}

TEST(CheckScenarios, TellOfABrokenInterfaceOnce) {
  EXPECT_THAT(
      told_of("pick-and-place", {{"sentree.yaml", "interface: cell.thrift/Arm", "interface: cel.thrift/Arm"},
                                 {"scenarios/b.yaml", nullptr,
                                  "timeline:\n  - {at: 1 s, unreachable: arm.pick}\n  - {at: 2 s, late: arm.pick}\n"}}),
      Not(Contains(HasSubstr("b.yaml"))));
}

TEST(CheckUnnamed, TellsOfFilesThatNothingNames) {
  const auto told = [](const std::vector<ExampleEdit>& edits) {
    const TemporaryFolder temporary("check-unnamed");
    const fs::path folder = temporary.path() / "project";
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/minimal", folder, fs::copy_options::recursive);
    fs::create_directory(folder / "models");
    for (const ExampleEdit& edit : edits) std::ofstream(folder / edit.file, std::ios::app) << edit.after;
    std::string all;
    const auto project = load_project(folder);
    EXPECT_TRUE(project.ok());
    Diagnostics found;
    if (project.ok()) check_unnamed(*project.value, found);
    for (const Diagnostic& one : found) all += to_string(one) + "\n";
    return all;
  };
  EXPECT_EQ(told({}), "");
  const std::string all =
      told({{"requirements/speed.req", nullptr, "R: always reply(batery.getBatteryState).percentage > 0.2."},
            {"monitors/other.scxml", nullptr, "<scxml/>"},
            {"models/other.scxml", nullptr, "<scxml/>"},
            {"skills/Unused.scxml", nullptr, "<scxml/>"},
            {"scenarios/other.yml", nullptr, "duration: 1 s"}});
  EXPECT_THAT(all,
              HasSubstr("requirements/speed.req: warning: requirements/speed.req is watched by nobody; name it under "
                        "monitors: - {file: requirements/speed.req}"));
  EXPECT_THAT(all, HasSubstr("speed.req:1:17: warning: the project has no service \"batery\""));
  EXPECT_THAT(all, HasSubstr("warning: monitors/other.scxml is watched by nobody"));
  EXPECT_THAT(all, HasSubstr("warning: models/other.scxml serves nobody; name it under models: - {file: "
                             "models/other.scxml, serves: […]}"));
  EXPECT_THAT(all, HasSubstr("note: skills/Unused.scxml is run by nobody: the mission has no leaf \"Unused\""));
  EXPECT_THAT(all, HasSubstr("warning: scenarios/other.yml is no scenario by its name, so it is not run; call it "
                             "scenarios/other.yaml"));
  // Named by a scenario, by another chart, in a comment.
  EXPECT_EQ(told({{"monitors/other.scxml", nullptr, "<scxml/>"},
                  {"scenarios/visit.yaml", nullptr, "\n# monitors/other.scxml\n"},
                  {"skills/Part.scxml", nullptr, "<scxml/>"},
                  {"skills/GoTo.scxml", nullptr, "<!-- src=\"Part.scxml\" -->"}}),
            "");
}

TEST(CheckUnnamed, TellsOfSkillsThatAreCalledLikeBuiltInNodes) {
  const auto told = [](const char* yaml) {
    const TemporaryFolder temporary("check-unnamed");
    const fs::path folder = temporary.path() / "project";
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/minimal", folder, fs::copy_options::recursive);
    std::ofstream(folder / "skills/Sequence.scxml") << "<scxml/>";
    std::ofstream(folder / "sentree.yaml", std::ios::app) << yaml;
    const auto project = load_project(folder);
    EXPECT_TRUE(project.ok());
    Diagnostics found;
    if (project.ok()) check_unnamed(*project.value, found);
    return found.empty() ? "" : to_string(found.front());
  };
  EXPECT_THAT(told(""), HasSubstr("warning: skills/Sequence.scxml is run by nobody: Sequence is a built-in node, and "
                                  "<Sequence> is that; call the skill otherwise"));
  EXPECT_EQ(told("# skills/Sequence.scxml\n"), "") << "named by its path";
}

TEST(CheckSkills, TellsOfAListWithAHole) {
  EXPECT_THAT(told_of("porter", {{"models/porter.scxml", "expr=\"[0, 1, 2]\"", "expr=\"[, 1, 2]\""}}),
              Contains(HasSubstr("nothing between two commas")));
}

TEST(CheckScenarios, TellOfAWorldThatThereIsNotToChange) {
  EXPECT_THAT(told_of("modelled", {{"scenarios/b.yaml", nullptr, "override: {world: {robots: []}}\n"}}),
              Contains(HasSubstr("changes a world, and the project has none (world: FILE)")));
}

}  // namespace
}  // namespace sentree::project
