#include "sentree/design/chart_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/scxml/model.h"

namespace sentree::design {
namespace {

using testing::HasSubstr;

const std::string kChart = R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="moving">
  <!-- on the way -->
  <state id="moving" qt:editorinfo="geometry:1;2" xmlns:qt="http://www.qt.io">
    <transition event="stop" target="idle"/> <!-- stops -->
  </state>
  <state id="idle">
    <transition event='go' target='moving'/>
  </state>
  <final id="end"/>
</scxml>
)";

std::string edited(const std::string& xml, const ChartGesture& gesture) {
  const auto result = edit_chart(xml, gesture);
  if (!result) return result.error().message;
  EXPECT_EQ(with_edits(with_edits(xml, result->edits).value(), inverse(xml, result->edits)).value(), xml);
  return with_edits(xml, result->edits).value();
}

std::string replaced(std::string xml, const std::string& old_text, const std::string& new_text) {
  return xml.replace(xml.find(old_text), old_text.size(), new_text);
}

const std::string kNested =
    R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="trip">
  <state id="trip" initial="on">
    <onentry>
      <log expr="'begin'"/> <!-- says so -->
      <raise event="go"/>
    </onentry>
    <transition event="halt" target="end"/>
    <state id="on">
      <transition event="toggle" target="off"/>
      <transition event="more"><raise event="again"/></transition>
    </state>
    <state id="off">
      <transition event="toggle" target="on"/>
    </state>
  </state>
  <state id="idle"/>
  <final id="end"/>
</scxml>
)";

// The transition of that event.
scxml::TransitionIndex transition_of(const std::string& xml, const std::string& event) {
  const auto chart = scxml::load(xml);
  for (scxml::TransitionIndex t = 0; t < chart.value->transitions().size(); ++t) {
    const auto& events = chart.value->transitions()[t].events;
    if (!events.empty() && events.front() == event) return t;
  }
  return scxml::kNoTransition;
}

TEST(ChartEdit, TheSecondInALineGetsALineOfItsOwnAndTheFirstToo) {
  const std::string line = "  <state id=\"idle\"><transition event=\"go\" target=\"idle\"/></state>\n";
  const std::string chart = R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
)" + line + "</scxml>\n";
  EXPECT_EQ(edited(chart, AddTransition{"idle", "", "stop", ""}), replaced(chart, line, R"(  <state id="idle">
    <transition event="go" target="idle"/>
    <transition event="stop"/>
  </state>
)"));
  EXPECT_EQ(edited(chart, InsertAction{{std::nullopt, "idle", "onentry"}, 0, "<raise event=\"a\"/>"}),
            replaced(chart, line, R"(  <state id="idle">
    <onentry>
      <raise event="a"/>
    </onentry>
    <transition event="go" target="idle"/>
  </state>
)"));
  // Where others stand in one line already, it joins them.
  const std::string two = replaced(chart, "</state>", "<transition event=\"more\"/></state>");
  EXPECT_EQ(edited(two, AddTransition{"idle", "", "stop", ""}),
            replaced(two, "</state>", "<transition event=\"stop\"/></state>"));
}

TEST(ChartEdit, WhatIsTakenOutLeavesNeitherEmptyLinesNorEmptyElements) {
  const std::string chart = R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <state id="a">
    <transition event="go" target="b"/>
  </state>

  <state id="b"/>

  <state id="c"/>
</scxml>
)";
  EXPECT_EQ(edited(chart, RemoveState{"b"}),
            R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <state id="a"/>

  <state id="c"/>
</scxml>
)");
  EXPECT_EQ(edited(chart, RemoveState{"c"}), replaced(chart, "\n\n  <state id=\"c\"/>", ""));
}

TEST(ChartEdit, DeletesAStateWithWhatLeadsToIt) {
  // The transitions from elsewhere, and that the chart begins with it.
  EXPECT_EQ(edited(kChart, RemoveState{"moving"}),
            "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\">\n"
            "  <!-- on the way -->\n"
            "  <state id=\"idle\"/>\n"
            "  <final id=\"end\"/>\n"
            "</scxml>\n");
  EXPECT_EQ(edit_chart(kChart, RemoveState{"moving"})->name, "delete state moving with 1 transition to it");
}

TEST(ChartEdit, MovesStatesIntoEachOtherAndOut) {
  const std::string in = edited(kNested, MoveState{"idle", "trip"});
  EXPECT_THAT(in, HasSubstr("    </state>\n    <state id=\"idle\"/>\n  </state>\n  <final"));
  const std::string out = edited(kNested, MoveState{"on", ""});
  EXPECT_THAT(out, HasSubstr("<state id=\"trip\">\n")) << "it does not begin with what is not in it";
  EXPECT_THAT(out, HasSubstr("  <final id=\"end\"/>\n"
                             "  <state id=\"on\">\n"
                             "    <transition event=\"toggle\" target=\"off\"/>\n"
                             "    <transition event=\"more\"><raise event=\"again\"/></transition>\n"
                             "  </state>\n"
                             "</scxml>"));
}

TEST(ChartEdit, PutsAStateIntoANewOne) {
  EXPECT_THAT(edited(kNested, WrapState{"idle", "around"}),
              HasSubstr("  <state id=\"around\">\n    <state id=\"idle\"/>\n  </state>\n"));
  EXPECT_THAT(edited(kNested, WrapState{"off", "both", "parallel"}),
              HasSubstr("    <parallel id=\"both\">\n"
                        "      <state id=\"off\">\n"
                        "        <transition event=\"toggle\" target=\"on\"/>\n"
                        "      </state>\n"
                        "    </parallel>\n"));
}

const std::string kRow =
    R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="b">
  <state id="a">
    <transition event="go" target="b"/> <!-- on -->
    <transition event="far" target="c"/>
  </state>
  <!-- the second -->
  <state id="b" xmlns:qt="http://www.qt.io" qt:editorinfo="geometry:1;2">
    <transition event="go" cond="In('a')" target="c"/>
  </state>
  <state id="c"/>
  <parallel id="p">
    <state id="q"/>
    <state id="r">
      <transition event="done.state.q" target="c"/>
    </state>
  </parallel>
</scxml>
)xml";

ChartGesture all_of(std::vector<std::string> states, decltype(EditStates::gesture) gesture) {
  return EditStates{std::move(states), std::move(gesture)};
}

TEST(ChartEdit, DeletesSeveralStatesAsOne) {
  EXPECT_EQ(edited(kRow, all_of({"c", "b"}, RemoveState{})),
            R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <state id="a">
     <!-- on -->
  </state>
  <!-- the second -->
  <parallel id="p">
    <state id="q"/>
    <state id="r"/>
  </parallel>
</scxml>
)");
  EXPECT_EQ(edit_chart(kRow, all_of({"c", "b"}, RemoveState{}))->name, "delete 2 states with 3 transitions to them");
  // What is inside of another one goes along with it; alone they are as one.
  EXPECT_EQ(edited(kRow, all_of({"r", "p", "q"}, RemoveState{})), edited(kRow, RemoveState{"p"}));
  EXPECT_EQ(edit_chart(kRow, all_of({"q", "p"}, RemoveState{}))->name, "delete state p");
  EXPECT_THAT(edited(kRow, all_of({"q", "r"}, RemoveState{})), HasSubstr("  <parallel id=\"p\"/>\n</scxml>"));
}

TEST(ChartEdit, MovesSeveralStatesAsOneInTheirOrder) {
  const std::string moved = edited(kRow, all_of({"c", "q", "a"}, MoveState{"", "p"}));
  EXPECT_THAT(moved, HasSubstr("datamodel=\"ecmascript\" initial=\"b\">\n  <!-- the second -->\n  <state id=\"b\""));
  EXPECT_THAT(moved, HasSubstr("    </state>\n"
                               "    <state id=\"a\">\n"
                               "      <transition event=\"go\" target=\"b\"/> <!-- on -->\n"
                               "      <transition event=\"far\" target=\"c\"/>\n"
                               "    </state>\n"
                               "    <state id=\"c\"/>\n"
                               "  </parallel>\n"));
  EXPECT_EQ(edit_chart(kRow, all_of({"c", "q", "a"}, MoveState{"", "p"}))->name, "move 2 states into p");
  EXPECT_THAT(edited(kRow, all_of({"q", "r"}, MoveState{"", "p"})), HasSubstr("2 states are there already"));
  EXPECT_THAT(edited(kRow, all_of({"a", "p"}, MoveState{"", "q"})), HasSubstr("cannot go into themselves"));
  EXPECT_THAT(edited(kRow, all_of({"a", "nowhere"}, MoveState{"", "p"})), HasSubstr("no state \"nowhere\""));
  EXPECT_THAT(edited(kRow, all_of({}, MoveState{"", "p"})), HasSubstr("no state is chosen"));
  // A history goes with what it remembers.
  const std::string with_history = edited(kNested, AddState{"trip", "back", "history"});
  EXPECT_THAT(edited(with_history, all_of({"back", "on", "off"}, MoveState{"", "idle"})),
              HasSubstr("    <history id=\"back\"><transition target=\"on\"/></history>\n  </state>\n  <final"));
}

TEST(ChartEdit, PutsSeveralStatesIntoANewOne) {
  // Neighbours stay where they are, with what stands between them.
  EXPECT_EQ(edited(kRow, all_of({"b", "a"}, WrapState{"", "around"})),
            R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="b">
  <state id="around">
    <state id="a">
      <transition event="go" target="b"/> <!-- on -->
      <transition event="far" target="c"/>
    </state>
    <!-- the second -->
    <state id="b" xmlns:qt="http://www.qt.io" qt:editorinfo="geometry:1;2">
      <transition event="go" cond="In('a')" target="c"/>
    </state>
  </state>
)xml" + kRow.substr(kRow.find("  <state id=\"c\"/>")));
  EXPECT_EQ(edit_chart(kRow, all_of({"b", "a"}, WrapState{"", "around"}))->name,
            "put 2 states into the new state around");
  // Others come to the first of them.
  EXPECT_THAT(edited(kRow, all_of({"c", "a"}, WrapState{"", "both", "parallel"})),
              HasSubstr("  <parallel id=\"both\">\n"
                        "    <state id=\"a\">\n"
                        "      <transition event=\"go\" target=\"b\"/> <!-- on -->\n"
                        "      <transition event=\"far\" target=\"c\"/>\n"
                        "    </state>\n"
                        "    <state id=\"c\"/>\n"
                        "  </parallel>\n"
                        "  <!-- the second -->\n"));
  EXPECT_THAT(edited(kRow, all_of({"a", "q"}, WrapState{"", "around"})), HasSubstr("are in different states"));
  EXPECT_THAT(edited(kRow, all_of({"a", "b"}, WrapState{"", "c"})), HasSubstr("already"));
}

TEST(ChartEdit, PastesStatesUnderFreeIdsThatNameEachOther) {
  const std::string both = R"xml(<state id="a">
    <transition event="go" target="b"/>
    <transition event="far" target="c"/>
  </state>
  <state id="b" xmlns:qt="http://www.qt.io" qt:editorinfo="geometry:1;2">
    <transition event="go" cond="In('a')" target="elsewhere"/>
    <transition event="done.state.a" cond="In('a')" target="c elsewhere"/>
  </state>)xml";
  const auto result = edit_chart(kRow, PasteStates{"", both});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->states, testing::ElementsAre("a_2", "b_2"));
  EXPECT_EQ(result->name, "paste 2 states without 1 transition to what is not here");
  const std::string once = edited(kRow, PasteStates{"", both});
  EXPECT_EQ(once, replaced(kRow, "  </parallel>\n", R"xml(  </parallel>
  <state id="a_2">
    <transition event="go" target="b_2"/>
    <transition event="far" target="c"/>
  </state>
  <state id="b_2" xmlns:qt="http://www.qt.io">
    <transition event="done.state.a_2" cond="In('a_2')" target="c"/>
  </state>
)xml"));
  // A copy of a copy counts on.
  EXPECT_THAT(edited(once, PasteStates{"q", "<state id=\"a_2\"/>"}),
              HasSubstr("    <state id=\"q\">\n      <state id=\"a_3\"/>\n    </state>"));
  // A chart stands for its states.
  const std::string whole = edited(kChart, PasteStates{"idle", kNested});
  EXPECT_THAT(whole, HasSubstr("    <state id=\"trip\" initial=\"on\">\n      <onentry>\n"));
  EXPECT_THAT(whole, HasSubstr("      <transition event=\"halt\" target=\"end_2\"/>\n"));
  EXPECT_THAT(whole, HasSubstr("    <state id=\"idle_2\"/>\n    <final id=\"end_2\"/>\n  </state>\n"));
  EXPECT_THAT(edited(kRow, PasteStates{"", "hello"}), HasSubstr("no XML of states"));
  EXPECT_THAT(edited(kRow, PasteStates{"", "<log/>"}), HasSubstr("<log> is no state of a chart"));
  EXPECT_THAT(edited(kRow, PasteStates{"", "<scxml/>"}), HasSubstr("no state in what was copied"));
  EXPECT_THAT(edited(kChart, PasteStates{"end", both}), HasSubstr("is final"));
}

TEST(ChartEdit, MakesStatesOfAnotherKind) {
  EXPECT_EQ(edited(kNested, SetKind{"idle", "final"}), replaced(kNested, "<state id=\"idle\"", "<final id=\"idle\""));
  std::string parallel = replaced(kNested, "<state id=\"trip\" initial=\"on\">", "<parallel id=\"trip\">");
  parallel = replaced(parallel, "  </state>\n  <state id=\"idle\"/>", "  </parallel>\n  <state id=\"idle\"/>");
  EXPECT_EQ(edited(kNested, SetKind{"trip", "parallel"}), parallel);
  EXPECT_THAT(edited(kNested, AddState{"trip", "back", "deep-history"}),
              HasSubstr("    <history id=\"back\" type=\"deep\"><transition target=\"on\"/></history>\n  </state>"));
  const std::string with_history = edited(kNested, AddState{"trip", "back", "history"});
  EXPECT_THAT(edited(with_history, SetKind{"back", "deep-history"}), HasSubstr("<history id=\"back\" type=\"deep\">"));
  EXPECT_THAT(edited(with_history, SetKind{"back", "final"}), HasSubstr("a history is added, or deleted"));
}

TEST(ChartEdit, BeginsElsewhere) {
  EXPECT_EQ(edited(kNested, SetInitial{"idle"}), replaced(kNested, "initial=\"trip\"", "initial=\"idle\""));
  EXPECT_EQ(edited(kNested, SetInitial{"off"}), replaced(kNested, "initial=\"on\"", "initial=\"off\""));
  const std::string element = replaced(replaced(kNested, " initial=\"on\"", ""), "    <onentry>",
                                       "    <initial><transition target=\"on\"/></initial>\n    <onentry>");
  EXPECT_EQ(edited(element, SetInitial{"off"}),
            replaced(element, "<initial><transition target=\"on\"/>", "<initial><transition target=\"off\"/>"));
}

TEST(ChartEdit, EditsMovesAndDeletesTransitions) {
  const auto halt = transition_of(kNested, "halt");
  EXPECT_EQ(edited(kNested, SetTransition{halt, "stop", "a > 1", "idle"}),
            replaced(kNested, "<transition event=\"halt\" target=\"end\"/>",
                     "<transition event=\"stop\" target=\"idle\" cond=\"a &gt; 1\"/>"));
  EXPECT_EQ(edited(kNested, SetTransition{halt, {}, {}, ""}), replaced(kNested, "halt\" target=\"end\"", "halt\""));
  EXPECT_EQ(edited(kNested, RemoveTransition{halt}),
            replaced(kNested, "    <transition event=\"halt\" target=\"end\"/>\n", ""));
  const auto more = transition_of(kNested, "more");
  EXPECT_THAT(edited(kNested, MoveTransition{more, "on", 0}),
              HasSubstr("<state id=\"on\">\n"
                        "      <transition event=\"more\"><raise event=\"again\"/></transition>\n"
                        "      <transition event=\"toggle\" target=\"off\"/>\n    </state>"));
  EXPECT_THAT(edited(kNested, MoveTransition{more, "idle", 0}),
              HasSubstr("  <state id=\"idle\">\n"
                        "    <transition event=\"more\"><raise event=\"again\"/></transition>\n  </state>"));
}

TEST(ChartEdit, EditsWhatIsDone) {
  const ActionPlace entry{std::nullopt, "trip", "onentry"};
  EXPECT_EQ(edited(kNested, InsertAction{entry, 1, "<log expr=\"2\"/>"}),
            replaced(kNested, "<!-- says so -->", "<!-- says so -->\n      <log expr=\"2\"/>"));
  EXPECT_EQ(edited(kNested, SetAction{entry, 1, "<if cond=\"a\">\n  <raise event=\"b\"/>\n</if>"}),
            replaced(kNested, "<raise event=\"go\"/>", "<if cond=\"a\">\n        <raise event=\"b\"/>\n      </if>"));
  EXPECT_EQ(edited(kNested, RemoveAction{entry, 1}), replaced(kNested, "\n      <raise event=\"go\"/>", ""));
  EXPECT_EQ(edited(kNested, MoveAction{entry, 1, 0}), replaced(replaced(kNested, "\n      <raise event=\"go\"/>", ""),
                                                               "<onentry>", "<onentry>\n      <raise event=\"go\"/>"));
  // The first and the last of a block bring it and take it away.
  const ActionPlace leaving{std::nullopt, "idle", "onexit"};
  const std::string log = "<log expr=\"'bye'\"/>";
  const std::string with = edited(kNested, InsertAction{leaving, 0, log});
  EXPECT_THAT(with, HasSubstr("  <state id=\"idle\">\n    <onexit>\n      " + log + "\n    </onexit>\n  </state>"));
  EXPECT_THAT(edited(with, RemoveAction{leaving, 0}), testing::Not(HasSubstr("onexit")));
  EXPECT_THAT(edited(kNested, InsertAction{{transition_of(kNested, "more"), "", ""}, 1, log}),
              HasSubstr("<raise event=\"again\"/>\n        " + log + "\n      </transition>"));
  EXPECT_THAT(edited(kNested, InsertAction{{std::nullopt, "", "datamodel"}, 0, "<data id=\"count\" expr=\"0\"/>"}),
              HasSubstr("initial=\"trip\">\n  <datamodel>\n    <data id=\"count\" expr=\"0\"/>\n  </datamodel>\n"));
}

TEST(ChartEdit, TellsWhatCanBeEdited) {
  const auto chart = scxml::load(kNested);
  const ChartParts parts = parts_of(*chart.value);
  const auto& trip = parts.states[*chart.value->find("trip")];
  EXPECT_EQ(trip.kind, "state");
  EXPECT_TRUE(trip.initial);
  EXPECT_EQ(kNested.substr(trip.from, 16), "<state id=\"trip\"");
  EXPECT_EQ(kNested.substr(trip.to), "\n  <state id=\"idle\"/>\n  <final id=\"end\"/>\n</scxml>\n");
  EXPECT_THAT(trip.onentry, testing::ElementsAre("<log expr=\"'begin'\"/>", "<raise event=\"go\"/>"));
  EXPECT_FALSE(parts.states[*chart.value->find("off")].initial);
  EXPECT_EQ(parts.states[*chart.value->find("end")].kind, "final");
  const auto& more = parts.transitions[transition_of(kNested, "more")];
  EXPECT_TRUE(more.written);
  EXPECT_EQ(more.event, "more");
  EXPECT_EQ(more.target, "");
  EXPECT_THAT(more.actions, testing::ElementsAre("<raise event=\"again\"/>"));
  // An action of several lines is told without the indentation that it stands in, and written back as it was.
  const ActionPlace entry{std::nullopt, "trip", "onentry"};
  const std::string branch = "<if cond=\"a\">\n  <raise event=\"b\"/>\n</if>";
  const std::string with = edited(kNested, SetAction{entry, 0, branch});
  const auto again = scxml::load(with);
  EXPECT_EQ(parts_of(*again.value).states[*again.value->find("trip")].onentry.front(), branch);
  EXPECT_THAT(edited(with, SetAction{entry, 0, branch}), HasSubstr("it is so already"));
}

TEST(ChartEdit, RenamesAStateWithAllItsUses) {
  EXPECT_EQ(edited(kChart, RenameState{"moving", "driving"}),
            replaced(replaced(replaced(kChart, "initial=\"moving\"", "initial=\"driving\""), "id=\"moving\"",
                              "id=\"driving\""),
                     "target='moving'", "target='driving'"));
}

TEST(ChartEdit, AddsStatesAndTransitions) {
  EXPECT_THAT(edited(kChart, AddState{"", "new"}), HasSubstr("  <final id=\"end\"/>\n  <state id=\"new\"/>\n</scxml>"));
  EXPECT_THAT(edited(kChart, AddTransition{"idle", "end", "quit", "a < b"}),
              HasSubstr("    <transition event=\"quit\" cond=\"a &lt; b\" target=\"end\"/>\n  </state>"));
}

TEST(ChartEdit, KeepsLineEndsOfOtherSystems) {
  std::string crlf;
  for (const char c : kChart) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const std::string result = edited(crlf, AddState{"idle", "inner", "final"});
  EXPECT_THAT(result, HasSubstr("\r\n    <final id=\"inner\"/>\r\n"));
}

TEST(ChartEdit, SaysWhatCannotBe) {
  EXPECT_THAT(edited(kChart, AddState{"end", "x"}), HasSubstr("is final"));
  EXPECT_THAT(edited(kChart, AddState{"", "idle"}), HasSubstr("already"));
  EXPECT_THAT(edited(kChart, AddTransition{"end", "idle", "", ""}), HasSubstr("nothing leads out of end"));
  EXPECT_THAT(edited(kChart, RenameState{"nowhere", "x"}), HasSubstr("no state \"nowhere\""));
  EXPECT_THAT(edited(kChart, AddTransition{"idle", "", "", ""}), HasSubstr("an event, a condition or a target"));
  EXPECT_THAT(edited(kNested, MoveState{"trip", "off"}), HasSubstr("cannot go into itself"));
  EXPECT_THAT(edited(kNested, MoveState{"off", "end"}), HasSubstr("is final"));
  EXPECT_THAT(edited(kNested, MoveState{"off", "trip"}), HasSubstr("is there already"));
  EXPECT_THAT(edited(kNested, SetKind{"trip", "final"}), HasSubstr("which a final state has not"));
  EXPECT_THAT(edited(kNested, AddState{"", "back", "history"}), HasSubstr("which it remembers"));
  EXPECT_THAT(edited(kNested, SetTransition{0, {}, {}, "nowhere"}), HasSubstr("no state \"nowhere\""));
  EXPECT_THAT(edited(kNested, RemoveTransition{99}), HasSubstr("no such transition"));
  const ActionPlace entry{std::nullopt, "trip", "onentry"};
  EXPECT_THAT(edited(kNested, InsertAction{entry, 0, "<log"}), HasSubstr("no XML"));
  EXPECT_THAT(edited(kNested, InsertAction{entry, 0, "log"}), HasSubstr("one element"));
  EXPECT_THAT(edited(kNested, InsertAction{entry, 0, "<state id='x'/>"}), HasSubstr("state"));
  EXPECT_THAT(edited(kNested, SetAction{entry, 7, "<log/>"}), HasSubstr("no such action"));
}

}  // namespace
}  // namespace sentree::design
