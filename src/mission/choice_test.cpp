#include "sentree/mission/choice.h"

#include <gtest/gtest.h>

#include <vector>

#include "sentree/base/value.h"

namespace sentree::mission {
namespace {

TEST(ScriptedChoice, IsTheAlternativeOfThatValueHoweverItsNumberIsWritten) {
  const std::vector<Value> values{59.5, 60.0, 60.5, "60", true, 0.0, -0.0, Value()};
  const Choice choice{.model = "robot",
                      .function = "between",
                      .number = 3,
                      .count = values.size(),
                      .alternative = [&](std::uint64_t i) { return values[i]; }};
  const auto chosen = [&](Value value) {
    project::Scenario scenario;
    scenario.choices.emplace();
    scenario.choices->push_back({.model = "robot", .number = 3, .value = std::move(value)});
    return scripted(scenario, choice);
  };
  EXPECT_EQ(chosen(60), 1U);
  EXPECT_EQ(chosen(60.0), 1U);
  EXPECT_EQ(chosen(60.5), 2U);
  EXPECT_EQ(chosen("60"), 3U);
  EXPECT_EQ(chosen(true), 4U);
  EXPECT_EQ(chosen(61), std::nullopt);
  EXPECT_EQ(chosen(0.0), 5U);
  EXPECT_EQ(chosen(-0.0), 6U);
  EXPECT_EQ(chosen(Value()), 7U);
}

TEST(ScriptedChoice, OfAValueThatIsNotThereIsToldWithThoseThatAre) {
  const auto told = [](const std::vector<Value>& values, Value given) {
    const Choice choice{.model = "robot",
                        .function = "pick",
                        .name = "goes",
                        .place = "robot.scxml:3",
                        .number = 2,
                        .count = values.size(),
                        .alternative = [&](std::uint64_t i) { return values[i]; }};
    project::Scenario scenario;
    scenario.choices.emplace();
    scenario.choices->push_back({.model = "robot", .number = 2, .value = std::move(given)});
    EXPECT_EQ(scripted(scenario, choice), std::nullopt);
    return no_such_alternative(scenario, choice);
  };
  EXPECT_EQ(told({"left", "right"}, "rigth"),
            "choice robot#2 (goes at robot.scxml:3) has no alternative \"rigth\", and one is drawn; there are "
            "\"left\", \"right\"; did you mean \"right\"?");
  EXPECT_EQ(told({0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, 10),
            "choice robot#2 (goes at robot.scxml:3) has no alternative 10, and one is drawn; there are 0, 1, 2, 3, 4, "
            "5, 6, 7 … 9, 10 in all");
}

TEST(ScriptedChoice, IsTheFirstWithoutAnEntryAndNoneWhereNothingIsSaid) {
  const Choice choice{.model = "robot", .number = 1, .count = 2, .alternative = [](std::uint64_t i) {
                        return Value(static_cast<std::int64_t>(i));
                      }};
  project::Scenario scenario;
  EXPECT_EQ(scripted(scenario, choice), std::nullopt);
  scenario.choices.emplace();
  EXPECT_EQ(scripted(scenario, choice), 0U);
}

TEST(ScriptedChoice, OfALaterRoundIsThatOfTheFirst) {
  Choice choice{.model = "robot", .number = 4, .count = 2, .alternative = [](std::uint64_t i) {
                  return Value(static_cast<std::int64_t>(i));
                }};
  project::Scenario scenario;
  scenario.choices.emplace();
  scenario.choices->push_back({.model = "robot", .number = 4, .value = 1});
  scenario.loop.emplace();
  scenario.loop->choices["robot"] = {3, 4};
  EXPECT_EQ(scripted(scenario, choice), 1U);
  choice.number = 5;
  EXPECT_EQ(scripted(scenario, choice), 0U);
  choice.number = 10;
  EXPECT_EQ(scripted(scenario, choice), 1U);
}

}  // namespace
}  // namespace sentree::mission
