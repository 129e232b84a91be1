#include "sentree/sim/plan_memo.h"

#include <gtest/gtest.h>

#include <vector>

#include "sentree/base/rng.h"
#include "sentree/sim/remember.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

World planned_house() {
  Loaded<World> loaded = load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  return loaded.ok() ? *std::move(loaded.value) : World{};
}

// Whatever happens, a robot whose paths are remembered drives as one whose are not.
TEST(PlanMemo, ChangesNothing) {
  World world = planned_house();
  ASSERT_FALSE(world.robots.empty());
  constexpr std::uint64_t kSeed = 12;
  Rng rng(kSeed);
  PlanMemo memo;
  for (int run = 0; run < 3; ++run) {
    State plain = initial_state(world, kSeed);
    State remembered = plain;
    TimePoint now{};
    for (int i = 0; i < 150; ++i) {
      now += std::chrono::milliseconds(400);
      const auto both = [&](auto&& change) {
        change(plain);
        const Remember<PlanMemo> remembers(memo);
        change(remembered);
      };
      switch (rng.below(20)) {
        case 0:
        case 1:
          both([&](State& state) {
            (void)call(world, state,
                       {.service = "Navigation",
                        .method = "gotoTargetByLocationName",
                        .args = Map{{"name", i % 2 == 0 ? "kitchen" : "station"}}},
                       now);
          });
          break;
        case 2: both([](State& state) { state.doors[0].open = !state.doors[0].open; }); break;
        case 3: {
          const Vec2 at{rng.uniform(1.0, 15.0), rng.uniform(1.0, 9.0)};
          both([&](State& state) {
            state.obstacles.assign(1, Obstacle());
            state.obstacles[0].shape = Shape::disc(at, 0.3);
          });
          break;
        }
        default: break;  // it drives
      }
      both([&](State& state) { advance(world, state, now); });
      ASSERT_EQ(plain, remembered) << "seed " << kSeed << ", run " << run << ", step " << i;
    }
  }
  EXPECT_GT(memo.searches(), 0U);
}

TEST(PlanMemo, SearchesAgainOnlyWhatIsNew) {
  const World world = planned_house();
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
  const World world = planned_house();
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
