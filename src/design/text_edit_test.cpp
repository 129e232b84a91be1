#include "sentree/design/text_edit.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <string>
#include <utility>

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

TEST(Merge, JoinsChangesOfNeighbours) {
  EXPECT_EQ(merge("1\n2\n3\n", "1\nmine\n3\n", "1\n2\ntheirs\n"), "1\nmine\ntheirs\n");
  EXPECT_EQ(merge("1\n2\n3\n", "1\nmine\n3\n", "1\n2\nnew\n3\n"), "1\nmine\nnew\n3\n");
  EXPECT_EQ(merge("1\n2\n3\n", "1\nnew\n2\n3\n", "1\ntheirs\n3\n"), "1\nnew\ntheirs\n3\n");
  EXPECT_EQ(merge("1\n2\n3\n", "1\n3\n", "1\n2\n"), "1\n");
}

TEST(Merge, RefusesTwoChangesOfOneLineOrAtOnePlace) {
  EXPECT_EQ(merge("1\n2\n3\n", "1\nmine\n3\n", "1\ntheirs\n3\n"), std::nullopt);
  EXPECT_EQ(merge("1\n2\n", "1\n2\nmine\n", "1\n2\ntheirs\n"), std::nullopt);
  EXPECT_EQ(merge("1\n2\n3\n4\n", "1\nmine\n4\n", "1\n2\n3\nnew\n4\n"), "1\nmine\nnew\n4\n");
  EXPECT_EQ(merge("1\n2\n3\n4\n", "1\nmine\n4\n", "1\n2\nnew\n3\n4\n"), std::nullopt);
}

// Whoever comes first: with the same lines changed, all of both is there.
TEST(Merge, IsTheSameFromBothSidesAndHasAllOfBoth) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int joined_texts = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string base;
    std::string mine;
    std::string theirs;
    for (int line = 0; line < 6; ++line) {
      const std::string text = "line " + std::to_string(line) + "\n";
      base += text;
      const auto edited = [&](const std::string& who) {
        const std::string own = who + std::to_string(line) + "\n";
        switch (random() % 8) {
          case 0: return own;
          case 1: return own + text;
          case 2: return std::string();
          default: return text;
        }
      };
      mine += edited("mine ");
      theirs += edited("theirs ");
    }
    const auto merged = merge(base, mine, theirs);
    ASSERT_EQ(merged, merge(base, theirs, mine)) << base << "---\n" << mine << "---\n" << theirs;
    if (!merged) continue;
    ++joined_texts;
    for (const auto& [one, who] : {std::pair(mine, "mine "), std::pair(theirs, "theirs ")}) {
      for (int line = 0; line < 6; ++line) {
        const std::string own = who + std::to_string(line) + "\n";
        ASSERT_EQ(merged->find(own) != std::string::npos, one.find(own) != std::string::npos) << *merged;
      }
    }
  }
  EXPECT_GT(joined_texts, 300);
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
  // Two states of one id; a decorator with two children.
  const std::string chart = "<scxml><state id=\"a\"/>\n<state id=\"b\"/>\n</scxml>\n";
  const std::size_t last = chart.find("</scxml>");
  const std::string with_first = "<scxml><state id=\"new\"/><state id=\"a\"/>\n<state id=\"b\"/>\n</scxml>\n";
  EXPECT_FALSE(joined("c.scxml", chart, with_first, {{last, last, "<state id=\"new\"/>\n"}}));
  EXPECT_TRUE(joined("c.scxml", chart, with_first, {{last, last, "<state id=\"other\"/>\n"}}));
  const std::string tree =
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Inverter>\n<Sequence>\n<a/>\n</Sequence>\n"
      "</Inverter></BehaviorTree></root>\n";
  TextEdits unwrap;
  for (const std::string& tag : {std::string("<Sequence>\n"), std::string("</Sequence>\n")})
    unwrap.push_back({tree.find(tag), tree.find(tag) + tag.size(), ""});
  std::string with_second = tree;
  with_second.replace(tree.find("<a/>"), 4, "<a/><b/>");
  EXPECT_FALSE(joined("m.xml", tree, with_second, unwrap));
}

}  // namespace
}  // namespace sentree::design
