#include "sentree/base/source.h"

#include <gtest/gtest.h>

#include <string>

namespace sentree {
namespace {

std::string at(const LineIndex& index, std::size_t offset) {
  const auto [line, column] = index.position(offset);
  return std::to_string(line) + ":" + std::to_string(column);
}

TEST(LineIndex, CountsLinesAndBytesFromOne) {
  const LineIndex index("ab\n\ncé\n");
  EXPECT_EQ(at(index, 0), "1:1");
  EXPECT_EQ(at(index, 2), "1:3");  // the line feed ends its line
  EXPECT_EQ(at(index, 3), "2:1");
  EXPECT_EQ(at(index, 4), "3:1");
  EXPECT_EQ(at(index, 7), "3:4");
  EXPECT_EQ(at(index, 8), "4:1");
}

TEST(LineIndex, GivesTheEndForWhatLiesBeyond) {
  EXPECT_EQ(at(LineIndex("ab"), 100), "1:3");
  EXPECT_EQ(at(LineIndex("ab\n"), 100), "2:1");
  EXPECT_EQ(at(LineIndex(""), 100), "1:1");
  EXPECT_EQ(at(LineIndex(), 5), "1:1");
}

}  // namespace
}  // namespace sentree
