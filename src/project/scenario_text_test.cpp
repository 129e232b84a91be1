#include "sentree/project/scenario_text.h"

#include <gtest/gtest.h>

namespace sentree::project {
namespace {

Injection killed(std::string part, std::int64_t at_s) {
  Injection one;
  one.at = TimePoint{std::chrono::seconds(at_s)};
  one.what = intervention::Kill{std::move(part)};
  one.source = "studio";
  return one;
}

TEST(WithInjections, PutsEachAtItsTimeAndLeavesAllElse) {
  const std::string before =
      "# ours\nseed: 7\ntimeline:\n  - {at: 10 s, kill: A}   # first\n  - {at: 30 s, kill: B}\nduration: 1 min\n";
  const std::vector<Injection> there{killed("A", 10), killed("B", 30)};
  const std::vector<Injection> done{killed("C", 20), killed("D", 40), killed("B", 30)};
  const auto with = with_injections(before, there, done);
  ASSERT_TRUE(with) << with.error().message;
  EXPECT_EQ(*with,
            "# ours\nseed: 7\ntimeline:\n  - {at: 10 s, kill: A}   # first\n  - {at: 20 s, kill: C}\n"
            "  - {at: 30 s, kill: B}\n  - {at: 40 s, kill: D}\nduration: 1 min\n");
}

TEST(WithInjections, MakesATimelineWhereThereIsNone) {
  const auto with = with_injections("seed: 7\n", {}, {killed("C", 20)});
  ASSERT_TRUE(with) << with.error().message;
  EXPECT_NE(with->find("kill: C"), std::string::npos);
  EXPECT_TRUE(with->starts_with("seed: 7\n"));
}

}  // namespace
}  // namespace sentree::project
