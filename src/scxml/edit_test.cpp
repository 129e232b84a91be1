#include "sentree/scxml/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace sentree::scxml {
namespace {

using testing::HasSubstr;

// As Qt Creator writes it: its attributes, comments, single quotes, odd spacing, a processing instruction.
const std::string kDocument = R"(<?xml version="1.0" encoding="UTF-8"?>
<!-- made by hand -->
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="door" qt:editorversion="4.6"
       xmlns:qt="http://www.qt.io/2015/02/scxml-ext"   initial='open' datamodel="ecmascript">
    <qt:editorinfo initialGeometry="150;50;-20;-20;40;40"/>
    <state   id="open"  qt:editorinfo="geometry:10;20"> <!-- the first -->
        <transition event="close" target = 'closed' cond="!In('closed') &amp;&amp; true">
            <qt:editorinfo movePoint="1;2"/>
        </transition>
    </state>
    <?keep me?>
    <state id="closed"><transition event="open done.state.open" target="open"/></state>
</scxml>
)";

Chart chart() {
  auto loaded = load(kDocument, "door.scxml");
  EXPECT_TRUE(loaded.ok());
  return *std::move(loaded.value);
}

std::string replaced(std::string text, const std::vector<std::pair<std::string, std::string>>& changes) {
  for (const auto& [what, with] : changes) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), with);
  }
  return text;
}

TEST(Edit, WithoutChangesGivesTheSameBytes) {
  EXPECT_EQ(*ChartEdit(chart()).apply(), kDocument);
  EXPECT_EQ(chart().source(), kDocument);
}

TEST(Edit, ChangesOnePlaceOnly) {
  const Chart door = chart();
  ChartEdit edit(door);
  edit.set_attribute(edit.of_state(*door.find("open")), "qt:editorinfo", "geometry:99;20");
  EXPECT_EQ(*edit.apply(), replaced(kDocument, {{"geometry:10;20", "geometry:99;20"}}));
}

TEST(Edit, FindsATransitionByItsIndex) {
  const Chart door = chart();
  ChartEdit edit(door);
  const TransitionIndex closing = door.states()[*door.find("open")].transitions.front();
  edit.set_attribute(edit.of_transition(closing), "event", "shut");
  edit.remove_attribute(edit.of_transition(closing), "cond");
  EXPECT_EQ(*edit.apply(), replaced(kDocument, {{"event=\"close\"", "event=\"shut\""},
                                                {" cond=\"!In('closed') &amp;&amp; true\"", ""}}));
}

TEST(Edit, RenamesAStateWhereverItIsNamed) {
  const Chart door = chart();
  ChartEdit edit(door);
  ASSERT_TRUE(edit.rename_state(*door.find("open"), "ajar"));
  EXPECT_EQ(*edit.apply(), replaced(kDocument, {{"initial='open'", "initial='ajar'"},
                                                {"id=\"open\"", "id=\"ajar\""},
                                                {"done.state.open", "done.state.ajar"},
                                                {"target=\"open\"", "target=\"ajar\""}}));
  ChartEdit other(door);
  ASSERT_TRUE(other.rename_state(*door.find("closed"), "shut"));
  EXPECT_EQ(*other.apply(), replaced(kDocument, {{"target = 'closed'", "target = 'shut'"},
                                                 {"In('closed')", "In('shut')"},
                                                 {"id=\"closed\"", "id=\"shut\""}}));
}

TEST(Edit, RenamesAStateThatAnEarlyDraftBeginsWith) {
  const std::string draft = R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="0.9" initialstate="b">
  <state id="a"/><state id="b"/>
</scxml>)";
  const auto loaded = load(draft);
  ChartEdit edit(*loaded.value);
  ASSERT_TRUE(edit.rename_state(*loaded.value->find("b"), "begin"));
  EXPECT_EQ(*edit.apply(),
            replaced(draft, {{"initialstate=\"b\"", "initialstate=\"begin\""}, {"id=\"b\"", "id=\"begin\""}}));
}

TEST(Edit, RenamesAStateInScriptsAndExpressionsAsTheyAreWritten) {
  const std::string written = R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <datamodel><data id="d">In('work')</data><data id="e" expr="{at: In(&quot;work&quot;)}"/></datamodel>
  <script>
    // In('work') is said here only
    var a = In("work") &amp;&amp; In( 'work' ); /* In('work') */ var b = "In('work')"; var c = b.In('work');
  </script>
  <state id="work">
    <onentry>
      <script><![CDATA[if (1 < 2 && In('work')) d = In( "work.sub" );]]></script>
      <send event="e" delayexpr="In('work') ? '1s' : '2s'" targetexpr="In(&#39;w&#111;rk&#39;) ? '' : '#_internal'"/>
      <assign location="d[In('work')]" expr="In('working')"/>
    </onentry>
    <transition event="done.state.work.*" cond="!In( 'work.sub' ) || In( 'work' )" target="rest"/>
    <state id="work.sub"/>
  </state>
  <state id="rest"/>
</scxml>
)xml";
  const auto renamed = [&](const char* from, const char* to) {
    auto loaded = load(written, "a.scxml");
    EXPECT_TRUE(loaded.ok());
    ChartEdit edit(*loaded.value);
    EXPECT_TRUE(edit.rename_state(*loaded.value->find(from), to));
    return edit.apply().value_or("");
  };
  EXPECT_EQ(renamed("work", "arbeit"), replaced(written, {{"<data id=\"d\">In('work')", "<data id=\"d\">In('arbeit')"},
                                                          {"In(&quot;work&quot;)", "In(&quot;arbeit&quot;)"},
                                                          {"a = In(\"work\")", "a = In(\"arbeit\")"},
                                                          {"In( 'work' );", "In( 'arbeit' );"},
                                                          {"id=\"work\"", "id=\"arbeit\""},
                                                          {"2 && In('work')", "2 && In('arbeit')"},
                                                          {"delayexpr=\"In('work')", "delayexpr=\"In('arbeit')"},
                                                          {"In(&#39;w&#111;rk&#39;)", "In(&#39;arbeit&#39;)"},
                                                          {"d[In('work')]", "d[In('arbeit')]"},
                                                          {"done.state.work.*", "done.state.arbeit.*"},
                                                          {"In( 'work' )\"", "In( 'arbeit' )\""}}));
  EXPECT_EQ(renamed("work.sub", "work.inner"), replaced(written, {{"In( \"work.sub\" )", "In( \"work.inner\" )"},
                                                                  {"!In( 'work.sub' )", "!In( 'work.inner' )"},
                                                                  {"id=\"work.sub\"", "id=\"work.inner\""}}));
}

TEST(Edit, RefusesANameThatIsTaken) {
  const Chart door = chart();
  ChartEdit edit(door);
  EXPECT_EQ(edit.rename_state(*door.find("open"), "closed").error().message, "there is a state \"closed\" already");
  EXPECT_EQ(edit.rename_state(*door.find("open"), "a b").error().code, "scxml.bad-attribute");
}

TEST(Edit, AddsAndRemovesElements) {
  const Chart door = chart();
  ChartEdit edit(door);
  edit.append_child(edit.of_state(*door.find("closed")), "<transition event=\"lock\" target=\"locked\"/>");
  edit.append_child(edit.of_state(0), "<state id=\"locked\"/>");
  const auto edited = edit.apply();
  ASSERT_TRUE(edited) << edited.error().message;
  const auto again = load(*edited, "door.scxml");
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(again.value->find("locked"));
  ChartEdit removing(*again.value);
  removing.remove(removing.of_state(*again.value->find("locked")));
  const auto dangling = removing.apply();
  ASSERT_FALSE(dangling);
  EXPECT_THAT(to_string(dangling.error()), HasSubstr("transition target \"locked\" is not a state"));
}

}  // namespace
}  // namespace sentree::scxml
