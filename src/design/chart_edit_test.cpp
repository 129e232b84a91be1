#include "sentree/design/chart_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST(ChartEdit, RenamesAStateWithAllItsUses) {
  EXPECT_EQ(edited(kChart, RenameState{"moving", "driving"}),
            replaced(replaced(replaced(kChart, "initial=\"moving\"", "initial=\"driving\""), "id=\"moving\"",
                              "id=\"driving\""),
                     "target='moving'", "target='driving'"));
}

TEST(ChartEdit, AddsStatesAndTransitions) {
  EXPECT_THAT(edited(kChart, AddState{"", "new", false}),
              HasSubstr("  <final id=\"end\"/>\n  <state id=\"new\"/>\n</scxml>"));
  EXPECT_THAT(edited(kChart, AddTransition{"idle", "end", "quit", "a < b"}),
              HasSubstr("    <transition event=\"quit\" cond=\"a &lt; b\" target=\"end\"/>\n  </state>"));
}

TEST(ChartEdit, KeepsLineEndsOfOtherSystems) {
  std::string crlf;
  for (const char c : kChart) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const std::string result = edited(crlf, AddState{"idle", "inner", true});
  EXPECT_THAT(result, HasSubstr("\r\n    <final id=\"inner\"/>\r\n"));
}

TEST(ChartEdit, SaysWhatCannotBe) {
  EXPECT_THAT(edited(kChart, AddState{"end", "x", false}), HasSubstr("is final"));
  EXPECT_THAT(edited(kChart, AddState{"", "idle", false}), HasSubstr("already"));
  EXPECT_THAT(edited(kChart, AddTransition{"end", "idle", "", ""}), HasSubstr("nothing leads out of end"));
  EXPECT_THAT(edited(kChart, RenameState{"nowhere", "x"}), HasSubstr("no state \"nowhere\""));
  // The transition to it would lead nowhere.
  EXPECT_THAT(edited(kChart, RemoveState{"moving"}), HasSubstr("moving"));
}

}  // namespace
}  // namespace sentree::design
