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
            "services:\n  battery: {at: sim}\n  arm: {at: sim}\n");
}

TEST(YamlEdit, MakesASectionThatIsMissingOrEmpty) {
  EXPECT_EQ(added("a: 1\n", "monitors", "- b"), "a: 1\n\nmonitors:\n  - b\n");
  EXPECT_EQ(added("monitors: []  # none yet\nworld: w\n", "monitors", "- b"),
            "monitors: # none yet\n  - b\nworld: w\n");
  EXPECT_EQ(added("monitors:\n", "monitors", "- b"), "monitors:\n  - b\n");
  EXPECT_EQ(added("", "monitors", "- b"), "\nmonitors:\n  - b\n");
}

TEST(YamlEdit, RefusesWhatItCannotAddTo) {
  const auto flow = with_entry("monitors: [a, b]\n", "monitors", "- c", "p.yaml");
  ASSERT_FALSE(flow);
  EXPECT_EQ(flow.error().code, "yaml.flow");
  EXPECT_EQ(flow.error().span.line, 1);
  EXPECT_FALSE(with_entry("a: [", "monitors", "- c"));
}

}  // namespace
}  // namespace sentree::text
