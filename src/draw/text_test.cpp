#include "sentree/draw/detail/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "sentree/base/rng.h"

namespace sentree::draw {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Wrap, BreaksAtBlanksThenAfterPunctuationThenAnywhere) {
  EXPECT_THAT(wrap("one two three", 10, text_width("one two", 10), 9), ElementsAre("one two", "three"));
  EXPECT_THAT(wrap("navigation.goto", 10, text_width("navigation.g", 10), 9), ElementsAre("navigation.", "goto"));
  EXPECT_THAT(wrap("mmmmmm", 10, text_width("mmmm", 10), 9), ElementsAre("mmmm", "mm"));
}

TEST(Wrap, MarksWhatItLeavesOut) {
  EXPECT_THAT(wrap("aa bb cc", 10, text_width("aa ", 10), 2), ElementsAre("aa", "b…"));
  EXPECT_THAT(wrap("aa", 10, 100, 0), IsEmpty());
  EXPECT_THAT(wrap("  \n ", 10, 100, 3), IsEmpty());
}

TEST(Wrap, FitsItsWidthAndKeepsCharactersWhole) {
  Rng rng(7);
  for (int round = 0; round < 500; ++round) {
    SCOPED_TRACE("seed 7, round " + std::to_string(round));
    std::string text;
    for (std::uint64_t n = rng.below(60); n > 0; --n) text += static_cast<char>(rng.below(256));
    for (const std::string& line : wrap(text, 11, 60, 5)) {
      EXPECT_LE(text_width(line, 11), 60 + 1e-9);
      EXPECT_EQ(printable(line), line);
    }
  }
}

TEST(Printable, ReplacesWhatXmlCannotHold) {
  EXPECT_EQ(printable("a\tb\x1f\x7f"
                      "c"),
            "a b  c");
  EXPECT_EQ(printable("\xc3\x28"), "\xEF\xBF\xBD(");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");  // half of a surrogate pair
  EXPECT_EQ(printable("\xc0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD");                  // an overlong nul
  EXPECT_EQ(printable("\xef\xbf\xbf"), "\xEF\xBF\xBD");                          // U+FFFF
  EXPECT_EQ(printable("é→😀"), "é→😀");
}

TEST(Coordinate, IsShortAndHasNoNegativeZero) {
  EXPECT_EQ(coordinate(0), "0");
  EXPECT_EQ(coordinate(-0.001), "0");
  EXPECT_EQ(coordinate(10), "10");
  EXPECT_EQ(coordinate(1.5), "1.5");
  EXPECT_EQ(coordinate(-2.345), "-2.35");
}

}  // namespace
}  // namespace sentree::draw
