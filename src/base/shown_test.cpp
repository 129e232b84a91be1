#include "sentree/base/shown.h"

#include <gtest/gtest.h>

#include "sentree/base/diagnostic.h"

namespace sentree {
namespace {

TEST(Shown, WhatATerminalWouldObeyIsWrittenOut) {
  EXPECT_EQ(shown("k\x1b[2J\x07\r\x7f"), "k\\x1b[2J\\x07\\x0d\\x7f");
  EXPECT_EQ(shown("\xC2\x9B"
                  "31m"),
            "\\x9b31m");
  EXPECT_EQ(shown("größer\t– 20 °C\n"), "größer\t– 20 °C\n");
  EXPECT_EQ(shown(std::string_view("a\0b", 3)), "a\\x00b");
}

TEST(Shown, WhatIsLongIsLeftOutInTheMiddleBetweenCharacters) {
  std::string text;
  for (int i = 0; i < 10'000; ++i) text += "é";
  const std::string out = shown_in_short("a" + text + "z");
  EXPECT_LT(out.size(), 4'100U);
  EXPECT_TRUE(out.starts_with("aéé"));
  EXPECT_TRUE(out.ends_with("ééz"));
  EXPECT_NE(out.find("é … é"), std::string::npos);
}

TEST(Shown, NumbersAreGroupedByThousands) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1'000), "1,000");
  EXPECT_EQ(grouped(18'446'744'073'709'551'615U), "18,446,744,073,709,551,615");
}

TEST(Shown, SoAreFindings) {
  EXPECT_EQ(to_string(Diagnostic{Severity::kError, "a.b", "no key \"k\x1b[1m\"", {"f.yaml", 3, 1, 0}}),
            "f.yaml:3:1: no key \"k\\x1b[1m\"");
}

}  // namespace
}  // namespace sentree
