#include "sentree/studio/detail/alternatives.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/json.h"

namespace sentree::studio {
namespace {

using ::testing::HasSubstr;

class AlternativesOfARun : public ::testing::Test {
 protected:
  AlternativesOfARun() { alternatives_.install({"hall"}, options_); }

  // The model chooses one of `count`; `at(i)` are its alternatives.
  void choose(const char* function, std::uint64_t count, std::function<Value(std::uint64_t)> at, const Value& chosen) {
    options_.on_choice({.model = "hall",
                        .function = function,
                        .place = "models/hall.scxml:9",
                        .number = ++made_,
                        .count = count,
                        .alternative = std::move(at)});
    Message message;
    message.name = "hall.choice";
    message.data = Map{{"function", function}, {"value", chosen}};
    options_.listeners_of.at(0).second(message);
  }

  std::string refusal(List choose) const {
    const auto can_be = alternatives_.check(Value(std::move(choose)));
    return can_be ? "" : to_string(can_be.error());
  }

  runtime::RunOptions options_;
  Alternatives alternatives_;
  std::uint64_t made_ = 0;
};

TEST_F(AlternativesOfARun, AreTold) {
  choose(
      "chance", 2, [](std::uint64_t i) { return Value(i == 1); }, true);
  choose(
      "between", 1000, [](std::uint64_t i) { return Value(60 + 10.0 * static_cast<double>(i)); }, 70.0);
  const auto told = alternatives_.answer(List{"hall#1", "hall#2", "hall#3", "door#1", "hall"});
  ASSERT_TRUE(told.has_value());
  const List& each = *told->as_list();
  EXPECT_EQ(to_json(each[0]), R"({"values":[false,true],"count":2,"last":true})");
  EXPECT_EQ(each[1].find("values")->as_list()->size(), Alternatives::kKeptMax);
  EXPECT_EQ(*each[1].find("count"), Value(1000));
  EXPECT_EQ(*each[1].find("last"), Value(10050.0));
  for (std::size_t i = 2; i < 5; ++i) EXPECT_TRUE(each[i].is_null());
  EXPECT_FALSE(alternatives_.answer("hall#1").has_value());
}

TEST_F(AlternativesOfARun, RefuseWhatThereIsNot) {
  const std::vector<const char*> words{"left", "right"};
  choose(
      "choose", 2, [&](std::uint64_t i) { return Value(words[i]); }, "left");
  choose(
      "between", 5, [](std::uint64_t i) { return Value(60 + 10.0 * static_cast<double>(i)); }, 70.0);
  choose(
      "between", 100'001, [](std::uint64_t i) { return Value(0.1 * static_cast<double>(i)); }, 0.1);
  EXPECT_EQ(refusal({"hall#1=\"left\"", "hall#2=60"}), "");
  EXPECT_EQ(refusal({"hall#1=right"}), "");
  EXPECT_THAT(refusal({"hall#1=\"left\"", "hall#2=65"}),
              HasSubstr("choice hall#2 (between at models/hall.scxml:9) has no alternative 65; there are 60.0, 70.0, "
                        "80.0, 90.0, 100.0"));
  EXPECT_THAT(refusal({"hall#2=abc"}), HasSubstr("has no alternative \"abc\"; there are 60.0"));
  EXPECT_THAT(refusal({"hall#1=rigth"}), HasSubstr("did you mean \"right\"?"));
  // Of many, the one that is not listed; what lies between two is none.
  EXPECT_EQ(refusal({"hall#3=7000.1"}), "");
  EXPECT_THAT(refusal({"hall#3=7000.15"}), HasSubstr("10000.0, 100001 in all"));
  EXPECT_THAT(refusal({"hall#3=10000.1"}), HasSubstr("has no alternative"));
  EXPECT_THAT(refusal({"hall#3=true"}), HasSubstr("has no alternative"));
}

TEST_F(AlternativesOfARun, OfARunThatIsAnotherAreNotKnown) {
  choose(
      "chance", 2, [](std::uint64_t i) { return Value(i == 1); }, true);
  choose(
      "chance", 2, [](std::uint64_t i) { return Value(i == 1); }, true);
  EXPECT_EQ(refusal({"hall#1=false", "hall#2=abc"}), "");
  EXPECT_THAT(refusal({"hall#1=true", "hall#2=abc"}), HasSubstr("hall#2"));
  EXPECT_EQ(refusal({"hall#3=abc"}), "");
}

}  // namespace
}  // namespace sentree::studio
