#include "sentree/sim/plan_memo.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "sentree/sim/detail/test_memo_support.h"

namespace sentree::sim {
namespace {

// Paths of one run are of use to the next.
TEST(PlanMemo, ChangesNothing) {
  const World world = test::house();
  ASSERT_FALSE(world.robots.empty());
  PlanMemo memo;
  for (const std::uint64_t seed : {12, 13, 14})
    EXPECT_EQ(test::difference(world, {.seed = seed, .steps = 150, .step = std::chrono::milliseconds(400), .quiet = 10},
                               memo),
              "");
  EXPECT_GT(memo.searches(), 0U);
}

TEST(PlanMemo, SearchesAgainOnlyWhatIsNew) {
  const World world = test::house();
  ASSERT_FALSE(world.robots.empty());
  const RobotSpec& robot = world.robots[0];
  const Cell from = world.map.cell_at(world.locations.at(0).pose.position());
  const Cell to = world.map.cell_at(world.locations.at(1).pose.position());
  constexpr std::uint64_t kMax = 1'000'000;
  CostGrid other = robot.costs;
  const Plan expected = find_path(robot.costs, from, to, kMax);
  ASSERT_EQ(expected.outcome, Plan::Outcome::kFound);
  other.set(expected.cells[expected.cells.size() / 2], CostGrid::kBlocked);

  PlanMemo memo;
  const auto searched = [&](const CostGrid& grid, Cell start, Cell goal, std::uint64_t expansions_max) {
    const std::uint64_t before = memo.searches();
    const Plan& plan = memo.path(grid, start, goal, expansions_max);
    EXPECT_EQ(plan.cells, find_path(grid, start, goal, expansions_max).cells);
    return memo.searches() - before;
  };
  EXPECT_EQ(searched(robot.costs, from, to, kMax), 1U);
  EXPECT_EQ(searched(CostGrid(robot.costs), from, to, kMax), 0U) << "the same costs, elsewhere";
  EXPECT_EQ(searched(robot.costs, to, from, kMax), 1U);
  EXPECT_EQ(searched(robot.costs, from, to, 3), 1U) << "an earlier end";
  EXPECT_EQ(searched(other, from, to, kMax), 1U) << "other costs";
  EXPECT_EQ(searched(robot.costs, from, to, kMax), 1U) << "of one grid at a time";
  EXPECT_EQ(searched(robot.costs, {-1, 3}, to, kMax), 0U);
}

TEST(PlanMemo, IsBounded) {
  const World world = test::house();
  ASSERT_FALSE(world.robots.empty());
  const CostGrid& costs = world.robots[0].costs;
  const Cell blocked{0, 0};  // no search: the memo alone is what is filled
  ASSERT_EQ(costs.at(blocked), CostGrid::kBlocked);
  PlanMemo memo;
  for (std::uint64_t i = 0; i < 2000; ++i) (void)memo.path(costs, {1, 1}, blocked, i);
  EXPECT_EQ(memo.searches(), 2000U);
  (void)memo.path(costs, {1, 1}, blocked, 1999);
  EXPECT_EQ(memo.searches(), 2000U) << "the last is there";
  (void)memo.path(costs, {1, 1}, blocked, 0);
  EXPECT_EQ(memo.searches(), 2001U) << "the first has gone";
}

}  // namespace
}  // namespace sentree::sim
