#include "sentree/project/loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/plan.h"
#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"

namespace sentree::project {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A scenario of a project at 10 Hz with one model.
class Loop : public ::testing::Test {
 protected:
  Loaded<Scenario> load(const std::string& text) const {
    const auto put = [&](const std::string& file, const std::string& content) {
      std::filesystem::create_directories((folder_.path() / file).parent_path());
      ASSERT_TRUE(text::write_file(folder_.path() / file, content));
    };
    put("sentree.yaml",
        "mission: {file: mission.xml, rate: 10 Hz}\nmodels: [{file: models/m.scxml, serves: []}]\nservices: {}\n");
    put("scenarios/a.yaml", text);
    return load_scenario(folder_.path() / "scenarios/a.yaml");
  }
  Scenario loaded(const std::string& text) const {
    auto loaded = load(text);
    EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
    return std::move(*loaded.value);
  }
  std::string why(const std::string& text) const {
    const auto loaded = load(text);
    return loaded.diagnostics.empty() ? "" : loaded.diagnostics.front().message;
  }

  TemporaryFolder folder_{"loop"};
};

std::vector<std::string> timeline(const Scenario& scenario) {
  std::vector<std::string> out;
  for (const Injection& injection : scenario.timeline) {
    const auto* const clear = std::get_if<intervention::Clear>(&injection.what);
    out.push_back(std::to_string(injection.at.time_since_epoch() / std::chrono::milliseconds(1)) + " " +
                  (clear != nullptr ? "clear " + std::to_string(clear->id) : describe(injection.what)) +
                  (injection.again ? " again" : ""));
  }
  return out;
}

TEST_F(Loop, FaultsAreNumberedAsTheyComeHoweverTheyAreWritten) {
  Scenario scenario = loaded(
      "duration: 500 ms\nloop: {from: 3, to: 4}\n"
      "timeline: [{at: 300 ms, clear: 1}, {at: 250 ms, late: d.a}, {at: 200 ms, late: d.b}]\n");
  ASSERT_TRUE(unroll(scenario));
  EXPECT_THAT(timeline(scenario), ElementsAre("300 clear 1", "250 d.a is late", "200 d.b is late",
                                              "400 d.b is late again", "450 d.a is late again", "500 clear 3 again"));
}

TEST_F(Loop, NumbersOfLaterRoundsAreThoseOfTheFirst) {
  const Scenario scenario = loaded("loop: {from: 4, to: 5, choices: {m: [3, 5]}, orders: [2, 2]}\n");
  ASSERT_TRUE(scenario.loop);
  std::vector<std::uint64_t> choices;
  for (std::uint64_t number = 1; number <= 10; ++number) choices.push_back(scenario.loop->choice("m", number));
  EXPECT_THAT(choices, ElementsAre(1, 2, 3, 4, 5, 3, 4, 5, 3, 4));
  EXPECT_EQ(scenario.loop->choice("other", 7), 7U);
  EXPECT_EQ(scenario.loop->order(1), 1U);
  EXPECT_EQ(scenario.loop->order(9), 2U);
}

// Ticks are at 0, 100, 200 ms …; what comes behind tick 2 belongs to ticks 3 and 4.
TEST_F(Loop, ItsTimelineComesAgainUntilTheRunEnds) {
  Scenario scenario = loaded(
      "duration: 800 ms\ndelays: [{message: x, by: 1 s}]\nloop: {from: 3, to: 4}\n"
      "timeline: [{at: 100 ms, late: d.a}, {at: 200 ms, clear: 2}, {at: 300 ms, late: d.a}]\n");
  const auto expected =
      ElementsAre("100 d.a is late", "200 clear 2", "300 d.a is late", "400 clear 3 again", "500 d.a is late again",
                  "600 clear 4 again", "700 d.a is late again", "800 clear 5 again");
  ASSERT_TRUE(unroll(scenario));
  EXPECT_THAT(timeline(scenario), expected);
  ASSERT_TRUE(unroll(scenario));
  EXPECT_THAT(timeline(scenario), expected);
  scenario.duration = std::chrono::milliseconds(450);
  ASSERT_TRUE(unroll(scenario));
  EXPECT_THAT(timeline(scenario),
              ElementsAre("100 d.a is late", "200 clear 2", "300 d.a is late", "400 clear 3 again"));
}

TEST_F(Loop, OfChoicesNullIsAValue) {
  const Scenario scenario = loaded("choices: [{model: m, number: 1, value: null}]\n");
  EXPECT_TRUE(scenario.choices->front().value.is_null());
  EXPECT_TRUE(loaded(scenario_text(scenario, {}, std::nullopt)).choices->front().value.is_null());
}

TEST_F(Loop, IsWrittenAsItWasRead) {
  const std::string text =
      "choices:\n  - {model: m, number: 3, value: 1, tick: 3, place: \"models/m.scxml:7\"}\n"
      "loop: {from: 3, to: 4, choices: {m: [2, 3]}, orders: [1, 2]}\nduration: 1 s\n";
  Scenario scenario = loaded("timeline: [{at: 300 ms, late: d.a}]\n" + text);
  ASSERT_TRUE(unroll(scenario));
  ASSERT_GT(scenario.timeline.size(), 1U);
  const std::string written = scenario_text(scenario, {}, std::nullopt);
  EXPECT_THAT(written, HasSubstr("loop: {from: 3, to: 4, choices: {m: [2, 3]}, orders: [1, 2]}\n"));
  const Scenario again = loaded(written);
  EXPECT_EQ(again.timeline.size(), 1U);
  EXPECT_EQ(again.loop->choices, scenario.loop->choices);
  EXPECT_EQ(again.loop->orders, scenario.loop->orders);
  EXPECT_EQ(again.choices->front().place, "models/m.scxml:7");
}

TEST_F(Loop, WrittenOutSaysTheSameOfEachRound) {
  Scenario scenario = loaded(
      "choices: [{model: m, number: 1, value: 1, tick: 1}, {model: m, number: 3, value: 2, tick: 4}]\n"
      "orders: [{number: 2, first: m, tick: 3}]\nloop: {from: 3, to: 4, choices: {m: [2, 3]}, orders: [1, 2]}\n"
      "timeline: [{at: 300 ms, late: d.a}]\nduration: 800 ms\n");
  const ScenarioLoop loop = *scenario.loop;
  const Scenario looped = scenario;
  write_out(scenario);
  EXPECT_FALSE(scenario.loop);
  EXPECT_THAT(timeline(scenario), ElementsAre("300 d.a is late", "500 d.a is late", "700 d.a is late"));
  // Three rounds and the beginning of a fourth.
  for (std::uint64_t number = 1; number <= 9; ++number) {
    const auto said = [](const std::vector<ScenarioChoice>& all, std::uint64_t of) {
      for (const ScenarioChoice& one : all) {
        if (one.number == of) return to_json(one.value);
      }
      return std::string();
    };
    EXPECT_EQ(said(*scenario.choices, number), said(*looped.choices, loop.choice("m", number))) << number;
  }
  std::vector<std::uint64_t> orders;
  for (const ScenarioOrder& order : scenario.orders) orders.push_back(order.number);
  EXPECT_THAT(orders, ElementsAre(2, 4, 6, 8));
}

TEST_F(Loop, BoundsAndSlipsAreNamed) {
  EXPECT_THAT(why("loop: {from: 4, to: 3}\n"), HasSubstr("its first and its last tick, from 1"));
  EXPECT_THAT(why("loop: {from: 1, to: 3, choices: {n: [1, 2]}}\n"), HasSubstr("no model \"n\""));
  EXPECT_THAT(why("loop: {from: 1, to: 3, choices: {m: [2, 1]}}\n"), HasSubstr("[FIRST, LAST]"));
  EXPECT_THAT(why("loop: {from: 1, to: 3, orders: 7}\n"), HasSubstr("[FIRST, LAST]"));
  EXPECT_THAT(why("loop: {from: 1, to: 3}\ntimeline: [{at: 300 ms, late: d.a}]\n"), HasSubstr("so never comes"));
  EXPECT_THAT(why("loop: {from: 1, to: 3, times: 3}\n"), HasSubstr("times"));
  Scenario scenario = loaded("duration: 1000 min\nloop: {from: 1, to: 1}\ntimeline: [{at: 0 s, late: d.a}]\n");
  const auto unrolled = unroll(scenario);
  ASSERT_FALSE(unrolled);
  EXPECT_THAT(unrolled.error().message, HasSubstr("more than 100000 entries"));
}

}  // namespace
}  // namespace sentree::project
