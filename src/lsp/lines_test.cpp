#include "sentree/lsp/lines.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

namespace sentree::lsp {
namespace {

TEST(Lines, CountUnitsOfUtf16) {
  const std::string text = "aä€😀b\nc";  // 1, 2, 3 and 4 bytes
  const Lines lines(text);
  EXPECT_EQ(lines.position(text, text.find('b'), Units::kUtf16), (Position{0, 5}));
  EXPECT_EQ(lines.position(text, text.find('b'), Units::kUtf8), (Position{0, 10}));
  EXPECT_EQ(lines.offset(text, {0, 5}, Units::kUtf16), text.find('b'));
  EXPECT_EQ(lines.offset(text, {0, 4}, Units::kUtf16), text.find("😀")) << "the middle of a character is its beginning";
  EXPECT_EQ(lines.offset(text, {1, 1}, Units::kUtf16), text.size());
}

TEST(Lines, EndInEachOfTheThreeWays) {
  const std::string text = "a\r\nb\rc\nd";
  const Lines lines(text);
  for (std::uint64_t line = 0; line < 4; ++line)
    EXPECT_EQ(text[lines.offset(text, {line, 0}, Units::kUtf16)], static_cast<char>('a' + line));
}

TEST(Lines, KeepPositionsInsideTheText) {
  const std::string text = "ab\ncd";
  const Lines lines(text);
  EXPECT_EQ(lines.offset(text, {0, 99}, Units::kUtf16), 2U) << "the end of the line, before its end mark";
  EXPECT_EQ(lines.offset(text, {99, 0}, Units::kUtf16), text.size());
  EXPECT_EQ(lines.position(text, 99, Units::kUtf16), (Position{1, 2}));
}

TEST(Lines, LeadBackFromEachCharacter) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  const std::string pieces[] = {"a", "ä", "€", "😀", "\n", "\r\n", " "};
  for (int round = 0; round < 200; ++round) {
    std::string text;
    std::vector<std::size_t> begins;
    for (int i = 0; i < 40; ++i) {
      begins.push_back(text.size());
      text += pieces[random() % std::size(pieces)];
    }
    const Lines lines(text);
    for (const Units units : {Units::kUtf8, Units::kUtf16}) {
      for (const std::size_t at : begins)
        ASSERT_EQ(lines.offset(text, lines.position(text, at, units), units), at) << "seed " << kSeed << ": " << text;
    }
  }
}

TEST(Lines, CountOnWithinLongLines) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  const std::pair<std::string, std::uint64_t> pieces[] = {{"a", 1}, {"ä", 1}, {"€", 1}, {"😀", 2}};
  std::string text = "first\n";
  std::vector<std::pair<std::size_t, std::uint64_t>> places;  // byte, and units of UTF-16 before it
  std::uint64_t units = 0;
  for (int i = 0; i < 5000; ++i) {
    places.emplace_back(text.size(), units);
    const auto& [piece, size] = pieces[random() % std::size(pieces)];
    text += piece;
    units += size;
  }
  const std::size_t end = text.size();
  text += "\nlast";
  const Lines lines(text);
  for (const auto& [byte, before] : places) {
    ASSERT_EQ(lines.position(text, byte, Units::kUtf16), (Position{1, before})) << "seed " << kSeed;
    ASSERT_EQ(lines.position(text, byte, Units::kUtf8), (Position{1, byte - 6})) << "seed " << kSeed;
    ASSERT_EQ(lines.offset(text, {1, before}, Units::kUtf16), byte) << "seed " << kSeed;
    ASSERT_EQ(lines.offset(text, {1, byte - 6}, Units::kUtf8), byte) << "seed " << kSeed;
  }
  EXPECT_EQ(lines.offset(text, {1, units + 9}, Units::kUtf16), end);
  EXPECT_EQ(lines.position(text, end + 2, Units::kUtf16), (Position{2, 1}));
}

}  // namespace
}  // namespace sentree::lsp
