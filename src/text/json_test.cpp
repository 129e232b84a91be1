#include "sentree/text/json.h"

#include <gtest/gtest.h>

namespace sentree::text {
namespace {

TEST(Json, ReadsWhatToJsonWrites) {
  const std::string source = R"({"z":null,"a":[true,-3,2.5,1e+300,"\u0001é\"\\"],"m":{}})";
  const auto value = parse_json(source);
  ASSERT_TRUE(value);
  EXPECT_EQ(to_json(*value), source);
}

TEST(Json, TellsIntegersFromDoubles) {
  EXPECT_EQ(*parse_json("1"), Value(1));
  EXPECT_EQ(*parse_json("1.0"), Value(1.0));
  EXPECT_EQ(*parse_json("18446744073709551615"), Value(18446744073709551615.0));
}

TEST(Json, RefusesWithAPlace) {
  const auto value = parse_json("{\"a\":\n  [1,]}", "a.json");
  ASSERT_FALSE(value);
  EXPECT_EQ(value.error().span.line, 2);
  EXPECT_EQ(value.error().code, "json.syntax");
}

TEST(Json, BoundsNesting) {
  const std::string ok = std::string(kNestingMax, '[') + std::string(kNestingMax, ']');
  EXPECT_TRUE(parse_json(ok));
  EXPECT_EQ(parse_json("[" + ok + "]").error().code, "json.too-deep");
}

}  // namespace
}  // namespace sentree::text
