#include "sentree/verify/any_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::verify {
namespace {

const std::string kChart = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// What is tried of a reply that one condition looks at; or why that is not known.
class AnyReplyOf : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    ASSERT_TRUE(text::write_file(path, text));
  }
  void tree(const std::string& inside) {
    write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + inside + "</BehaviorTree></root>");
  }
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
    return reply->tried.empty() ? "" : reply->tried.front();
  }

  std::string tried(const std::string& type, const std::string& condition, const std::string& port = "") {
    write("interfaces/door.thrift",
          "enum C { A, B, D }\nstruct S { 1: i32 a, 2: optional i32 o, 3: string s, 4: i32 b }\n"
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

  TemporaryFolder folder_{"any_reply"};
};

TEST_F(AnyReplyOf, TriesWhatComparisonsTellApart) {
  EXPECT_EQ(tried("i32", "v"), "ask: -1, 0, 1");
  EXPECT_EQ(tried("i32", "!v && true"), "ask: -1, 0, 1");
  EXPECT_EQ(tried("i32", "3 - 2 * v < -20"), "ask: 11, 12");
  EXPECT_EQ(tried("i32", "v > Math.min(port, 20)", "30"), "ask: 19, 20, 21, 25, 30, 31");
  EXPECT_EQ(tried("i32", "Math.abs(v) > 3"), "ask: -4, -3, -2, 0, 3, 4");
  EXPECT_EQ(tried("i32", "v == '3'"), "ask: 2, 3, 4");
  EXPECT_EQ(tried("i32", "v === 3000000000 || v > 5"), "ask: 4, 5, 6, 1500000002");
  EXPECT_EQ(tried("double", "v === 2.5"), "ask: 1.5, 2.5, 3.5");
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
  EXPECT_EQ(tried("i32", "v === _event.data.result"), "ask: -1, 0, 1") << "v is 0 to begin with";
  EXPECT_EQ(tried("string", "v === _event.data.result"), "ask: '', 'other'") << "one that came before";
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
            "a reply comes through the blackboard from another leaf and is compared");
  EXPECT_EQ(through_blackboard("<Action ID=\"Keep\" x=\"{v}\"/>"), "");
  EXPECT_EQ(through_blackboard("<Action ID=\"Read\" x=\"{w}\"/>"), "");
  const std::string kLooks = " looks at the entry v of the blackboard";
  EXPECT_EQ(through_blackboard("<Switch2 variable=\"{v}\" case_1=\"1\" "
                               "case_2=\"2\"><AlwaysSuccess/><AlwaysSuccess/><AlwaysSuccess/></Switch2>"),
            "Switch2" + kLooks);
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

}  // namespace
}  // namespace sentree::verify
