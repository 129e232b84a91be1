#include "sentree/sim/distance_field.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sentree/sim/detail/clearance.h"
#include "sentree/sim/detail/test_support.h"

namespace sentree::sim {
namespace {

TEST(DistanceField, IsExactOnRandomMaps) {
  Rng rng(21);
  for (int round = 0; round < 40; ++round) {
    const GridMap map = test::random_map(rng, 1 + static_cast<int>(rng.below(60)), 1 + static_cast<int>(rng.below(60)),
                                         static_cast<int>(rng.below(12)), false);
    const DistanceField field(map);
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        int best = DistanceField::kCellsMax * DistanceField::kCellsMax;
        for (int v = 0; v < map.height(); ++v) {
          for (int u = 0; u < map.width(); ++u) {
            if (map.is_occupied({u, v})) best = std::min(best, (u - x) * (u - x) + (v - y) * (v - y));
          }
        }
        ASSERT_EQ(field.squared_cells({x, y}), best) << x << ' ' << y << " round " << round;
      }
    }
  }
}

TEST(DistanceField, IsCappedFarFromWalls) {
  std::vector<std::int8_t> cells(600 * 2, 0);
  cells[0] = 100;
  const DistanceField field(GridMap(600, 2, 1.0, {}, cells));
  EXPECT_EQ(field.squared_cells({254, 0}), 254 * 254);
  EXPECT_EQ(field.squared_cells({255, 0}), 255 * 255);
  EXPECT_EQ(field.squared_cells({599, 1}), 255 * 255);
}

TEST(Clearance, MeasuresToTheSquaresOfOccupiedCells) {
  Rng rng(22);
  const GridMap map = test::random_map(rng, 60, 60, 10, true, {1.0, -2.0, 0.4});
  const DistanceField field(map);
  for (int i = 0; i < 3000; ++i) {
    const Vec2 grid{rng.uniform(0, 60), rng.uniform(0, 60)};
    double best = 1e9;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        if (!map.is_occupied({x, y})) continue;
        const double dx = std::max({0.0, x - grid.x, grid.x - x - 1});
        const double dy = std::max({0.0, y - grid.y, grid.y - y - 1});
        best = std::min(best, std::hypot(dx, dy) * 0.05);
      }
    }
    const double enough = rng.uniform(0.05, 0.6);
    EXPECT_NEAR(clearance(map, field, map.from_grid(grid), enough), std::min(best, enough), 1e-9);
  }
}

TEST(Clearance, IsExactlyEnoughWhereThereIsEnough) {
  // Where the look-up decides and where the cells do, so that one never seems less than the other.
  std::vector<std::int8_t> cells(100 * 100, 0);
  cells[50 * 100 + 50] = 100;
  const GridMap map(100, 100, 0.05, {}, cells);
  const DistanceField field(map);
  for (const double enough : {0.1, 0.2, 0.22, 0.3, 0.37}) {
    for (double x = 0.0; x < 2.4 - enough; x += 0.01) EXPECT_EQ(clearance(map, field, {x, 2.52}, enough), enough);
  }
}

TEST(GridMap, CropKeepsEveryPlaceWhereItWas) {
  std::vector<std::int8_t> cells(30 * 20, GridMap::kUnknown);
  cells[7 * 30 + 11] = 100;
  cells[12 * 30 + 25] = 0;
  const GridMap map(30, 20, 0.1, {4.0, -1.0, 0.8}, cells);
  const GridMap crop = cropped_to_known(map);
  EXPECT_EQ(crop.width(), 15);
  EXPECT_EQ(crop.height(), 6);
  EXPECT_TRUE(crop.is_occupied(crop.cell_at(map.centre({11, 7}))));
  EXPECT_TRUE(crop.is_free(crop.cell_at(map.centre({25, 12}))));
  const GridMap unknown(3, 3, 0.1, {}, std::vector<std::int8_t>(9, GridMap::kUnknown));
  EXPECT_EQ(cropped_to_known(unknown), unknown);
}

}  // namespace
}  // namespace sentree::sim
