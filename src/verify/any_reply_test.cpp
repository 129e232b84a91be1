#include "sentree/verify/any_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <utility>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/scxml/script_syntax.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"
#include "sentree/verify/detail/test_in_folder.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

const std::string kChart = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// What is tried of a reply that one condition looks at; or why that is not known.
class AnyReplyOf : public InFolder {
 protected:
  AnyReplyOf() : InFolder("any_reply") {}

  // The first member that is tried, or why that is not known.
  std::string told(const std::string& more = "") {
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: "
          "'tcp://localhost:1'}}\n" +
              more);
    auto project = project::load_project(folder_.path());
    if (!project.ok()) return to_string(project.diagnostics.front());
    const auto prepared = project::prepare(project::plain_scenario(std::move(*project.value)));
    if (!prepared.ok()) return to_string(prepared.diagnostics.front());
    const auto reply = any_reply(*prepared.value, "door");
    const auto before_comma = [](const std::string& text) { return text.substr(0, text.find(',')); };
    if (!reply) return before_comma(reply.error().message);
    if (reply->unsure) return before_comma(reply->unsure->message);
    tried_ = reply->tried;
    return reply->tried.empty() ? "" : reply->tried.front();
  }
  std::vector<std::string> tried_;

  std::string tried(const std::string& type, const std::string& condition, const std::string& port = "") {
    write("interfaces/door.thrift",
          "enum C { A, B, D }\nstruct S { 1: i32 a, 2: optional i32 o, 3: string s, 4: i32 b }\n"
          "struct P { 1: i32 x }\nstruct Way { 1: P near, 2: P far }\n"
          "service Door { " +
              type + " ask() }\n");
    write("skills/Ask.scxml",
          kChart + R"(initial="a"><datamodel><data id="port"/><data id="v" expr="0"/></datamodel><state id="a">
<onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" target="b"><assign location="v" expr="_event.data.result"/></transition></state>
<state id="b"><transition cond=")" +
              text::xml_escape(condition) + R"(" target="success"/>
<transition target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
    tree("<Condition ID=\"Ask\" port=\"" + port + "\"/>");
    return told();
  }
};

TEST_F(AnyReplyOf, TriesWhatComparisonsTellApart) {
  EXPECT_EQ(tried("i32", "v"), "ask: -1, 0, 1");
  EXPECT_EQ(tried("i32", "!v && true"), "ask: -1, 0, 1");
  EXPECT_EQ(tried("i32", "3 - 2 * v < -20"), "ask: 11, 12");
  EXPECT_EQ(tried("i32", "v > Math.min(port, 20)", "30"), "ask: 19, 20, 21, 25, 30, 31");
  EXPECT_EQ(tried("i32", "Math.abs(v) > 3"), "ask: -4, -3, -2, 0, 3, 4");
  EXPECT_EQ(tried("i32", "v == '3'"), "ask: 2, 3, 4");
  EXPECT_EQ(tried("i32", "v === 3000000000 || v > 5"), "ask: 4, 5, 6, 1500000002");
  EXPECT_EQ(tried("double", "Math.floor(v) > 2 && v !== 2.1"), "ask: 1.5, 2, 2.05, 2.1, 2.55, 3, 3.5, NaN");
  EXPECT_EQ(tried("double", "1 / v > 4"), "ask: -0.125, 0, 0.125, 0.25, 0.375, NaN");
  EXPECT_EQ(tried("double", "v === 2.5"), "ask: 1.5, 2.5, 3.5, NaN");
  EXPECT_EQ(tried("bool", "v"), "ask: false, true");
  EXPECT_EQ(tried("string", "v"), "ask: '', 'other'");
  EXPECT_EQ(tried("string", "v === port", "kitchen"), "ask: 'kitchen', 'other'");
  EXPECT_EQ(tried("string", "['a', 'b'].indexOf(v) >= 0"), "ask: 'a', 'b', 'other'");
  EXPECT_EQ(tried("C", "v === 'B'"), "ask: 'B', 'A'");
  EXPECT_EQ(tried("S", "v.o === undefined"), "ask.o is there: true, false");
  EXPECT_EQ(tried("S", "typeof v.o === 'undefined'"), "ask.o is there: true, false");
  EXPECT_EQ(tried("S", "'o' in v"), "ask.o is there: true, false");
  EXPECT_EQ(tried("S", "port in v", "o"), "ask.o is there: true, false");
  EXPECT_EQ(tried("i32", "(v || 5) > 7"), "ask: -1, 0, 1, 3, 7, 8");
  EXPECT_EQ(tried("i32", "v === _event.data.result"), "ask: -2, -1, 0, 1, 2") << "v is 0 to begin with";
  EXPECT_EQ(tried("i32", "v > _event.data.result && v < 5"), "ask: -2, -1, 0, 1, 2, 5, 6, 7") << "both can be below 5";
  EXPECT_EQ(tried("string", "v === _event.data.result"), "ask: '', 'other'") << "one that came before";
}

// All of an earlier reply and of the next one may differ, or any two of them be alike.
TEST_F(AnyReplyOf, TriesAsManyValuesAsAStructureHoldsOfOneName) {
  EXPECT_EQ(tried("P", "v.x === _event.data.result.x"), "ask.x: -2, -1, 0, 1, 2");
  EXPECT_EQ(tried("Way", "v.near.x === _event.data.result.far.x"), "ask.near.x: -4, -3, -2, -1, 0, 1, 2, 3, 4");
}

TEST_F(AnyReplyOf, IsRefusedWhereWhatIsToldApartIsNotKnown) {
  for (const char* condition : {"v.trim() === 'kitchen'", "v.toLowerCase() === 'kitchen'", "v[0] === 'k'",
                                "v + 'x' === 'ax'", "(v || 'x') === 'a'"})
    EXPECT_EQ(tried("string", condition), "a reply is changed before it is compared with a text") << condition;
  EXPECT_EQ(tried("string", "v < 'a'"), "a reply is ordered as a text");
  EXPECT_EQ(tried("i32", "v % 7 === 3"), "a reply is compared after %");
  EXPECT_EQ(tried("i32", "(v & 4) !== 0"), "a reply is compared after &");
  EXPECT_EQ(tried("i32", "Math.pow(v, 2) === 9"), "a reply is given to Math.pow()");
  EXPECT_EQ(tried("i32", "[1, 2][v] === 2"), "a reply chooses by an index");
  EXPECT_EQ(tried("i32", "v === port", "{n}"), "a reply is compared with what is no constant");
  EXPECT_EQ(tried("string", "v.length > 3"), "a reply has its length looked at");
  EXPECT_EQ(tried("list<i32>", "v.length > 0"), "a reply has its length looked at");
  EXPECT_EQ(tried("S", "v.a * v.b > 10"), "a reply is compared after * with what is no constant");
  EXPECT_EQ(tried("i32", "v > (v === 1 ? 3 : Math.pow(2, 3))"), "a reply is compared with what is no constant");
  EXPECT_EQ(tried("i32", "v > (v === 1 ? 3 : 17 % 9)"), "a reply is compared with what is no constant");
  EXPECT_EQ(tried("i32", "v == true"), "a reply is compared by == with a truth value");
  EXPECT_EQ(tried("i32", "(function(x) { return x === 7; })(v) === true"), "a reply is looked at in a function");
  EXPECT_EQ(tried("string", "v.startsWith('a') === true"), "a reply has its startsWith looked at");
  EXPECT_EQ(tried("string", "v.match('a') !== null"), "a reply has its match looked at");
  EXPECT_EQ(tried("i32", "v in {7: 1}"), "a reply is looked for among members");
  EXPECT_EQ(tried("i32", "[v].indexOf(7) >= 0"), "a reply is kept in an object");
  EXPECT_EQ(tried("i32", "isFinite(1 / v) === false"), "a reply is given to isFinite()");
  EXPECT_EQ(tried("i32", "({7: true})[v] === true"), "a reply chooses by an index");
  for (const char* condition : {"v == 5", "v > 3", "+v === 3", "Number(v) === 3", "v - 1 === 2"})
    EXPECT_EQ(tried("string", condition), "a reply is a text that counts as a number") << condition;
}

// What a chart makes of a reply: executable content of the transition that takes it, and a state to go to.
class AnyReplyInto : public AnyReplyOf {
 protected:
  std::string made(const std::string& content, const std::string& behind = "", const std::string& params = "") {
    write("interfaces/door.thrift", "service Door { i32 ask(), void tell(1: i32 x) }\n");
    write("skills/Ask.scxml",
          kChart +
              "initial=\"a\"><datamodel><data id=\"v\" expr=\"0\"/><data id=\"o\" expr=\"({x: 0})\"/></datamodel>"
              "<state id=\"a\"><onentry><send type=\"thrift\" target=\"door\" event=\"ask\"/></onentry>"
              "<transition event=\"door.ask.reply\" target=\"b\">" +
              content + "</transition></state><state id=\"b\">" + behind +
              "<transition event=\"tick\" target=\"success\"/></state><final id=\"success\"><donedata>" + params +
              "</donedata></final></scxml>");
    return told();
  }
  std::string through_blackboard(const std::string& reader) {
    tree("<Sequence><Action ID=\"Ask\" out=\"{v}\"/>" + reader + "</Sequence>");
    return made("<assign location=\"v\" expr=\"_event.data.result\"/>", "", "<param name=\"out\" expr=\"v\"/>");
  }
};

TEST_F(AnyReplyInto, IsRefusedWhereItDecidesWhatNoComparisonTells) {
  tree("<Action ID=\"Ask\"/>");
  const std::string kResult = "_event.data.result";
  EXPECT_EQ(made("<send event=\"e\" delayexpr=\"_event.data.result + 'ms'\"/>"),
            kResult + " decides when an event comes");
  EXPECT_EQ(made("<send eventexpr=\"'go' + _event.data.result\"/>"), kResult + " decides which event is sent");
  EXPECT_EQ(made("<send event=\"e\"><param name=\"v\" expr=\"_event.data.result\"/></send>"),
            kResult + " is handed on in an event");
  EXPECT_EQ(made("<foreach array=\"[_event.data.result]\" item=\"i\"/>"), kResult + " is kept in an object");
  EXPECT_EQ(made("<assign location=\"o.x\" expr=\"_event.data.result\"/>"),
            kResult + " is kept in a member of a variable");
  EXPECT_EQ(made("<assign location=\"v\" expr=\"_event.data['result']\"/>"), "a reply is looked into by an index");
  EXPECT_EQ(made("<script>v = _event.data.result;</script>"), "a reply is looked at in a <script>");
  EXPECT_EQ(made("<assign location=\"v\" expr=\"v + _event.data.result\"/>",
                 "<transition cond=\"v === 15\" target=\"success\"/>"),
            kResult + " is compared after + with what is no constant");
  EXPECT_EQ(
      made("<assign location=\"v\" expr=\"_event.data.result > 3 ? '1s' : '2s'\"/><send event=\"e\" delayexpr=\"v\"/>"),
      "ask: 2, 3, 4")
      << "what a comparison tells is known";
  EXPECT_EQ(made("<log expr=\"_event.data.result\"/>"), "");
}

TEST_F(AnyReplyInto, IsFollowedThroughTheBlackboard) {
  write("skills/Read.scxml",
        kChart +
            "initial=\"a\"><datamodel><data id=\"x\"/></datamodel><state id=\"a\"><transition "
            "event=\"tick\" cond=\"x > 4\" target=\"success\"/></state><final id=\"success\"/></scxml>");
  write("skills/Keep.scxml",
        kChart +
            "initial=\"a\"><datamodel><data id=\"x\"/></datamodel><state id=\"a\"><transition "
            "event=\"tick\" target=\"success\"><log expr=\"x\"/></transition></state><final id=\"success\"/></scxml>");
  EXPECT_EQ(through_blackboard("<Action ID=\"Read\" x=\"{v}\"/>"),
            "a reply comes through the blackboard or a topic from another leaf and is compared");
  EXPECT_EQ(through_blackboard("<Action ID=\"Keep\" x=\"{v}\"/>"), "");
  EXPECT_EQ(through_blackboard("<Action ID=\"Read\" x=\"{w}\"/>"), "");
  const std::string kLooks = " looks at the entry v of the blackboard";
  EXPECT_EQ(through_blackboard("<Switch2 variable=\"{v}\" case_1=\"1\" "
                               "case_2=\"2\"><AlwaysSuccess/><AlwaysSuccess/><AlwaysSuccess/></Switch2>"),
            "Switch2" + kLooks);
  EXPECT_EQ(through_blackboard("<Action ID=\"Read\" x=\"{@v}\"/>"),
            "a reply comes through the blackboard or a topic from another leaf and is compared");
  EXPECT_EQ(through_blackboard("<ScriptCondition code=\"v > 3\"/>"), "ScriptCondition" + kLooks);
  EXPECT_EQ(through_blackboard("<AlwaysSuccess _skipIf=\"v > 3\"/>"), "AlwaysSuccess" + kLooks);
}

TEST_F(AnyReplyInto, IsRefusedWhereARequirementComparesTwoOrWhatIsHandedOn) {
  tree("<Action ID=\"Ask\"/>");
  const std::string yaml = "monitors: [{file: r.req}]\n";
  const std::string kTell =
      "<send type=\"thrift\" target=\"door\" event=\"tell\"><param name=\"x\" expr=\"2 * _event.data.result\"/></send>";
  EXPECT_EQ(made(kTell), "") << "nobody looks at it";
  write("r.req", "low: never request(door.tell).x > 7.\n");
  EXPECT_EQ(told(yaml), "_event.data.result is handed on as the argument x of a call");
  write("skills/Two.scxml", kChart +
                                "initial=\"a\"><state id=\"a\"><onentry><send type=\"thrift\" target=\"door\" "
                                "event=\"ask\"/></onentry></state></scxml>");
  tree("<Sequence><Action ID=\"Ask\"/><Action ID=\"Two\"/></Sequence>");
  made("");
  write("r.req", "two: never reply(door.ask from Ask) - reply(door.ask from Two) = 3.\n");
  EXPECT_EQ(told(yaml), "a reply is compared after - with what is no constant");
}

TEST_F(AnyReplyOf, IsRefusedWhereSomebodyLooksAtWhatAChartMakesOfIt) {
  const std::string yaml = "monitors: [{file: r.req}]\n";
  write("interfaces/door.thrift", "service Door { i32 ask() }\n");
  const auto chart = [&](const std::string& done, const std::string& more = "") {
    write("skills/Ask.scxml", kChart + R"(initial="a"><datamodel><data id="v"/></datamodel><state id="a">)" + more + R"(
<onentry><send type="thrift" target="door" event="ask"/></onentry><transition event="door.ask.reply" target="success">
<assign location="v" expr="_event.data.result"/><log label="it" expr="v"/></transition></state>
<final id="success">)" + done + R"(</final><final id="failure"/></scxml>)");
  };
  tree("<Action ID=\"Ask\" out=\"{n}\"/>");
  chart("<donedata><param name=\"out\" expr=\"v\"/></donedata>");
  write("r.req", "five: never observation(Ask.tick.reply).outputs.out = 5.\n");
  EXPECT_EQ(told(yaml), "a reply is given as the output out");
  write("r.req", "five: never observation(Ask.log).text = \"5\".\n");
  EXPECT_EQ(told(yaml), "a reply is logged");
  write("r.req", "fails: never node(Ask) in FAILURE.\n");
  EXPECT_EQ(told(yaml), "");
  chart("", R"(<invoke type="scxml" autoforward="true"><content><scxml xmlns="http://www.w3.org/2005/07/scxml"
version="1.0"><state/></scxml></content></invoke>)");
  EXPECT_THAT(told(yaml), testing::HasSubstr("autoforward"));
  chart("");
  write("m.scxml",
        kChart + R"(><state><transition event="five" target="violated"/></state><final id="violated"/></scxml>)");
  EXPECT_EQ(told("monitors: [{file: m.scxml, events: {five: {on: door.ask.reply, when: result === 5}}}]\n"),
            "the event five of monitor m is made of a reply of door");
}

TEST_F(AnyReplyOf, IsRefusedWhereSomebodyWaitsForWhatIsPublished) {
  write("interfaces/door.thrift", "service Door { i32 ask(), oneway void opened(1: i32 by) }\n");
  write("skills/Ask.scxml", kChart + R"(initial="a"><state id="a"><transition event="door.opened" target="success"/>
<transition event="halt" target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
  tree("<Action ID=\"Ask\"/>");
  EXPECT_EQ(told("skills: {Ask: {subscribe: [door.opened]}}\n"), "Ask waits for door.opened");
}

// What is assigned elsewhere than by <assign> is no constant.
TEST_F(AnyReplyOf, TakesNothingForAConstantThatAScriptChanges) {
  write("interfaces/door.thrift", "service Door { i32 ask() }\n");
  tree("<Action ID=\"Ask\"/>");
  const auto with = [&](const std::string& script, const std::string& content = "") {
    write("skills/Ask.scxml", kChart + R"(initial="a"><datamodel><data id="m" expr="[0, 0]"/><data id="v" expr="0"/>
<data id="lim" expr="70"/></datamodel>)" +
                                  script + R"(<state id="a"><onentry><send type="thrift" target="door" event="ask"/>)" +
                                  content + R"(</onentry>
<transition event="door.ask.reply" cond="_event.data.result === lim" target="failure"/>
<transition event="door.ask.reply" target="success"/></state><final id="success"/><final id="failure"/></scxml>)");
    return told();
  };
  EXPECT_EQ(with(""), "ask: 69, 70, 71");
  EXPECT_EQ(with("<script>function near(a) { return a === lim; }</script>"), "ask: 69, 70, 71") << "it is only read";
  const std::string kNoConstant = "_event.data.result is compared with what is no constant";
  EXPECT_EQ(with("<script>lim = 77;</script>"), kNoConstant);
  EXPECT_EQ(with("<script>(lim) = 77;</script>"), kNoConstant);
  EXPECT_EQ(with("<script>function up() { lim = 77; return 1; }</script>", "<assign location=\"v\" expr=\"up()\"/>"),
            kNoConstant);
  EXPECT_EQ(with("", "<log expr=\"lim = 77\"/>"), kNoConstant);
  EXPECT_EQ(with("", "<assign location=\"m[lim++]\" expr=\"1\"/>"), kNoConstant);
  EXPECT_EQ(with("", "<send event=\"e\" idlocation=\"lim\"/>"), kNoConstant);
  EXPECT_EQ(with("<script>eval('li' + 'm = 77');</script>"), kNoConstant);
  // Monitors too.
  with("");
  write("m.scxml", kChart + R"(><datamodel><data id="lim" expr="70"/></datamodel><script>lim = 77;</script><state>
<transition event="door.ask.reply" cond="_event.data.result === lim" target="violated"/></state><final id="violated"/></scxml>)");
  EXPECT_EQ(told("monitors: [{file: m.scxml}]\n"), kNoConstant);
}

// What is sent comes back in the answer.
TEST_F(AnyReplyOf, IsFollowedIntoArgumentsThatComeBack) {
  write("interfaces/door.thrift", "service Door { i32 ask(), i32 tell(1: i32 x, 2: i32 y = 8) }\n");
  tree("<Action ID=\"Ask\"/>");
  const auto with = [&](const std::string& passed, const std::string& transition) {
    write("skills/Ask.scxml", kChart + R"(initial="a"><datamodel><data id="v"/></datamodel><state id="a"><onentry>
<send type="thrift" target="door" event="ask"/></onentry><transition event="door.ask.reply"><send type="thrift" target="door"
event="tell"><param name="x" expr=")" +
                                  passed + R"("/></send></transition><transition )" + transition +
                                  R"( target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
    return told();
  };
  const std::string kResult = "_event.data.result";
  EXPECT_EQ(with(kResult, "event=\"door.tell.reply\" cond=\"_event.data.args.x === 77\""), "ask: 76, 77, 78");
  EXPECT_EQ(with(kResult, "event=\"error.communication\" cond=\"_event.data.args.x > 7\""), "ask: 6, 7, 8");
  EXPECT_EQ(with(kResult + " + 7", "event=\"door.tell.reply\" cond=\"_event.data.args.x === 77\""), "ask: 69, 70, 71");
  EXPECT_EQ(with("77", "event=\"door.tell.reply\" cond=\"_event.data.result === _event.data.args.x\""),
            "ask: 76, 77, 78");
  EXPECT_EQ(with("77", "event=\"door.tell.reply\" cond=\"_event.data.result === _event.data.args.y\""),
            kResult + " is compared with what is no constant");
  EXPECT_EQ(with(kResult, "event=\"door.tell.reply\" cond=\"JSON.stringify(_event.data.args) === '{}'\""),
            "a reply is changed before it is compared with a text");
  EXPECT_EQ(with(kResult, "event=\"door.tell.reply\" cond=\"_event.data.args['x'] === 77\""),
            "a reply chooses by an index");
}

TEST_F(AnyReplyInto, IsRefusedWhereItGoesByTheWay) {
  tree("<Action ID=\"Ask\"/>");
  const std::string kResult = "_event.data.result";
  const std::string kLooks = "<transition cond=\"v === 77\" target=\"success\"/>";
  EXPECT_EQ(made("<log expr=\"v = _event.data.result\"/>", kLooks), kResult + " is assigned inside an expression");
  EXPECT_EQ(made("<log expr=\"'at ' + _event.data.result.toFixed(1) + JSON.stringify(_event.data.result)\"/>"), "");
  EXPECT_EQ(made("<log expr=\"Object.keys(_event.data.result)\"/>"), kResult + " is given to Object.keys()");
  EXPECT_EQ(made("<log expr=\"JSON.stringify(_event.data.result, Object.keys)\"/>"),
            kResult + " is given to JSON.stringify()");
  EXPECT_EQ(
      made("<send type=\"thrift\" target=\"door\" event=\"tell\"><param name=\"x\" expr=\"_event.data.result\"/></send>"
           "<assign location=\"v\" expr=\"_event.data\"/>"),
      "a reply is kept among all that its event holds");
  EXPECT_EQ(made("<assign location=\"o[_event.data.result]\" expr=\"1\"/>"), kResult + " chooses by an index");
  EXPECT_EQ(made("<script>eval('v = _ev' + 'ent.data.result')</script>", kLooks),
            "a reply may be looked at by way of eval");
}

TEST_F(AnyReplyInto, IsRefusedWhereOthersLookAtIt) {
  const std::string kTopic = "skills: {Hear: {subscribe: [note.said]}}\n";
  const std::string kSay =
      "<send type=\"thrift\" target=\"note\" event=\"said\"><param name=\"x\" expr=\"_event.data.result\"/></send>";
  const auto published = [&](const std::string& more) {
    made(kSay);
    write("interfaces/note.thrift", "service Note { oneway void said(1: i32 x) }\n");
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: "
          "'tcp://localhost:1'}, note: {interface: note.thrift/Note, at: topics}}\nmodels: [{file: far.scxml, "
          "subscribe: [note.said]}]\n" +
              more);
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto prepared = project::prepare(project::plain_scenario(std::move(*project.value)));
    for (const Diagnostic& one : prepared.diagnostics) EXPECT_NE(one.severity, Severity::kError) << to_string(one);
    const auto reply = any_reply(*prepared.value, "door");
    EXPECT_TRUE(reply);
    return reply->unsure ? reply->unsure->message.substr(0, reply->unsure->message.find(',')) : std::string();
  };
  const auto far = [&](const std::string& transition) {
    write("far.scxml", kChart + "><datamodel><data id=\"v\"/></datamodel><state>" + transition + "</state></scxml>");
  };
  const auto hear = [&](const std::string& condition) {
    write("skills/Hear.scxml", kChart + "initial=\"a\"><state id=\"a\"><transition event=\"note.said\" " + condition +
                                   " target=\"success\"/></state><final id=\"success\"/></scxml>");
  };
  tree("<Parallel success_count=\"2\"><Action ID=\"Ask\"/><Action ID=\"Hear\"/></Parallel>");
  far("<transition event=\"note.said\"/>");
  hear("");
  EXPECT_EQ(published(kTopic), "");
  hear("cond=\"_event.data.x === 77\"");
  EXPECT_EQ(published(kTopic), "a reply comes through the blackboard or a topic from another leaf and is compared");
  hear("");
  far("<transition event=\"note.said\" cond=\"_event.data.x === 77\"/>");
  EXPECT_EQ(published(kTopic), "_event.data.result is published as x");
  far("<transition event=\"note.said\"><assign location=\"v\" expr=\"_event.data\"/></transition>");
  EXPECT_EQ(published(kTopic), "_event.data.result is handed on as the argument x of a call")
      << "all of it is kept, and may be looked at";
}

TEST_F(AnyReplyInto, IsRefusedWhereAMonitorSeesItInAnInput) {
  write("skills/Keep.scxml", kChart + R"(initial="a"><datamodel><data id="x"/></datamodel><state id="a">
<transition event="tick" target="success"/></state><final id="success"/></scxml>)");
  EXPECT_EQ(through_blackboard("<Action ID=\"Keep\" x=\"{v}\"/>"), "");
  const std::string kSees = "a reply of door comes through the blackboard into the input x of Keep";
  write("r.req", "r: never observation(Keep.tick.request).inputs.x = 77.\n");
  EXPECT_EQ(told("monitors: [{file: r.req}]\n"), kSees);
  const auto sees = [&](const std::string& condition) {
    write("m.scxml", kChart + "><state><transition event=\"Keep.tick.request\" cond=\"" + condition +
                         "\" target=\"violated\"/></state><final id=\"violated\"/></scxml>");
    return told("monitors: [{file: m.scxml}]\n");
  };
  EXPECT_EQ(sees("_event.data.inputs.x === 77"), kSees);
  // All of them.
  EXPECT_THAT(sees("_event.data.inputs['x'] === 77"),
              testing::HasSubstr("comes through the blackboard into the input"));
  EXPECT_THAT(sees("_event['data'].inputs.x === 77"), testing::HasSubstr("a reply is given as the output out"));
}

TEST_F(AnyReplyOf, IsRefusedWhereWhatAnErrorSaysIsCompared) {
  write("interfaces/door.thrift",
        "exception Stuck { 1: i32 at }\nservice Door { i32 ask() throws (1: Stuck stuck) }\n");
  tree("<Action ID=\"Ask\"/>");
  const auto says = [&](const std::string& condition, const std::string& content = "") {
    write("skills/Ask.scxml",
          kChart + R"(initial="a"><state id="a"><onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.error" )" +
              condition + R"( target="failure">)" + content + R"(</transition>
<transition event="door.ask.reply" target="success"/></state><final id="success"/><final id="failure"/></scxml>)");
    return told();
  };
  EXPECT_EQ(says("", "<log expr=\"_event.data.message\"/>"), "");
  EXPECT_EQ(says("cond=\"_event.data.message === 'ajar'\""), "_event.data.message is compared");
}

TEST_F(AnyReplyOf, IsRefusedWhereItAnswersATick) {
  write("interfaces/door.thrift", "service Door { i32 ask() }\n");
  tree("<Action ID=\"Ask\"/>");
  const auto answers = [&](const std::string& status) {
    write("skills/Ask.scxml", kChart +
                                  R"(initial="w"><state id="w"><transition event="T"><send type="thrift" target="door"
event="ask"/></transition><transition event="door.ask.reply"><send event="ANS"><param name="status" expr=")" +
                                  text::xml_escape(status) + R"("/></send></transition></state></scxml>)");
    return told(
        "skills: {Ask: {protocol: {tick: T, answer: {event: ANS, param: status, values: {10: SUCCESS, 11: FAILURE, "
        "12: RUNNING}}}}}\n");
  };
  EXPECT_EQ(answers("_event.data.result"), "_event.data.result decides how a tick is answered");
  EXPECT_EQ(answers("_event.data.result > 5 ? 10 : 11"), "ask: 4, 5, 6");
}

TEST_F(AnyReplyOf, TriesNumbersWithoutBoundsBeyondTheGreatestAndNone) {
  EXPECT_EQ(tried("double", "v > 1e308"), "ask: 9.999999999999998e+307, 1e+308, 1.0000000000000002e+308, NaN");
  EXPECT_EQ(tried("double", "!(v < 5) && !(v >= 5)"), "ask: 4, 5, 6, NaN");
  EXPECT_EQ(tried("double", "v > -1e308 && v < 1e308"),
            "ask: -1.7976931348623157e+308, -1e+308, 0, 1e+308, 1.7976931348623157e+308, NaN");
  EXPECT_EQ(tried("double", "1 / v === 0"), "a reply is compared after / with what only an endless number comes to");
  write("interfaces/door.thrift", "struct R { 1: double r (min = \"0\", max = \"1\") }\nservice Door { R ask() }\n");
  write("skills/Ask.scxml",
        kChart + R"(initial="a"><state id="a"><onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" cond="_event.data.result.r > 0.5" target="success"/></state><final id="success"/></scxml>)");
  EXPECT_EQ(told(), "ask.r: 0, 0.5, 1") << "bounds say that it is a number";
}

// A monitor compares what is handed back: with constants too, where skills pass them.
TEST_F(AnyReplyInto, TriesConstantsThatAMonitorSeesHandedBack) {
  write("m.scxml", kChart + R"(initial="a"><datamodel><data id="r"/></datamodel><state id="a">
<transition event="door.ask.reply"><assign location="r" expr="_event.data.result"/></transition>
<transition event="door.tell.request" cond="_event.data.args.x === r" target="violated"/></state><final id="violated"/></scxml>)");
  const std::string yaml = "monitors: [{file: m.scxml}]\n";
  const auto tell = [&](const std::string& passed) {
    tree("<Action ID=\"Ask\"/>");
    made("<send type=\"thrift\" target=\"door\" event=\"tell\"><param name=\"x\" expr=\"" + passed + "\"/></send>");
    return told(yaml);
  };
  EXPECT_EQ(tell("77"), "ask: 75, 76, 77, 78, 79");
  EXPECT_EQ(tell("_event.data.result"), "ask: -2, -1, 0, 1, 2");
  EXPECT_EQ(tell("2 * _event.data.result"), "_event.data.result is handed on as the argument x of a call");
  EXPECT_EQ(tell("Math.random()"), "a reply is compared with an argument that is no constant");
}

TEST_F(AnyReplyOf, TriesOtherEnumeratorsAndNoneWhereOneIsComparedWithAnEarlierOne) {
  EXPECT_EQ(tried("C", "v === _event.data.result"), "ask: 'A', 'B'");
  EXPECT_EQ(tried("C", "v < _event.data.result"), "ask: 'A', 'B', 'D'");
  tried("S", "v.o === _event.data.result.o");
  EXPECT_THAT(tried_, testing::Contains("ask.o is there: true, false"));
}

// Replies that are ordered against earlier ones.
class Rows : public AnyReplyOf {
 protected:
  // A skill that succeeds with the eighth reply of a row, each above the one before; with `sign` otherwise.
  void counts(const std::string& type, const std::string& sign) {
    write("interfaces/door.thrift", "struct S { 1: " + type + ", 2: bool b }\nservice Door { S ask() }\n");
    write("skills/Count.scxml", kChart + R"(initial="a"><datamodel><data id="last" expr="0"/><data id="n" expr="0"/>
</datamodel><state id="a"><onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" target="b">
  <if cond="_event.data.result.x )" +
                                    text::xml_escape(sign) +
                                    R"( last"><assign location="n" expr="n &lt; 8 ? n + 1 : 8"/>
  <else/><assign location="n" expr="0"/></if><assign location="last" expr="_event.data.result.x"/></transition></state>
<state id="b"><transition cond="n === 8" target="success"/><transition event="tick" target="a"/><transition event="halt" target="failure"/></state>
<final id="success"/><final id="failure"/></scxml>)");
    tree("<Action ID=\"Count\"/>");
  }
  Verification verified(const std::string& requirements) {
    write("r.req", requirements);
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: "
          "'tcp://localhost:1'}}\nmonitors: [{file: r.req}]\n");
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok());
    project::Scenario scenario = project::plain_scenario(std::move(*project.value));
    auto plan = project::prepare(with_models(scenario));
    EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
    const auto any = add_models(scenario, *plan.value, folder_.path() / "any");
    EXPECT_TRUE(any);
    plan = project::prepare(with_models(std::move(scenario)));
    EXPECT_TRUE(plan.ok());
    Asked asked;
    asked.untried = untried(*any);
    told_.clear();
    for (const Untried& one : asked.untried) told_ += to_string(one.told) + "\n";
    return verify(*plan.value, asked);
  }
  std::string told_;
};

TEST_F(Rows, AreNotAllTriedWhereASkillOrdersReplies) {
  const std::string kNever = "rows: never node(Count) in SUCCESS.\n";
  for (const char* type : {"i32 x", "double x (min = \"0\", max = \"1\")", "i32 x (min = \"0\", max = \"40\")"}) {
    SCOPED_TRACE(type);
    counts(type, ">");
    const Verification found = verified(kNever);
    EXPECT_EQ(found.judgements.front().finding, Finding::kUnknown);
    EXPECT_THAT(found.judgements.front().limit,
                testing::HasSubstr("door.ask.x is ordered against earlier replies at "));
    EXPECT_FALSE(found.graph.complete);
    EXPECT_TRUE(found.not_reached.empty()) << "a longer row may reach it";
    EXPECT_THAT(told_, testing::AllOf(testing::HasSubstr("Count.scxml:4:13: "), testing::HasSubstr("write a model")));
  }
  // What is tried is tried.
  EXPECT_EQ(verified("shut: always reply(door.ask).b.\n").judgements.front().finding, Finding::kRefuted);
  // Other values tell only alike from different: two of them do.
  counts("i32 x", "!==");
  EXPECT_EQ(verified(kNever).judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(told_, "");
}

TEST_F(Rows, AreAllTriedWhereTheInterfaceBoundsThem) {
  counts("i32 x (min = \"0\", max = \"7\")", ">");
  const Verification seven = verified("rows: never node(Count) in SUCCESS.\n");
  EXPECT_EQ(seven.judgements.front().finding, Finding::kHolds);
  EXPECT_TRUE(seven.graph.complete);
  EXPECT_EQ(told_, "");
  counts("i32 x (min = \"0\", max = \"8\")", ">");
  EXPECT_EQ(verified("rows: never node(Count) in SUCCESS.\n").judgements.front().finding, Finding::kRefuted);
}

TEST_F(Rows, OfOneRequirementLeaveTheOthersComplete) {
  write("interfaces/door.thrift", "service Door { i32 ask() }\n");
  for (const char* name : {"One", "Two"}) {
    write(std::string("skills/") + name + ".scxml",
          kChart +
              "initial=\"a\"><state id=\"a\"><onentry><send type=\"thrift\" target=\"door\" event=\"ask\"/></onentry>"
              "<transition event=\"door.ask.reply\" target=\"success\"/></state><final id=\"success\"/></scxml>");
  }
  tree("<Sequence><Action ID=\"One\"/><Action ID=\"Two\"/></Sequence>");
  const Verification found = verified(
      "let one = reply(door.ask from One)\nlet two = reply(door.ask from Two)\n"
      "grows: whenever one < two, one < two eventually.\nfails: never node(One) in FAILURE.\n");
  EXPECT_EQ(found.judgements[0].finding, Finding::kUnknown);
  EXPECT_EQ(found.judgements[1].finding, Finding::kHolds);
  EXPECT_TRUE(found.graph.complete);
  EXPECT_THAT(told_, testing::HasSubstr("r.req:3:"));
}

// A port's entry is not what the chart's variable begins with.
TEST_F(AnyReplyOf, TakesNoFirstValueForThatOfAPort) {
  tried("i32", "v > port");
  write("skills/Ask.scxml", kChart + R"(initial="a"><datamodel><data id="port" expr="30"/></datamodel><state id="a">
<onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" cond="_event.data.result > port" target="success"/>
<transition event="door.ask.reply" target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
  tree("<Condition ID=\"Ask\"/>");
  EXPECT_EQ(told(), "ask: 29, 30, 31") << "nothing is bound to it";
  tree("<Condition ID=\"Ask\" port=\"{n}\"/>");
  EXPECT_EQ(told(), "_event.data.result is compared with what is no constant");
}

// Conditions on a reply, as people write them and as they do not.
class RandomCondition {
 public:
  explicit RandomCondition(std::uint64_t seed) : rng_(seed) {}

  std::string truth(int depth) {
    switch (one_of(depth > 0 ? 14 : 5)) {
      case 0:
        return number(depth - 1) + pick({" < ", " <= ", " > ", " >= ", " === ", " !== ", " == "}) + number(depth - 1);
      case 1: return text(depth - 1) + pick({" === ", " !== ", " == "}) + text(depth - 1);
      case 2: return pick({"r.b", "r.b === true", "r.b !== false", "r.b == true"});
      case 3: return pick({"r.o === undefined", "r.o != null", "'o' in r", "typeof r.o === 'number'"});
      case 4: return number(depth - 1);
      case 5: return "(" + truth(depth - 1) + ") && (" + truth(depth - 1) + ")";
      case 6: return "(" + truth(depth - 1) + ") || (" + truth(depth - 1) + ")";
      case 7: return "!(" + truth(depth - 1) + ")";
      case 8: return text(depth - 1);
      case 9: return "(" + truth(depth - 1) + ") === " + pick({"true", "false"});
      case 10: return "[" + number(0) + ", 7].indexOf(" + number(depth - 1) + ") >= 0";
      case 11: return "['a', " + text(0) + "].indexOf(" + text(depth - 1) + ") " + pick({">= 0", "=== 1", "< 0"});
      case 12: return number(depth - 1) + pick({" == true", " === true", " === null"});
      default: return "(" + truth(depth - 1) + ") ? (" + truth(depth - 1) + ") : (" + truth(depth - 1) + ")";
    }
  }
  std::string number(int depth) {
    switch (one_of(depth > 0 ? 12 : 4)) {
      case 0:
      case 1: return pick({"r.a", "r.a", "v", "v", "p"});
      case 2: return std::to_string(static_cast<int>(rng_.uniform(0, 24)) - 6);
      case 3: return pick({"r.o", "5", "w", "c"});
      case 4: return "(" + number(depth - 1) + pick({" + ", " - ", " * ", " / "}) + number(depth - 1) + ")";
      case 5: return "(" + number(depth - 1) + pick({" % 3", " & 4", " * 2", " - 3"}) + ")";
      case 6: return pick({"Math.abs(", "Math.floor(", "Math.round(", "Number("}) + number(depth - 1) + ")";
      case 7: return pick({"Math.min(", "Math.max("}) + number(depth - 1) + ", " + number(0) + ")";
      case 8: return "((" + truth(depth - 1) + ") ? " + number(depth - 1) + " : " + number(depth - 1) + ")";
      case 9: return "(" + number(depth - 1) + pick({" || ", " && "}) + number(0) + ")";
      case 10: return pick({"-", "+"}) + std::string("(") + number(depth - 1) + ")";
      default:
        return pick({"r.s.length", "(function(x) { return x + 1; })(r.a)", "[1, 2, 3][r.a]", "Math.pow(r.a, 2)"});
    }
  }
  std::string text(int depth) {
    switch (one_of(depth > 0 ? 6 : 3)) {
      case 0:
      case 1: return "r.s";
      case 2: return pick({"'a'", "'b'", "''", "'5'"});
      case 3: return "((" + truth(depth - 1) + ") ? " + text(depth - 1) + " : " + text(depth - 1) + ")";
      case 4: return "(" + text(depth - 1) + " || 'b')";
      default: return pick({"r.s.trim()", "(r.s + 'x')", "String(r.a)"});
    }
  }
  // Values for members of a reply, whatever is done with them.
  std::string reply(bool is_whole) {
    std::string numbers = "pick('a'";
    for (int i = -16; i <= 36; i += is_whole ? 4 : 3) numbers += ", " + std::to_string(i / 4.0);
    for (int i = 0; i < 2; ++i) numbers += ", " + std::to_string(static_cast<int>(rng_.uniform(0, 2'000)) - 1'000);
    return "({a: " + numbers +
           "), s: pick('s', '', 'a', 'b', '5', 'x'), b: pick('b', true, false), o: pick('o', null, 0, 5, "
           "-3)})";
  }

 private:
  std::uint64_t one_of(std::uint64_t count) {
    return std::min(count - 1, static_cast<std::uint64_t>(rng_.uniform(0, static_cast<double>(count))));
  }
  std::string pick(const std::vector<std::string>& all) { return all[one_of(all.size())]; }

  Rng rng_;
};

// What is tried brings about whatever any reply does, also beside an earlier one, p, or it is refused.
TEST_F(AnyReplyOf, BringsAboutWhatRandomRepliesDo) {
  tree("<Action ID=\"Ask\"/>");
  int tried = 0;
  for (const std::uint64_t seed : seeds(40)) {
    RandomCondition random(seed);
    const bool is_whole = seed % 2 == 0;
    write("interfaces/door.thrift", std::string("struct S { 1: ") + (is_whole ? "i32" : "double") +
                                        " a, 2: string s, 3: bool b, 4: optional i32 o }\nservice Door { S ask() }\n");
    std::string condition = random.truth(3);
    const std::string kept = random.number(1);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + condition + ", v: " + kept);
    const auto replied = [](std::string text) {
      for (std::size_t at = text.find("r."); at != std::string::npos; at = text.find("r.", at + 20)) {
        if (at > 0 && std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0) continue;
        text.replace(at, 2, "_event.data.result.");
      }
      if (text.ends_with("in r")) text.replace(text.size() - 1, 1, "_event.data.result");
      return text;
    };
    write(
        "skills/Ask.scxml",
        kChart +
            (scxml::names_in_script(condition + ";" + kept).contains("p") ? R"(initial="first">)" : R"(initial="a">)") +
            R"(<datamodel><data id="r"/><data id="v" expr="0"/><data id="w" expr="2"/><data id="c" expr="4"/><data id="p" expr="1"/></datamodel>
<state id="first"><onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" target="kept"><assign location="p" expr="_event.data.result.a"/></transition></state>
<state id="kept"><transition event="tick" target="a"/><transition event="halt" target="failure"/></state>
<state id="a"><onentry><send type="thrift" target="door" event="ask"/></onentry>
<transition event="door.ask.reply" target="b"><assign location="r" expr="_event.data.result"/><assign location="v" expr=")" +
            text::xml_escape(replied(kept)) + R"("/></transition></state>
<state id="b"><transition cond=")" +
            text::xml_escape(condition) + R"(" target="success"/>
<transition target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
    const auto outcomes = [&](bool any) -> std::optional<std::pair<bool, bool>> {
      write("sentree.yaml",
            std::string(
                "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: ") +
                (any ? "'tcp://localhost:1'}}\n"
                     : "model}}\nmodels: [{file: models/door.scxml, name: keeper, serves: [door]}]\n"));
      auto project = project::load_project(folder_.path());
      EXPECT_TRUE(project.ok());
      project::Scenario scenario = project::plain_scenario(std::move(*project.value));
      auto plan = project::prepare(with_models(scenario));
      if (!plan.ok()) {
        EXPECT_TRUE(any) << to_string(plan.diagnostics.front());
        return std::nullopt;
      }
      if (any) {
        if (!add_models(scenario, *plan.value, folder_.path() / "any")) return std::nullopt;
        plan = project::prepare(with_models(std::move(scenario)));
      }
      const Verification found = verify(*plan.value, {});
      if (!found.errors.empty()) {
        EXPECT_TRUE(any) << to_string(found.errors.front());
        return std::nullopt;
      }
      const auto never = [&](const std::string& what) {
        return std::find(found.not_reached.begin(), found.not_reached.end(), what) != found.not_reached.end();
      };
      return std::pair(!never("leaf Ask never succeeds"), !never("leaf Ask never fails"));
    };
    const auto by_any = outcomes(true);
    if (!by_any) continue;
    write("models/door.scxml", kChart + R"(initial="there"><state id="there"><transition event="door.ask.request">
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr=")" +
                                   text::xml_escape(random.reply(is_whole)) +
                                   "\"/></send></transition></state></scxml>");
    const auto by_random = outcomes(false);
    ASSERT_TRUE(by_random);
    ++tried;
    EXPECT_TRUE(by_any->first || !by_random->first) << "a reply that succeeds is not tried";
    EXPECT_TRUE(by_any->second || !by_random->second) << "a reply that fails is not tried";
  }
  std::cout << tried << " of " << seeds(40).size() << " conditions are understood\n";
  EXPECT_TRUE(is_one_seed() || tried > 10);
}

}  // namespace
}  // namespace sentree::verify
