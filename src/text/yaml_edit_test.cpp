#include "sentree/text/yaml_edit.h"

#include <gtest/gtest.h>

#include "sentree/text/yaml.h"

namespace sentree::text {
namespace {

std::string added(std::string_view source, std::string_view section, std::string_view entry) {
  const auto result = with_entry(source, section, entry);
  EXPECT_TRUE(result) << to_string(result.error());
  if (!result) return {};
  EXPECT_TRUE(parse_yaml(*result)) << *result;
  return *result;
}

TEST(YamlEdit, AddsAtTheEndOfASection) {
  EXPECT_EQ(added("# top\nmonitors:\n    - a   # one\n\n# next\nworld: w\n", "monitors", "- b"),
            "# top\nmonitors:\n    - a   # one\n    - b\n\n# next\nworld: w\n");
  EXPECT_EQ(added("monitors:\n- a\n- {x: 1,\n   y: 2}\n", "monitors", "- b"),
            "monitors:\n- a\n- {x: 1,\n   y: 2}\n- b\n");
  EXPECT_EQ(added("services:\n  battery: {at: sim}", "services", "arm: {at: sim}"),
            "services:\n  battery: {at: sim}\n  arm: {at: sim}");
}

TEST(YamlEdit, MakesASectionThatIsMissingOrEmpty) {
  EXPECT_EQ(added("a: 1\n", "monitors", "- b"), "a: 1\n\nmonitors:\n  - b\n");
  EXPECT_EQ(added("monitors: []  # none yet\nworld: w\n", "monitors", "- b"),
            "monitors: # none yet\n  - b\nworld: w\n");
  EXPECT_EQ(added("monitors:\n", "monitors", "- b"), "monitors:\n  - b\n");
  EXPECT_EQ(added("", "monitors", "- b"), "\nmonitors:\n  - b\n");
}

TEST(YamlEdit, AnEntryEndsAsTheLinesThatAreThere) {
  EXPECT_EQ(added("world: w\r\nmonitors:\r\n  - a", "monitors", "- b"), "world: w\r\nmonitors:\r\n  - a\r\n  - b");
  EXPECT_EQ(added("world: w\r\n", "monitors", "- b"), "world: w\r\n\r\nmonitors:\r\n  - b\r\n");
  EXPECT_EQ(added("monitors:\n  - a", "monitors", "- b"), "monitors:\n  - a\n  - b");
}

TEST(YamlEdit, RefusesWhatItCannotAddTo) {
  const auto flow = with_entry("monitors: [a, b]\n", "monitors", "- c", "p.yaml");
  ASSERT_FALSE(flow);
  EXPECT_EQ(flow.error().code, "yaml.flow");
  EXPECT_EQ(flow.error().span.line, 1);
  EXPECT_FALSE(with_entry("a: [", "monitors", "- c"));
}

constexpr std::string_view kScenario = R"(# what goes wrong
duration: 2 min   # at most
timeline:
  # the battery
  - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}   # by hand
  - at: 30 s
    kill: robot
expect: {mission: RUNNING, monitors: {battery: violated}}
)";

std::string text_of(const Result<std::string>& result) {
  EXPECT_TRUE(result) << to_string(result.error());
  return result ? *result : std::string();
}

// The document with `from`, which stands there once, replaced.
std::string scenario_with(std::string_view from, std::string_view to) {
  std::string text(kScenario);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(YamlEdit, SetsAValueAndLeavesTheRest) {
  EXPECT_EQ(text_of(with_value(kScenario, {"duration"}, "3 min")), scenario_with("2 min", "3 min"));
  EXPECT_EQ(text_of(with_value(kScenario, {"timeline", 0U, "at"}, "21.5 s")), scenario_with("20 s", "21.5 s"));
  EXPECT_EQ(text_of(with_value(kScenario, {"timeline", 0U, "args", "percent"}, 12.5)), scenario_with("10", "12.5"));
  EXPECT_EQ(text_of(with_value(kScenario, {"timeline", 1U, "kill"}, "navigation")),
            scenario_with("robot", "navigation"));
  EXPECT_EQ(text_of(with_value(kScenario, {"expect", "mission"}, "SUCCESS")), scenario_with("RUNNING", "SUCCESS"));
  EXPECT_EQ(text_of(with_value(kScenario, {"timeline", 0U, "args"}, Map{{"percent", 5}, {"why", "a, b"}})),
            scenario_with("{percent: 10}", "{percent: 5, why: \"a, b\"}"));
}

TEST(YamlEdit, KeepsTheQuotesOfAText) {
  EXPECT_EQ(text_of(with_value("at: \"unix:a\"  # here\n", {"at"}, "sim")), "at: \"sim\"  # here\n");
  EXPECT_EQ(text_of(with_value("at: 'it''s'\n", {"at"}, "sim")), "at: 'sim'\n");
  EXPECT_EQ(text_of(with_value("at: sim\n", {"at"}, "tcp://h:1")), "at: \"tcp://h:1\"\n");
  EXPECT_EQ(text_of(with_value("at: sim\n", {"at"}, "true")), "at: \"true\"\n");
}

TEST(YamlEdit, MakesWhatIsMissing) {
  EXPECT_EQ(text_of(with_value(kScenario, {"seed"}, 7)), std::string(kScenario) + "seed: 7\n");
  EXPECT_EQ(text_of(with_value(kScenario, {"expect", "monitors", "recharge"}, "undecided")),
            scenario_with("battery: violated", "battery: violated, recharge: undecided"));
  EXPECT_EQ(text_of(with_value(kScenario, {"timeline", 1U, "source"}, "studio")),
            scenario_with("kill: robot", "kill: robot\n    source: studio"));
  EXPECT_EQ(text_of(with_value("a: 1\n", {"expect", "monitors", "m"}, "violated")),
            "a: 1\n\nexpect:\n  monitors: {m: violated}\n");
  EXPECT_EQ(text_of(with_value("a: 1", {"b"}, 2)), "a: 1\nb: 2");
  EXPECT_EQ(text_of(with_value("a:\n  b:\nc: 1\n", {"a", "b", "d"}, 2)), "a:\n  b: {d: 2}\nc: 1\n");
  EXPECT_EQ(text_of(with_value("a: {}\n", {"a", "b"}, 2)), "a: {b: 2}\n");
  EXPECT_EQ(text_of(with_value("a:\n", {"a"}, 2)), "a: 2\n");
}

TEST(YamlEdit, PutsItemsWhereTheyBelong) {
  const Map kill{{"at", "5 s"}, {"kill", "robot"}};
  EXPECT_EQ(text_of(with_item(kScenario, {"timeline"}, 0, kill)),
            scenario_with("  # the battery", "  - {at: 5 s, kill: robot}\n  # the battery"));
  EXPECT_EQ(text_of(with_item(kScenario, {"timeline"}, 1, kill)),
            scenario_with("# by hand\n", "# by hand\n  - {at: 5 s, kill: robot}\n"));
  EXPECT_EQ(text_of(with_item(kScenario, {"timeline"}, 9, kill)),
            scenario_with("    kill: robot\n", "    kill: robot\n  - {at: 5 s, kill: robot}\n"));
  EXPECT_EQ(text_of(with_item("a: [1, 3]\n", {"a"}, 1, 2)), "a: [1, 2, 3]\n");
  EXPECT_EQ(text_of(with_item("a: [1, 3 ]\n", {"a"}, 2, 4)), "a: [1, 3, 4 ]\n");
  EXPECT_EQ(text_of(with_item("b: 1\n", {"timeline"}, 0, kill)), "b: 1\n\ntimeline:\n  - {at: 5 s, kill: robot}\n");
}

TEST(YamlEdit, TakesThingsAway) {
  EXPECT_EQ(text_of(without(kScenario, {"timeline", 0U})),
            scenario_with("  - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}   # by hand\n", ""));
  EXPECT_EQ(text_of(without(kScenario, {"timeline", 1U})), scenario_with("  - at: 30 s\n    kill: robot\n", ""));
  EXPECT_EQ(text_of(without(kScenario, {"timeline", 1U, "at"})), scenario_with("at: 30 s\n    kill", "kill"));
  EXPECT_EQ(text_of(without(kScenario, {"timeline", 0U, "args"})), scenario_with(", args: {percent: 10}", ""));
  EXPECT_EQ(text_of(without(kScenario, {"timeline", 0U, "at"})), scenario_with("at: 20 s, ", ""));
  EXPECT_EQ(text_of(without(kScenario, {"expect", "monitors", "battery"})), scenario_with("battery: violated", ""));
  EXPECT_EQ(text_of(without(kScenario, {"duration"})), scenario_with("duration: 2 min   # at most\n", ""));
  // What would be empty goes too.
  EXPECT_EQ(text_of(without("a: 1\ntimeline:\n  - {at: 5 s}\nb: 2\n", {"timeline", 0U})), "a: 1\nb: 2\n");
}

TEST(YamlEdit, KeepsLineEndsAndTheMarkOfByteOrder) {
  EXPECT_EQ(text_of(with_value("\xEF\xBB\xBF"
                               "a: 1\r\nb: 2\r\n",
                               {"a"}, 3)),
            "\xEF\xBB\xBF"
            "a: 3\r\nb: 2\r\n");
  EXPECT_EQ(text_of(without("a: 1\r\nb: 2\r\nc: 3\r\n", {"b"})), "a: 1\r\nc: 3\r\n");
}

TEST(YamlEdit, ChangesTextsOverSeveralLinesAndWhatHasAnAnchor) {
  EXPECT_EQ(text_of(with_value("a: >\n  one\n\n  two\n# next\nb: 1\n", {"a"}, "three")), "a: three\n# next\nb: 1\n");
  EXPECT_EQ(text_of(with_value("b:\n  a: |\n    one\n  c: 1\n", {"b", "a"}, "x: y")), "b:\n  a: \"x: y\"\n  c: 1\n");
  EXPECT_EQ(text_of(with_value("s:\n  b: &b {at: sim, x: 1}\n  c: !t\n    at: sim\n", {"s", "b", "at"}, "model")),
            "s:\n  b: &b {at: model, x: 1}\n  c: !t\n    at: sim\n");
  EXPECT_EQ(text_of(with_value("s:\n  b: &b {at: sim}\n", {"s", "b", "x"}, 1)), "s:\n  b: &b {at: sim, x: 1}\n");
  EXPECT_EQ(text_of(with_item("l: &l\n  - 1\n  - 2\n", {"l"}, 2, 3)), "l: &l\n  - 1\n  - 2\n  - 3\n");
}

TEST(YamlEdit, ChangesNothingWhereItCannotTellThePlace) {
  const auto code = [](const Result<std::string>& result) {
    return result ? "changed: " + *result : result.error().code;
  };
  EXPECT_EQ(code(with_value("a: &x 1\nb: *x\n", {"b"}, 2)), "yaml.not-editable");
  EXPECT_EQ(code(with_value("a: one\n  two\n", {"a"}, 2)), "yaml.not-editable");
  EXPECT_EQ(code(with_value("a: 1\n", {"a", "b"}, 2)), "yaml.no-such-place");
  EXPECT_EQ(code(with_value("a: [1]\n", {"a", 3U}, 2)), "yaml.no-such-place");
  EXPECT_EQ(code(with_item("a: 1\n", {"a"}, 0, 2)), "yaml.no-such-place");
  EXPECT_EQ(code(without("a: 1\n", {"b"})), "yaml.no-such-place");
  EXPECT_EQ(code(with_value("a: [\n", {"a"}, 2)), "yaml.syntax");
}

}  // namespace
}  // namespace sentree::text
