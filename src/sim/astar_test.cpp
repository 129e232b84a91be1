#include "sentree/sim/astar.h"

#include <gtest/gtest.h>

#include <array>

#include "sentree/sim/detail/path.h"
#include "sentree/sim/detail/test_support.h"

#if __has_include(<boost/graph/dijkstra_shortest_paths.hpp>)
#define SENTREE_HAS_BOOST_GRAPH 1
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#pragma GCC diagnostic pop
#endif

namespace sentree::sim {
namespace {

constexpr std::uint64_t kNoLimit = 1'000'000'000;

CostGrid grid_of(const GridMap& map) { return {map, DistanceField(map), {.blocked_m = 0.05, .inflated_m = 0.3}}; }

std::uint32_t cost_of(const CostGrid& grid, const std::vector<Cell>& cells) {
  std::uint32_t cost = 0;
  for (std::size_t i = 1; i < cells.size(); ++i) {
    const bool diagonal = cells[i].x != cells[i - 1].x && cells[i].y != cells[i - 1].y;
    cost += (diagonal ? kDiagonalStep : kStraightStep) * grid.at(cells[i]);
  }
  return cost;
}

TEST(FindPath, CostsWhatBoostGraphSays) {
#ifndef SENTREE_HAS_BOOST_GRAPH
  GTEST_SKIP() << "Boost.Graph is not installed (libboost-dev)";
#else
  using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, boost::no_property,
                                      boost::property<boost::edge_weight_t, std::uint32_t> >;
  constexpr std::uint64_t kSeed = 31;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  int found = 0;
  int queries = 0;
  constexpr int kSide = 60;
  for (int round = 0; round < 20; ++round) {
    const GridMap map = test::random_map(rng, kSide, kSide, 20 + static_cast<int>(rng.below(50)), false);
    const CostGrid grid = grid_of(map);
    Graph graph(kSide * kSide);
    constexpr std::array<Cell, 8> kSteps{Cell{1, 0},  Cell{1, 1},   Cell{0, 1},  Cell{-1, 1},
                                         Cell{-1, 0}, Cell{-1, -1}, Cell{0, -1}, Cell{1, -1}};
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        for (const Cell step : kSteps) {
          const Cell to{x + step.x, y + step.y};
          if (grid.at(to) == CostGrid::kBlocked) continue;
          const bool diagonal = step.x != 0 && step.y != 0;
          if (diagonal && (grid.at({to.x, y}) == CostGrid::kBlocked || grid.at({x, to.y}) == CostGrid::kBlocked))
            continue;
          boost::add_edge(static_cast<std::size_t>(y * kSide + x), static_cast<std::size_t>(to.y * kSide + to.x),
                          (diagonal ? kDiagonalStep : kStraightStep) * grid.at(to), graph);
        }
      }
    }
    for (int from = 0; from < 5; ++from) {
      const auto cell = [&] { return Cell{static_cast<int>(rng.below(kSide)), static_cast<int>(rng.below(kSide))}; };
      const Cell start = cell();
      std::vector<std::uint32_t> distances(kSide * kSide);
      boost::dijkstra_shortest_paths(graph, static_cast<std::size_t>(start.y * kSide + start.x),
                                     boost::distance_map(distances.data()));
      for (int to = 0; to < 10; ++to, ++queries) {
        const Cell goal = cell();
        const Plan plan = find_path(grid, start, goal, kNoLimit);
        const std::uint32_t want = distances[static_cast<std::size_t>(goal.y * kSide + goal.x)];
        const bool reachable = want != std::numeric_limits<std::uint32_t>::max() && grid.at(goal) != CostGrid::kBlocked;
        ASSERT_EQ(plan.outcome, reachable ? Plan::Outcome::kFound : Plan::Outcome::kNoPath);
        if (!reachable) continue;
        ++found;
        EXPECT_EQ(plan.cost, want);
        EXPECT_EQ(cost_of(grid, plan.cells), plan.cost);
        EXPECT_EQ(plan.cells.front(), start);
        EXPECT_EQ(plan.cells.back(), goal);
      }
    }
  }
  EXPECT_EQ(queries, 1000);
  EXPECT_GT(found, 300);
#endif
}

TEST(FindPath, DoesNotCutCorners) {
  std::vector<std::int8_t> cells(9, 0);
  cells[1 * 3 + 1] = 100;
  const GridMap map(3, 3, 1.0, {}, cells);
  const CostGrid grid(map, DistanceField(map), {.blocked_m = 0.0, .inflated_m = 0.0});
  const Plan plan = find_path(grid, {0, 0}, {2, 2}, kNoLimit);
  ASSERT_EQ(plan.outcome, Plan::Outcome::kFound);
  EXPECT_EQ(plan.cells.size(), 5U);
  EXPECT_EQ(plan.cost, 4 * kStraightStep * CostGrid::kFree);
}

TEST(FindPath, GivesUpAtItsLimitAndNotOneCellEarlier) {
  const GridMap map(100, 100, 0.05, {}, std::vector<std::int8_t>(10'000, 0));
  const CostGrid grid = grid_of(map);
  const Plan whole = find_path(grid, {0, 0}, {99, 42}, kNoLimit);
  ASSERT_EQ(whole.outcome, Plan::Outcome::kFound);
  EXPECT_EQ(find_path(grid, {0, 0}, {99, 42}, whole.expansions).outcome, Plan::Outcome::kFound);
  const Plan cut = find_path(grid, {0, 0}, {99, 42}, whole.expansions - 1);
  EXPECT_EQ(cut.outcome, Plan::Outcome::kLimit);
  EXPECT_EQ(cut.expansions, whole.expansions - 1);
  EXPECT_TRUE(cut.cells.empty());
}

TEST(FindPath, RefusesCellsOutsideAndBlockedGoals) {
  const GridMap map(10, 10, 0.05, {}, std::vector<std::int8_t>(100, 0));
  CostGrid grid = grid_of(map);
  EXPECT_EQ(find_path(grid, {-1, 0}, {5, 5}, kNoLimit).outcome, Plan::Outcome::kNoPath);
  EXPECT_EQ(find_path(grid, {0, 0}, {5, 10}, kNoLimit).outcome, Plan::Outcome::kNoPath);
  grid.set({5, 5}, CostGrid::kBlocked);
  EXPECT_EQ(find_path(grid, {0, 0}, {5, 5}, kNoLimit).outcome, Plan::Outcome::kNoPath);
  EXPECT_EQ(find_path(grid, {5, 5}, {0, 0}, kNoLimit).outcome, Plan::Outcome::kFound) << "a blocked start can be left";
}

TEST(CostGrid, AddedObstaclesInflateAsWallsDo) {
  Rng rng(8);
  const GridMap map = test::random_map(rng, 50, 40, 12, false);
  const InflationSpec spec{.blocked_m = 0.12, .inflated_m = 0.4};
  const CostGrid all(map, DistanceField(map), spec);
  const GridMap open(50, 40, 0.05, {}, std::vector<std::int8_t>(2000, 0));
  CostGrid grown(open, DistanceField(open), spec);
  std::vector<Cell> obstacles;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) {
      if (map.is_occupied({x, y})) obstacles.push_back({x, y});
    }
  }
  grown.add_obstacles(obstacles);
  EXPECT_EQ(all.weights(), grown.weights());
}

TEST(Straightened, NeverEntersBlockedCellsAndKeepsItsEnds) {
  Rng rng(77);
  for (int round = 0; round < 200; ++round) {
    const GridMap map = test::random_map(rng, 60, 60, 30, true, {-1.0, 2.0, 0.3});
    const CostGrid grid = grid_of(map);
    const auto cell = [&] { return Cell{static_cast<int>(rng.below(60)), static_cast<int>(rng.below(60))}; };
    const Cell start = cell();
    const Cell goal = cell();
    if (grid.at(start) == CostGrid::kBlocked) continue;
    const Plan plan = find_path(grid, start, goal, kNoLimit);
    if (plan.outcome != Plan::Outcome::kFound) continue;
    const Vec2 from = map.from_grid({start.x + rng.uniform(), start.y + rng.uniform()});
    const Vec2 to = map.from_grid({goal.x + rng.uniform(), goal.y + rng.uniform()});
    const std::vector<Vec2> points = straightened(grid, map, plan.cells, from, to);
    ASSERT_GE(points.size(), 2U);
    EXPECT_EQ(points.front(), from);
    EXPECT_EQ(points.back(), to);
    // Steps of one cell were found by the search; longer ones were checked along the line.
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Cell a = map.cell_at(points[i - 1]);
      const Cell b = map.cell_at(points[i]);
      if (std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) <= 1) continue;
      EXPECT_GE(segment_cost(grid, map, points[i - 1], points[i]), 0.0);
    }
  }
}

}  // namespace
}  // namespace sentree::sim
