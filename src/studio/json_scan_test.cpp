#include "sentree/studio/json_scan.h"

#include <gtest/gtest.h>

namespace sentree::studio {
namespace {

TEST(JsonScan, FindsMembersWhateverIsBeforeThem) {
  const std::string_view text = R"( { "a" : {"b":"}]\"" , "c":[1,{"d":2}]} ,"e":-1.5e3, "f":"x\"y" } )";
  EXPECT_EQ(member(text, "e"), "-1.5e3");
  EXPECT_EQ(as_number(member(text, "e")), -1500.0);
  EXPECT_EQ(unquoted(member(text, "f")), "x\"y");
  EXPECT_EQ(member(member(text, "a"), "c"), R"([1,{"d":2}])");
  EXPECT_EQ(member(text, "d"), "");
}

TEST(JsonScan, WalksOverItems) {
  std::string all;
  for (JsonWalk walk(R"([1, "two,", [3], {}])"); walk.next();) all += std::string(walk.value()) + "|";
  EXPECT_EQ(all, R"(1|"two,"|[3]|{}|)");
}

TEST(JsonScan, EndsWithTextThatIsNoJson) {
  for (const std::string_view text :
       {"", "{", "[", "{\"a", "{\"a\"", "{\"a\":", "[1,", "{]", "]", "{\"a\":}", "[[[[", "{\"a\\"}) {
    int members = 0;
    for (JsonWalk walk(text); walk.next();) ++members;
    EXPECT_LE(members, 1) << text;
  }
}

}  // namespace
}  // namespace sentree::studio
