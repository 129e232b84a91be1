#include "sentree/design/findings.h"

#include <gtest/gtest.h>

namespace sentree::design {
namespace {

TEST(Locate, FindsTheWordThatASuggestionReplaces) {
  const std::string text = "<root>\n  <A thresold=\"30\"/>\n</root>\n";
  const Finding finding = locate({Severity::kError,
                                  "bt.unknown-port",
                                  "A has no port \"thresold\" in the TreeNodesModel; did you mean \"threshold\"?",
                                  {"/p/mission.xml", 2, 6, 8}},
                                 "/p", text);
  EXPECT_EQ(finding.file, "mission.xml");
  EXPECT_EQ(text.substr(finding.from, finding.to - finding.from), "thresold");
  ASSERT_EQ(finding.fixes.size(), 1U);
  EXPECT_EQ(with_edits(text, {finding.fixes.front().edit}).value(), "<root>\n  <A threshold=\"30\"/>\n</root>\n");
}

TEST(Locate, HasNoFixWhereTheWordIsNotThere) {
  const Finding finding =
      locate({Severity::kError, "x", "no \"b\"; did you mean \"c\"?", {"mission.xml", 1, 1, 0}}, "/p", "a bb\nb\n");
  EXPECT_TRUE(finding.fixes.empty());
  EXPECT_EQ(finding.to, 1U);
}

TEST(Locate, KnowsWhatLiesOutside) {
  EXPECT_EQ(locate({Severity::kError, "x", "y", {"/other/mission.xml", 1, 1, 0}}, "/p", "").file, "");
  EXPECT_EQ(file_inside("/p", "/p/skills/A.scxml"), "skills/A.scxml");
  EXPECT_EQ(file_inside("/p", "/p/../q.xml"), "");
}

}  // namespace
}  // namespace sentree::design
