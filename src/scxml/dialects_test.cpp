// Charts that others wrote, for other engines: what is read all the same, what is told, and what running refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/scxml/check.h"
#include "sentree/scxml/diff.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string dialect_document(std::string_view body, std::string_view attributes = "datamodel=\"ecmascript\"") {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" " + std::string(attributes) + ">\n" +
         std::string(body) + "</scxml>";
}

std::vector<std::string> dialect_texts(const Diagnostics& diagnostics) {
  std::vector<std::string> result;
  for (const Diagnostic& diagnostic : diagnostics) result.push_back(to_string(diagnostic));
  return result;
}

Loaded<Chart> look_at(const std::string& source) { return load(source, "c.scxml", {.to_run = false}); }

struct DialectPlayer {
  explicit DialectPlayer(const std::string& source) : loaded(load(source, "c.scxml")) {
    EXPECT_TRUE(loaded.ok()) << testing::PrintToString(dialect_texts(loaded.diagnostics));
    start(*loaded.value, session, {}, now, effects);
  }
  void send(const char* event) { step(*loaded.value, session, {.name = event}, now, effects); }
  [[nodiscard]] std::vector<std::string> active() const { return session.active_ids(*loaded.value); }
  [[nodiscard]] Map data() const { return session.data(*loaded.value); }

  Loaded<Chart> loaded;
  Session session;
  Effects effects;
  TimePoint now{};
};

// ---- What other engines take, and this one too ----

TEST(Dialects, AnEmptyAttributeIsAnAbsentOne) {
  DialectPlayer p(dialect_document(R"(<datamodel><data id="place" expr=""/></datamodel>
    <state id="a"><transition event="go" cond="" target="b"/></state><state id="b" initial=""/>)"));
  EXPECT_THAT(
      dialect_texts(p.loaded.diagnostics),
      ElementsAre(HasSubstr(R"(warning: the empty "expr" of <data> is taken as if it were not there)"),
                  HasSubstr(R"(the empty "cond" of <transition>)"), HasSubstr(R"(the empty "initial" of <state>)")));
  EXPECT_TRUE(p.session.data(*p.loaded.value).empty());
  p.send("go");
  EXPECT_THAT(p.active(), ElementsAre("b"));
}

TEST(Dialects, CancellingNothingIsAllowed) {
  DialectPlayer p(dialect_document("<state id=\"a\"><onentry><cancel sendid=\"\"/></onentry></state>"));
  EXPECT_THAT(dialect_texts(p.loaded.diagnostics), ElementsAre(HasSubstr("warning: the empty \"sendid\" of <cancel>")));
  EXPECT_THAT(p.active(), ElementsAre("a"));
  EXPECT_FALSE(load(dialect_document("<state id=\"a\"><onentry><cancel/></onentry></state>"), "c.scxml").ok());
}

TEST(Dialects, TextBetweenElementsAndEventsWithoutANameAreTold) {
  const auto loaded =
      load(dialect_document(
               "<state id=\"a\">)transition/> <onentry> b<log/></onentry><transition event=\".x y..z\"/></state>"),
           "c.scxml");
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(dialect_texts(loaded.diagnostics),
              ElementsAre(HasSubstr("warning: text inside <state> means nothing: \")transition/>\""),
                          HasSubstr("text inside <onentry> means nothing: \"b\""),
                          HasSubstr("no event is called \".x\""), HasSubstr("no event is called \"y..z\"")));
}

TEST(Dialects, ExpressionsWithoutADataModelAreEcmascript) {
  DialectPlayer p(dialect_document(R"(<datamodel><data id="n" expr="1 + 1"/></datamodel>
    <state id="a"><transition cond="n == 2" target="b"/></state><state id="b"/>)",
                                   ""));
  EXPECT_THAT(dialect_texts(p.loaded.diagnostics),
              ElementsAre(HasSubstr("no data model is named, but there are expressions, the "
                                    "first in line 2; they are taken as ecmascript")));
  EXPECT_THAT(p.active(), ElementsAre("b"));
}

TEST(Dialects, AChartWithInAloneKeepsTheNullDataModel) {
  const auto loaded =
      load(dialect_document(R"x(<state id="a"><transition cond="In('a')" target="b"/></state><state id="b"/>)x", ""));
  EXPECT_THAT(loaded.diagnostics, IsEmpty());
  EXPECT_EQ(loaded.value->data_model(), DataModelKind::kNull);
}

TEST(Dialects, OtherRootsNamespacesAndVersionsAreRead) {
  for (const char* root : {R"(<ascxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">)",
                           R"(<scxml version="1.0">)", R"(<scxml xmlns="http://www.w3.org/2005/07/SCXML">)",
                           R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="0.9">)"}) {
    const std::string name = std::string(root).substr(1, std::string(root).find(' ') - 1);
    const auto loaded = load(std::string(root) + "<state id='a'/></" + name + ">");
    EXPECT_TRUE(loaded.ok()) << root;
    EXPECT_EQ(loaded.diagnostics.size(), 1U) << root;
  }
  EXPECT_FALSE(load("<html><state id='a'/></html>").ok());
}

TEST(Dialects, ADelayWithoutUnitIsInMilliseconds) {
  DialectPlayer p(dialect_document(R"(<state id="a"><onentry><send event="e" delay="1500"/></onentry>
    <transition event="e" target="b"/></state><state id="b"/>)"));
  EXPECT_THAT(dialect_texts(p.loaded.diagnostics),
              ElementsAre(HasSubstr(R"(delay "1500" has no unit and is taken as )"
                                    R"(milliseconds; write "1500ms", or "s" for seconds)")));
  EXPECT_EQ(p.session.next_timer(), TimePoint(std::chrono::milliseconds(1500)));
}

TEST(Dialects, AHistoryWithoutDefaultLeadsToWhereItsParentBegins) {
  DialectPlayer p(dialect_document(R"(<state id="out"><transition event="in" target="h"/></state>
    <state id="p" initial="b"><history id="h"/><state id="a"/><state id="b"><transition event="n" target="a"/></state>
      <transition event="out" target="out"/></state>)"));
  EXPECT_THAT(dialect_texts(p.loaded.diagnostics),
              ElementsAre(HasSubstr("<history> \"h\" has no <transition> to its default")));
  p.send("in");
  EXPECT_THAT(p.active(), ElementsAre("p", "b"));
  for (const char* event : {"n", "out", "in"}) p.send(event);
  EXPECT_THAT(p.active(), ElementsAre("p", "a"));
}

TEST(Dialects, AHistoryOfAParallelWithoutDefaultEntersAllRegions) {
  DialectPlayer p(dialect_document(R"(<state id="out"><transition event="in" target="h"/></state>
    <parallel id="p"><history id="h"/><state id="a"/><state id="b"/></parallel>)"));
  p.send("in");
  EXPECT_THAT(p.active(), ElementsAre("p", "a", "b"));
}

TEST(Dialects, AHistoryThatIsTheInitialStateNeedsNoDefaultToEnd) {
  DialectPlayer p(
      dialect_document(R"(<state id="p" initial="h"><history id="h" type="deep"/><state id="a"/></state>)"));
  EXPECT_THAT(p.active(), ElementsAre("p", "a"));
}

// ---- What is looked at only ----

TEST(Dialects, AForeignDataModelIsReadButNotRun) {
  const std::string lua = dialect_document(R"(<datamodel><data id="t" expr="{1, 2}"/></datamodel>
    <state id="a"><transition event="go" cond="t[1] ~= nil" target="b"/></state><state id="b"/>)",
                                           "datamodel=\"lua\"");
  const auto to_run = load(lua, "c.scxml");
  EXPECT_FALSE(to_run.ok());
  EXPECT_THAT(dialect_texts(to_run.diagnostics), ElementsAre(HasSubstr(R"(data model "lua" cannot be run)")));

  const auto seen = look_at(lua);
  ASSERT_TRUE(seen.ok());
  EXPECT_FALSE(has_errors(seen.diagnostics));
  EXPECT_EQ(seen.value->data_model(), DataModelKind::kForeign);
  EXPECT_EQ(seen.value->transitions().front().condition, "t[1] ~= nil");
  EXPECT_FALSE(has_errors(check(*seen.value)));
  ASSERT_TRUE(seen.value->obstacle());

  Session session;
  Effects effects;
  start(*seen.value, session, {}, {}, effects);
  EXPECT_EQ(session.status(), SessionStatus::kFailed);
  EXPECT_THAT(to_string(*session.failure()), HasSubstr(R"(data model "lua" cannot be run)"));
}

TEST(Dialects, AMisspeltDataModelIsAMistakeForEverybody) {
  const auto seen = look_at(dialect_document("<state id='a'/>", "datamodel=\"ecmascipt\""));
  EXPECT_THAT(dialect_texts(seen.diagnostics), Contains(HasSubstr(R"(did you mean "ecmascript"?)")));
}

TEST(Dialects, WhatIsWrongInAnyDataModelStaysRefused) {
  EXPECT_FALSE(
      look_at(dialect_document("<state id='a'><transition event='e' target='nowhere'/></state>", "datamodel='jexl'"))
          .ok());
  EXPECT_FALSE(look_at(dialect_document("<state id='a'/><state id='a'/>", "datamodel='jexl'")).ok());
  EXPECT_FALSE(look_at(dialect_document("<state id='a'><onentyr/></state>", "datamodel='jexl'")).ok());
  EXPECT_FALSE(look_at(dialect_document("<state id='a'><transition cond='a < b'/></state>", "datamodel='jexl'")).ok());
}

TEST(Dialects, ElementsOfADialectThatLeadToAStateAreTransitions) {
  const std::string skill = dialect_document(R"(<ros_service_server service_name="/tick"/>
    <state id="a"><ros_service_handle_request name="/tick" target="b"><field name="x"/></ros_service_handle_request></state>
    <state id="b"><onentry><bt_return_status status="SUCCESS"/></onentry></state>)");
  EXPECT_FALSE(load(skill).ok());
  const auto seen = look_at(skill);
  ASSERT_TRUE(seen.ok()) << testing::PrintToString(dialect_texts(seen.diagnostics));
  ASSERT_EQ(seen.value->states()[1].transitions.size(), 1U);
  const Transition& transition = seen.value->transitions()[seen.value->states()[1].transitions.front()];
  EXPECT_THAT(transition.events, ElementsAre("ros_service_handle_request:/tick"));
  EXPECT_EQ(transition.targets, std::vector<StateIndex>{2});
  EXPECT_FALSE(has_errors(check(*seen.value)));
}

TEST(Dialects, AlternativeTargetsAreATransitionEach) {
  const auto seen = look_at(dialect_document(R"(<state id="a"><transition event="e" cond="c"><target id="a" prob="0.3"/>
    <target id="b"/></transition></state><state id="b"/>)"));
  ASSERT_TRUE(seen.ok()) << testing::PrintToString(dialect_texts(seen.diagnostics));
  ASSERT_EQ(seen.value->states()[1].transitions.size(), 2U);
  EXPECT_EQ(seen.value->transitions()[seen.value->states()[1].transitions.front()].condition, "c [0.3]");
}

TEST(Dialects, WordsOfEarlyDraftsAreUnderstood) {
  const auto seen = look_at(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="0.9" initialstate="b">
    <state id="a"/><state id="b"><transition event="e" next="a"/></state></scxml>)");
  ASSERT_TRUE(seen.ok()) << testing::PrintToString(dialect_texts(seen.diagnostics));
  EXPECT_EQ(seen.value->transitions()[seen.value->states()[2].transitions.front()].targets, std::vector<StateIndex>{1});
}

TEST(Dialects, StatesOfOtherFilesMayBeMissing) {
  const std::string included = dialect_document(R"(<xi:include href="more.scxml"/>
    <state id="a"><transition event="e" target="elsewhere"/></state>)",
                                                R"(xmlns:xi="http://www.w3.org/2001/XInclude")");
  EXPECT_FALSE(load(included).ok());
  EXPECT_TRUE(look_at(included).ok());
}

TEST(Dialects, ContentInsideElseIsNotLostInSilence) {
  const std::string chart =
      dialect_document(R"(<state id="a"><onentry><if cond="1"><log/><else><log/></else></if></onentry></state>)");
  EXPECT_THAT(dialect_texts(load(chart).diagnostics),
              ElementsAre(HasSubstr("the content of <else> follows it: write <else/>")));
  EXPECT_TRUE(look_at(chart).ok());
}

TEST(Dialects, PrefixesThatNobodyDeclaresAreTold) {
  const std::string chart = dialect_document(R"(<state id="a"><qt:editorinfo geometry="1"/></state>)");
  EXPECT_FALSE(load(chart).ok());
  const auto seen = look_at(chart);
  EXPECT_TRUE(seen.ok());
  EXPECT_THAT(dialect_texts(seen.diagnostics), ElementsAre(HasSubstr("prefix \"qt\" is not declared")));
}

// ---- Comparison ----

std::vector<std::string> differences(const std::string& before, const std::string& after) {
  std::vector<std::string> found;
  const auto result = diff(dialect_document(before), dialect_document(after));
  EXPECT_TRUE(result);
  constexpr const char* kSigns[] = {"+ ", "- ", "~ ", "> "};
  for (const auto& d : *result) found.push_back(kSigns[static_cast<int>(d.kind)] + d.path + ": " + d.what);
  return found;
}

TEST(Diff, TellsStatesTransitionsContentAndData) {
  EXPECT_THAT(differences(R"(<datamodel><data id="n" expr="1"/></datamodel>
        <state id="a"><onentry><log label="x"/></onentry><transition event="go" target="b"/></state><state id="b"/>)",
                          R"(<datamodel><data id="n" expr="2"/><data id="m"/></datamodel>
        <state id="a"><onentry><log label="x"/><raise event="r"/></onentry>
          <transition event="go" cond="n" target="c"/></state><final id="c"/>)"),
              testing::UnorderedElementsAre(
                  "~ chart/datamodel/data n: expr: \"1\" → \"2\"", "+ chart/datamodel/data m: data added",
                  "+ chart/a/onentry/raise r: raise added", "~ chart/a/transition go: target: \"b\" → \"c\"",
                  "~ chart/a/transition go: cond: \"n\" added", "- chart/b: state removed", "+ chart/c: final added"));
}

TEST(Diff, APrefixIsAnyWordForItsNamespace) {
  const auto chart = [](const std::string& scxml, const std::string& other) {
    return "<" + scxml + "scxml xmlns" + (scxml.empty() ? "" : ":s") +
           "=\"http://www.w3.org/2005/07/scxml\" xmlns:" + other + "=\"urn:other\" version=\"1.0\"><" + scxml +
           "state id=\"a\" " + other + ":at=\"1\"><" + other + ":note/></" + scxml + "state></" + scxml + "scxml>";
  };
  EXPECT_THAT(*diff(chart("", "x"), chart("s:", "y")), testing::IsEmpty());
  std::string elsewhere = chart("s:", "x");
  elsewhere.replace(elsewhere.find("urn:other"), 9, "urn:third");
  EXPECT_THAT(*diff(chart("", "x"), elsewhere), testing::SizeIs(4));  // the note and the attribute, gone and come
}

TEST(Diff, AStateIsTheSameWhereverItStandsAndWhateverKindItIs) {
  EXPECT_THAT(differences(R"(<state id="a"><state id="c"/></state><state id="b"/>)",
                          R"(<state id="a"/><parallel id="b"><state id="c"/></parallel>)"),
              testing::UnorderedElementsAre("> chart/b/c: moved here from chart/a/c", "~ chart/b: state → parallel"));
}

TEST(Diff, OrderOfTransitionsCountsAndLayoutDoesNot) {
  EXPECT_THAT(differences(R"(<state id="a"><transition event="x"/><transition event="y"/></state>)",
                          R"(<state id="a"><transition event="y"/><transition event="x"/></state>)"),
              ElementsAre(HasSubstr("moved among its siblings")));
  EXPECT_THAT(differences(R"(<state id="a" initial=""><!-- old --></state>)",
                          R"(<state   id="a"><qt:editorinfo geometry="1;2"/></state>)"),
              IsEmpty());
}

TEST(Diff, ShowsTheLineOfAScriptThatChanged) {
  EXPECT_THAT(differences("<script>var a = 1;\nvar b = 2;\n</script><state/>",
                          "<script>\nvar a = 1;\n  var b = 3;</script><state/>"),
              ElementsAre("~ chart/script: text: \"var b = 2;\" → \"var b = 3;\""));
}

TEST(Diff, ManyUnlikeElementsTakeNoLongTime) {
  std::string before;
  std::string after;
  for (int i = 0; i < 20'000; ++i) {
    before += "<state id='a" + std::to_string(i) + "'/>";
    after += "<state id='b" + std::to_string(i) + "'/>";
  }
  EXPECT_EQ(differences(before, after).size(), 40'000U);
}

TEST(Diff, RefusesWhatIsNoChart) {
  EXPECT_EQ(diff("<root/>", "<scxml/>").error().code, "scxml.no-scxml");
  EXPECT_EQ(diff("<scxml>", "<scxml/>").error().code, "xml.syntax");
}

}  // namespace
}  // namespace sentree::scxml
