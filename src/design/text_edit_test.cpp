#include "sentree/design/text_edit.h"

#include <gtest/gtest.h>

#include <random>

namespace sentree::design {
namespace {

TEST(EditsBetween, CutToTheCharactersThatDiffer) {
  EXPECT_EQ(edits_between("a\nbcd\ne\n", "a\nbxd\ne\n"), (TextEdits{{3, 4, "x"}}));
  EXPECT_EQ(edits_between("a\ne\n", "a\nnew\ne\n"), (TextEdits{{2, 2, "new\n"}}));
  EXPECT_EQ(edits_between("same", "same"), TextEdits{});
  // ä and ö begin with the same byte.
  EXPECT_EQ(edits_between("ä", "ö"), (TextEdits{{0, 2, "ö"}}));
}

TEST(EditsBetween, MakesOneTextOfTheOtherAndBack) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto text = [&] {
    std::string made;
    const int lines = static_cast<int>(random() % 12);
    for (int i = 0; i < lines; ++i)
      made += std::string(1, static_cast<char>('a' + random() % 4)) + (random() % 9 != 0 ? "\n" : "");
    return made;
  };
  for (int i = 0; i < 2000; ++i) {
    const std::string before = text();
    const std::string after = text();
    const TextEdits edits = edits_between(before, after);
    ASSERT_EQ(with_edits(before, edits).value(), after) << before << "→" << after;
    ASSERT_EQ(with_edits(after, inverse(before, edits)).value(), before) << before << "→" << after;
  }
}

TEST(EditsBetween, CallsTheMiddleChangedWhereTooMuchDiffers) {
  std::string before;
  std::string after;
  for (int i = 0; i < kDifferentLinesMax; ++i) {
    before += "a" + std::to_string(i) + "\n";
    after += "b" + std::to_string(i) + "\n";
  }
  EXPECT_EQ(edits_between(before, after).size(), 1U);
  EXPECT_EQ(with_edits(before, edits_between(before, after)).value(), after);
}

TEST(Apply, RefusesEditsOutsideOrOutOfOrder) {
  EXPECT_FALSE(with_edits("abc", {{2, 4, ""}}));
  EXPECT_FALSE(with_edits("abc", {{2, 1, ""}}));
  EXPECT_FALSE(with_edits("abc", {{2, 3, ""}, {1, 1, "x"}}));
}

TEST(Merge, JoinsChangesOfDifferentLines) {
  EXPECT_EQ(merge("1\n2\n3\n4\n", "one\n2\n3\n4\n", "1\n2\n3\nfour\n"), "one\n2\n3\nfour\n");
  EXPECT_EQ(merge("1\n2\n3\n", "1\n2\n3\n", "1\n3\n"), "1\n3\n");
  EXPECT_EQ(merge("1\n2\n3\n", "x\n2\n3\n", "x\n2\n3\nnew\n"), "x\n2\n3\nnew\n");
}

TEST(Merge, RefusesTwoChangesOfOneLineOrOfNeighbours) {
  EXPECT_EQ(merge("1\n2\n3\n", "1\nmine\n3\n", "1\ntheirs\n3\n"), std::nullopt);
  EXPECT_EQ(merge("1\n2\n", "1\n2\nmine\n", "1\n2\ntheirs\n"), std::nullopt);
  EXPECT_EQ(merge("1\n2\n3\n", "1\nmine\n3\n", "1\n2\ntheirs\n"), std::nullopt);
}

TEST(TextEdit, EditsOfAnEarlierTextAreJoinedWithWhatHappenedSince) {
  const std::string earlier = "<root>\n  <a/>\n  <b/>\n  <c/>\n</root>\n";
  const auto edit = [](const std::string& text, const std::string& what, const std::string& with) {
    return TextEdits{{text.find(what), text.find(what) + what.size(), with}};
  };
  const std::string now = "<root>\n  <new/>\n  <a/>\n  <b/>\n  <c/>\n</root>\n";
  const auto edits = joined("m.xml", earlier, now, edit(earlier, "<c/>", "<c name=\"c\"/>"));
  ASSERT_TRUE(edits) << edits.error().message;
  EXPECT_EQ(with_edits(now, *edits).value(), "<root>\n  <new/>\n  <a/>\n  <b/>\n  <c name=\"c\"/>\n</root>\n");
  const auto both =
      joined("m.xml", earlier, with_edits(earlier, edit(earlier, "<c/>", "<d/>")).value(), edit(earlier, "<c/>", ""));
  EXPECT_EQ(both.error().message, "the same lines of m.xml have been changed meanwhile");
  // Each is readable, both together are not.
  const auto late = joined("m.yaml", "a: 1\n\n\nb: 2\n", "a: 1\n\n\nb: 2\n\nc: 3\n", {{0, 0, "c: 4\n"}});
  EXPECT_EQ(late.error().message, "with what has been changed meanwhile, m.yaml could not be read");
}

}  // namespace
}  // namespace sentree::design
