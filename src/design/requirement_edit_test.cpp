#include "sentree/design/requirement_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/monitor/requirement.h"

namespace sentree::design {
namespace {

using testing::HasSubstr;

const std::string kText = R"(# Two of them.
let level [%] = reply(battery.getBatteryState).percentage * 100
event goes = request(base.go)

never_empty (critical) "Never emptier than 20 %.":
  always level >= 20 %.   # the whole run

turns (major) "It turns in time.":
  after event(goes), whenever level < 30 %,   # low
  robot shall (level > 40 % or event(goes)) within 10 ticks.
)";

std::string edited(const std::string& text, const RequirementGesture& gesture) {
  const auto result = edit_requirement(text, gesture);
  if (!result) return result.error().code + ": " + result.error().message;
  EXPECT_EQ(with_edits(with_edits(text, result->edits).value(), inverse(text, result->edits)).value(), text);
  return with_edits(text, result->edits).value();
}

std::string requirements_with(const std::string& old_text, const std::string& new_text, std::string text = kText) {
  EXPECT_NE(text.find(old_text), std::string::npos) << old_text;
  return text.replace(text.find(old_text), old_text.size(), new_text);
}

TEST(RequirementEdit, FindsThePartsOfASentence) {
  const auto sentences = sentences_of(kText);
  ASSERT_TRUE(sentences) << to_string(sentences.error());
  ASSERT_EQ(sentences->size(), 2U);
  const Sentence& turns = sentences->back();
  EXPECT_EQ(turns.scope, "after");
  EXPECT_EQ(turns.pattern, "respond");
  EXPECT_EQ(kText.substr(turns.from, 5), "turns");
  std::string parts;
  for (const SentencePart& part : turns.parts) {
    EXPECT_EQ(kText.substr(part.from, part.to - part.from), part.text);
    parts += part.part + "=" + part.text + ";";
  }
  EXPECT_EQ(parts, "open=event(goes);p=level < 30 %;q=(level > 40 % or event(goes));bound=10 ticks;");
}

TEST(RequirementEdit, WritesOnePartAndLeavesTheRest) {
  EXPECT_EQ(edited(kText, SetPart{"never_empty", "p", "level >= 25 %"}), requirements_with("20 %.   #", "25 %.   #"));
  EXPECT_EQ(edited(kText, SetPart{"turns", "bound", "3 s"}), requirements_with("10 ticks", "3 s"));
  EXPECT_EQ(edited(kText, SetPart{"turns", "assuming", "level > 0 %"}),
            requirements_with("10 ticks", "10 ticks assuming level > 0 %"));
  const std::string assumed = edited(kText, SetPart{"turns", "assuming", "level > 0 %"});
  EXPECT_EQ(edited(assumed, SetPart{"turns", "assuming", ""}), kText);
}

TEST(RequirementEdit, ChangesScopesAndKeepsWhatTheyShare) {
  EXPECT_EQ(edited(kText, SetScope{"turns", "globally"}), requirements_with("after event(goes), ", ""));
  EXPECT_EQ(edited(kText, SetScope{"turns", "after-until"}),
            requirements_with("after event(goes),", "after event(goes) until true,"));
  EXPECT_EQ(edited(kText, SetScope{"never_empty", "while"}), requirements_with("  always", "  while true, always"));
}

TEST(RequirementEdit, ChangesPatternsAndKeepsWhatTheyShare) {
  EXPECT_EQ(edited(kText, SetPattern{"never_empty", "never"}), requirements_with("always", "never"));
  EXPECT_EQ(edited(kText, SetPattern{"never_empty", "respond"}),
            requirements_with("always level >= 20 %", "whenever level >= 20 %, true within 1 s"));
  EXPECT_EQ(edited(kText, SetPattern{"turns", "keep-for"}),
            requirements_with("(level > 40 % or event(goes)) within", "keep (level > 40 % or event(goes)) for"));
  EXPECT_EQ(edited(kText, SetPattern{"turns", "not-for"}),
            requirements_with("(level > 40 % or event(goes)) within", "not (level > 40 % or event(goes)) for"));
}

TEST(RequirementEdit, EveryPatternAndScopeCanBecomeEveryOther) {
  for (const std::string& from : patterns()) {
    const std::string begun = from == "always" ? kText : edited(kText, SetPattern{"never_empty", from});
    for (const std::string& to : patterns()) {
      if (to == from) continue;
      const auto sentences = sentences_of(edited(begun, SetPattern{"never_empty", to}));
      ASSERT_TRUE(sentences) << from << " to " << to << ": " << to_string(sentences.error());
      EXPECT_EQ(sentences->front().pattern, to) << "from " << from;
      EXPECT_EQ(sentences->front().parts.front().text, "level >= 20 %");
    }
  }
  for (const std::string from : {"before", "after", "between", "after-until", "while"}) {
    const std::string begun = edited(kText, SetScope{"never_empty", from});
    EXPECT_EQ(sentences_of(begun)->front().scope, from);
    EXPECT_EQ(edited(begun, SetScope{"never_empty", "globally"}), kText);
  }
}

TEST(RequirementEdit, RefusesWhatIsNoSuchPart) {
  EXPECT_THAT(edited(kText, SetPart{"turns", "bound", "soon"}), HasSubstr("requirement.syntax"));
  EXPECT_THAT(edited(kText, SetPart{"turns", "p", "levle < 30 %"}), HasSubstr("requirement.unknown-name"));
  EXPECT_THAT(edited(kText, SetPart{"turns", "r", "true"}), HasSubstr("design.no-such-node"));
  EXPECT_THAT(edited(kText, SetPart{"never_empty", "p", "true.\nother: always true"}), HasSubstr("design.bad-edit"));
  EXPECT_THAT(edited(kText, SetPart{"never_empty", "p", " "}), HasSubstr("design.bad-name"));
  EXPECT_THAT(edited(kText, SetPattern{"nobody", "always"}), HasSubstr("design.no-such-node"));
  EXPECT_THAT(edited(kText, SetPattern{"turns", "respond"}), HasSubstr("design.nothing-to-do"));
  EXPECT_THAT(edited("a: always", SetPattern{"a", "never"}), HasSubstr("requirement.syntax"));
}

TEST(RequirementEdit, KeepsLineEndsOfOtherSystems) {
  std::string crlf;
  for (const char c : kText) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const std::string result = edited(crlf, SetPattern{"turns", "keep-for"});
  EXPECT_EQ(result,
            requirements_with("(level > 40 % or event(goes)) within", "keep (level > 40 % or event(goes)) for", crlf));
}

}  // namespace
}  // namespace sentree::design
