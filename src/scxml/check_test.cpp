#include "sentree/scxml/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/text/file.h"

namespace sentree::scxml {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string checked_document(std::string_view body, std::string_view data_model = "ecmascript") {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"" + std::string(data_model) +
         "\">\n" + std::string(body) + "</scxml>";
}

std::vector<std::string> texts(const Diagnostics& diagnostics) {
  std::vector<std::string> result;
  for (const Diagnostic& diagnostic : diagnostics) result.push_back(to_string(diagnostic));
  return result;
}

std::vector<std::string> checked_messages(std::string_view body) {
  return texts(load(checked_document(body), "door.scxml").diagnostics);
}

std::vector<std::string> check_messages(std::string_view body, const CheckOptions& options = {}) {
  const auto loaded = load(checked_document(body), "door.scxml");
  EXPECT_TRUE(loaded.ok()) << testing::PrintToString(texts(loaded.diagnostics));
  return loaded.ok() ? texts(check(*loaded.value, options)) : std::vector<std::string>();
}

TEST(Load, NamesAnUnknownTargetAndTheNearestState) {
  EXPECT_THAT(checked_messages(R"(<state id="open"><transition event="e" target="opne"/></state>)"),
              ElementsAre(R"(door.scxml:2:48: transition target "opne" is not a state; did you mean "open"?)"));
}

TEST(Load, ReportsAllProblemsAtOnce) {
  EXPECT_THAT(
      checked_messages(
          "<state id=\"a\" initial=\"b\"/>\n<state id=\"a\"/>\n<stat/>\n<state><onentry><sned/></onentry></state>"),
      testing::SizeIs(4));
}

TEST(Load, RefusesWhatCannotBeActiveTogether) {
  EXPECT_THAT(checked_messages(R"(<state id="a"><transition event="e" target="a b"/></state><state id="b"/>)"),
              ElementsAre(HasSubstr(R"(targets "a" and "b" cannot be active together)")));
}

TEST(Load, RefusesNestingBeyondTheBound) {
  std::string deep;
  for (int i = 0; i < 250; ++i) deep += "<state>";
  for (int i = 0; i < 250; ++i) deep += "</state>";
  EXPECT_THAT(checked_messages(deep), Contains(HasSubstr("nested more than 200 deep")));
}

TEST(Load, RefusesMoreStatesThanTheBound) {
  LoadOptions options;
  options.limits.states_max = 3;
  EXPECT_THAT(texts(load(checked_document("<state/><state/><state/><state/>"), {}, options).diagnostics),
              Contains(HasSubstr("more than 3 states")));
}

TEST(Load, WarnsOfAnAttributeThatNobodyKnows) {
  EXPECT_THAT(checked_messages(R"(<state id="a"><transition evnet="e"/></state>)"),
              ElementsAre(HasSubstr(R"(<transition> has no attribute "evnet"; it is ignored; did you mean "event"?)")));
}

TEST(Check, FindsExpressionsThatDoNotParse) {
  EXPECT_THAT(check_messages(R"(<state id="a"><transition event="e" cond="x ==== 1"/><onentry><script>
    var y = ;</script></onentry></state>)"),
              ElementsAre(testing::StartsWith("door.scxml:2:"),
                          testing::StartsWith("door.scxml:3:1: the script does not parse: SyntaxError")));
}

TEST(Check, FindsStatesThatAreNeverEntered) {
  EXPECT_THAT(check_messages(R"(<state id="a"/><state id="island"><state id="inner"/></state>)"),
              ElementsAre(HasSubstr(R"(state "island" is never entered)")));
}

TEST(Check, FindsTransitionsThatAnEarlierOneAlwaysTakes) {
  EXPECT_THAT(
      check_messages(
          R"(<state id="a"><transition event="e"/><transition event="e.x" cond="true"/><transition event="f"/></state>)"),
      ElementsAre(HasSubstr("this transition of state \"a\" is never taken")));
}

TEST(Check, FindsEventsWithoutHandlerAndHandlersWithoutEvent) {
  CheckOptions options;
  options.external_events = std::vector<std::string>{"halt"};
  EXPECT_THAT(
      check_messages(
          R"(<state id="a"><onentry><raise event="tik"/></onentry><transition event="halt tick done.state.b"/></state>)",
          options),
      ElementsAre(HasSubstr(R"(event "tik" is raised, but no transition handles it; did you mean "tick"?)"),
                  HasSubstr(R"(event "tick" is handled, but nobody sends it; did you mean "tik"?)"),
                  HasSubstr("there is no state \"b\"")));
}

TEST(Check, FindsDataThatNobodyUses) {
  EXPECT_THAT(
      check_messages(
          R"(<datamodel><data id="x"/><data id="y"/></datamodel><state id="a"><onentry><log expr="y"/></onentry></state>)"),
      ElementsAre(HasSubstr("data \"x\" is never used")));
}

TEST(Check, FindsTransitionsThatAreTakenForEver) {
  EXPECT_THAT(
      check_messages("<state id=\"a\"><transition/></state>"),
      ElementsAre(HasSubstr("door.scxml:2:15: warning: this transition of state \"a\" has neither an event nor a "
                            "condition and leads back to it")));
  EXPECT_THAT(check_messages("<state id=\"a\"><transition target=\"a\"/></state>"),
              ElementsAre(HasSubstr("is taken for ever")));
  EXPECT_THAT(check_messages("<state id=\"a\"><transition target=\"b\"/></state><final id=\"b\"/>"), IsEmpty());
}

TEST(Check, FindsSendsToNobody) {
  const auto sent_to = [](const std::string& target) {
    return check_messages(
        "<state id=\"a\"><onentry><send event=\"e\" target=\"" + target +
        "\"/></onentry><invoke id=\"child\"><content><scxml version=\"1.0\"><final/></scxml></content>"
        "</invoke><transition event=\"e\" target=\"b\"/></state><final id=\"b\"/>");
  };
  EXPECT_THAT(sent_to("_self"), ElementsAre(HasSubstr("nobody is \"_self\": write #_internal")));
  EXPECT_THAT(sent_to("#_chlid"), ElementsAre(HasSubstr("did you mean \"#_child\"?")));
  for (const char* there : {"#_child", "#_parent", "#_internal", "#_scxml_1", "scxml:other"})
    EXPECT_THAT(sent_to(there), IsEmpty()) << there;
}

TEST(Check, FindsWhatOnlyBrowsersHaveAndNewerLanguage) {
  const auto script = [](const std::string& text) {
    return check_messages("<state id=\"a\"><onentry><script>" + text + "</script></onentry></state>");
  };
  EXPECT_THAT(script("console.log('x')"), ElementsAre(HasSubstr("charts have no \"console\": write <log> to print")));
  EXPECT_THAT(script("var console = 1; console + 1"), IsEmpty());
  EXPECT_THAT(script("var f = x =&gt; x"), ElementsAre(HasSubstr("scripts are ECMAScript 5.1")));
}

TEST(Check, TellsWhatToWriteForBuiltinsOfNewerEngines) {
  const auto told = [](const std::string& condition) {
    return check_messages(
        "<datamodel><data id=\"xs\" expr=\"[1, 2]\"/></datamodel><state id=\"a\"><transition event=\"e\" cond=\"xs, " +
        condition + "\" target=\"b\"/></state><final id=\"b\"/>");
  };
  EXPECT_THAT(told("xs.includes(2)"),
              ElementsAre(testing::AllOf(HasSubstr("door.scxml:2:"),
                                         HasSubstr("without includes() of lists: write xs.indexOf(x) >= 0"))));
  EXPECT_THAT(told("xs.find(f) == 2"), ElementsAre(HasSubstr("without find(): write xs.filter(f)[0]")));
  EXPECT_THAT(told("Object.values(xs)"), ElementsAre(HasSubstr("without Object.values: write Object.keys(o).map")));
  EXPECT_THAT(told("new Map() == new Map()"), ElementsAre(HasSubstr("without Map: write an object")));
  EXPECT_THAT(told("Promise.resolve(1)"), ElementsAre(HasSubstr("without Promise: write <send>")));
  EXPECT_THAT(told("['a', 'b'].includes(xs)"), ElementsAre(HasSubstr("without includes()")));
  EXPECT_THAT(told("Object.keys(xs).includes('a')"), ElementsAre(HasSubstr("without includes()")));
  // Of scripts, the line.
  EXPECT_THAT(
      check_messages("<state id=\"a\"><onentry><script>\n  var b = 'x';\n  b.padStart(3);</script></onentry></state>"),
      ElementsAre(HasSubstr("door.scxml:4:1")));
}

TEST(Check, SaysNothingOfBuiltinsWhereItIsNotSure) {
  const auto told = [](const std::string& script) {
    return check_messages(
        "<datamodel><data id=\"xs\" expr=\"[1, 2]\"/></datamodel><state id=\"a\"><onentry><script>xs; " + script +
        "</script></onentry></state>");
  };
  for (const char* const fine :
       {"'abc'.includes('a')",                               // texts have it
        "xs = 'abc'; xs.includes('a')",                      // no list any more
        "xs[0].includes('a')", "_event.data.includes('a')",  // who knows
        "var tree = {find: function (x) { return x; }}; tree.find(1)", "xs['at'] = f; xs.at(1)",
        "function Map() {} new Map()", "if (xs.find) xs.find(f)", "Object.values &amp;&amp; Object.values(xs)",
        "typeof Set === 'undefined' || new Set()", "Object.assign({}, {a: 1}); Math.sign(1); Number.isInteger(1)",
        "// xs.find(1)\n'xs.find(1)'"})
    EXPECT_THAT(told(fine), IsEmpty()) << fine;
}

TEST(Check, FindsParametersThatTheInvokedChartHasNoDataFor) {
  LoadOptions options;
  options.read = [](std::string_view uri) -> Result<std::string> {
    EXPECT_EQ(uri, "vision.scxml");
    return checked_document("<datamodel><data id=\"what\"/></datamodel><state id=\"look\"/><final id=\"done\"/>");
  };
  const auto loaded =
      load(checked_document(
               "<state id=\"a\"><invoke src=\"vision.scxml\"><param name=\"whta\" expr=\"1\"/></invoke></state>"),
           "charts/pick.scxml", options);
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(texts(check(*loaded.value)),
              ElementsAre(testing::AllOf(HasSubstr("charts/pick.scxml:2:"), HasSubstr("\"whta\" reaches nothing"),
                                         HasSubstr("did you mean \"what\"?")),
                          // Named as who invokes it is.
                          HasSubstr("charts/vision.scxml:2:12: warning: data \"what\" is never used"),
                          HasSubstr("charts/vision.scxml:2:")));
}

TEST(Check, LeavesWhatEditorsKeepAlone) {
  const auto told = [](const char* inside) {
    const auto loaded =
        load(checked_document(std::string("<state id=\"a\" xmlns:qt=\"http://www.qt.io/2015/02/scxml-ext\" "
                                          "xmlns:x=\"urn:x\"><onentry>") +
                              inside + "</onentry><transition event=\"e\" target=\"b\">" + inside +
                              "</transition></state><state id=\"b\"/><state id=\"island\"/>"),
             "door.scxml");
    EXPECT_TRUE(loaded.ok());
    auto all = texts(loaded.diagnostics);
    const auto found = texts(check(*loaded.value));
    all.insert(all.end(), found.begin(), found.end());
    return all;
  };
  // It hides nothing of the rest.
  EXPECT_THAT(told("<qt:editorinfo movePoint=\"1;2\"/>"), ElementsAre(HasSubstr("\"island\" is never entered")));
  EXPECT_THAT(told("<x:move/>"), Contains(HasSubstr("<x:move> is not SCXML and does nothing")));
}

TEST(Check, FindsFilesOfDataAndChartsThatCannotBeRead) {
  LoadOptions options;
  options.read = [](std::string_view uri) -> Result<std::string> {
    if (uri == "Child.scxml") return checked_document("<state id=\"a\"><transition target=\"nowhere\"/></state>");
    return fail("file.missing", "no such file");
  };
  const auto told = [&](const std::string& body) {
    const auto loaded = load(checked_document(body), "door.scxml", options);
    return loaded.ok() ? texts(check(*loaded.value)) : texts(loaded.diagnostics);
  };
  EXPECT_THAT(told("<datamodel><data id=\"d\" src=\"d.json\"/></datamodel><state id=\"a\"><onentry><log expr=\"d\"/>"
                   "</onentry></state>"),
              ElementsAre(HasSubstr("data \"d\" cannot be read: \"d.json\": no such file")));
  EXPECT_THAT(told("<state id=\"a\"><invoke src=\"Gone.scxml\"/></state>"),
              ElementsAre(HasSubstr("\"Gone.scxml\" cannot be invoked: no such file")));
  EXPECT_THAT(told("<state id=\"a\"><invoke src=\"file:Child.scxml\"/></state>"),
              ElementsAre(HasSubstr("the invoked chart cannot be loaded: Child.scxml:2:")));
}

TEST(Check, FindsInOfAStateThatIsNotThere) {
  EXPECT_THAT(check_messages(R"xml(<state id="open"><transition event="e" cond="In('opn')"/></state>)xml"),
              ElementsAre(HasSubstr("In('opn') is never true: there is no such state; did you mean \"open\"?")));
  // With blanks, in scripts, and only where it is asked.
  EXPECT_THAT(
      check_messages(R"xml(<state id="open"><transition event="e" cond="!In( 'opn' ) || In( 'open' )"/></state>)xml"),
      ElementsAre(HasSubstr("In('opn') is never true")));
  EXPECT_THAT(check_messages(R"xml(<state id="open"><onentry><script>// In('a')
    var b = "In('c')"; if (In("opn") || In("opn")) b = In('open');</script></onentry></state>)xml"),
              ElementsAre(HasSubstr("In('opn') is never true")));
}

TEST(Check, SaysInWhichLineOfAScriptAStateIsAskedForThatIsNotThere) {
  const auto loaded = load(checked_document("<state id=\"a\"><onentry><script>\n  var b = 1;\n  b = In('gone');\n"
                                            "</script></onentry></state>"),
                           "door.scxml");
  ASSERT_TRUE(loaded.ok());
  const auto found = check(*loaded.value);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().span.line, 4);
}

}  // namespace
}  // namespace sentree::scxml
