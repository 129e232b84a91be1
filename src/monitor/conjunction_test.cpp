#include "sentree/monitor/detail/conjunction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::monitor {
namespace {

Js js(const char* text) { return {text, 2}; }

TEST(Conjuncts, AreSplitWhereNothingEnclosesThem) {
  const auto texts = [](const char* text) {
    std::vector<std::string> parts;
    for (const Js& part : conjuncts(js(text))) parts.push_back(part.text);
    return parts;
  };
  EXPECT_THAT(texts("a && b === ' && ' && (c && d)"), testing::ElementsAre("a", "b === ' && '", "(c && d)"));
  EXPECT_THAT(texts("a && b || c"), testing::ElementsAre("a && b || c"));
  EXPECT_THAT(texts("p === 'it\\'s && so' && q"), testing::ElementsAre("p === 'it\\'s && so'", "q"));
  EXPECT_THAT(texts("a"), testing::ElementsAre("a"));
}

TEST(Excludes, WhatOneValueCannotBeAtOnce) {
  for (const auto& [known, other] : std::initializer_list<std::pair<const char*, const char*>>{
           {"x < 3", "x >= 3"},
           {"x < 3", "x > 4"},
           {"x <= 3", "x > 3"},
           {"x === 3", "x > 3"},
           {"x === 3", "x !== 3"},
           {"p === 'a'", "p === 'b'"},
           {"p !== 'a'", "p === 'a'"},
           {"b === true", "b === false"},
           {"b !== true", "b === true"},
           {"!b", "b"},
           {"b", "!b"},
           {"(a || b)", "!(a || b)"},
           {"_event.data.result.percentage * 100 < 30", "_event.data.result.percentage * 100 >= 30"}}) {
    EXPECT_TRUE(excludes(js(known), js(other))) << known << " and " << other;
    EXPECT_TRUE(excludes(js(other), js(known))) << known << " and " << other;
  }
  for (const auto& [known, other] :
       std::initializer_list<std::pair<const char*, const char*>>{{"x <= 3", "x >= 3"},
                                                                  {"x < 4", "x > 3"},
                                                                  {"x < 3", "y >= 3"},
                                                                  {"x !== 3", "x > 3"},
                                                                  {"p === 'a'", "p !== 'b'"},
                                                                  {"p === 'a'", "p === q"},
                                                                  {"x === 3", "x === '3 of'"},
                                                                  {"!a === b", "a === b"},
                                                                  {"a || x < 3", "a || x >= 3"},
                                                                  {"c ? x : y < 3", "c ? x : y >= 3"},
                                                                  {"b", "b"}})
    EXPECT_FALSE(excludes(js(known), js(other))) << known << " and " << other;
}

TEST(Conjunction, LeavesOutWhatTheRestImplies) {
  EXPECT_EQ(without_repetition(js("p === 'kitchen' && p !== 'station' && x < 3")).text, "p === 'kitchen' && x < 3");
  EXPECT_EQ(without_repetition(js("!(x >= 30) && x < 30")).text, "x < 30");
  EXPECT_EQ(without_repetition(js("p !== 'a' && p !== 'a'")).text, "p !== 'a'");
  EXPECT_EQ(without_repetition(js("p !== 'a' && p !== 'b'")).text, "p !== 'a' && p !== 'b'");
  EXPECT_EQ(without_repetition(js("x < 30 && !(x >= 40)")).text, "x < 30");
  EXPECT_EQ(without_repetition(js("x < 30 && !(x >= 20)")).text, "x < 30 && !(x >= 20)");
}

TEST(Undefined, MakesComparisonsFalse) {
  EXPECT_TRUE(is_false_of_undefined(js("x < 3"), "x"));
  EXPECT_TRUE(is_false_of_undefined(js("p === 'a'"), "p"));
  EXPECT_FALSE(is_false_of_undefined(js("p !== 'a'"), "p"));
  EXPECT_FALSE(is_false_of_undefined(js("x < 3"), "y"));
  EXPECT_FALSE(is_false_of_undefined(js("!b"), "b"));
}

}  // namespace
}  // namespace sentree::monitor
