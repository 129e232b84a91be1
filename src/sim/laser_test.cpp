#include "sentree/sim/laser.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "sentree/sim/detail/test_support.h"

namespace sentree::sim {
namespace {

// The nearest entry into the square of any occupied cell.
double brute_force(const GridMap& map, Vec2 from, Vec2 direction, double range_max) {
  double nearest = kInfinity;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (!map.is_occupied({x, y})) continue;
      double enter = 0.0;
      double leave = kInfinity;
      const auto slab = [&](double low, double p, double d) {
        if (d == 0.0) {
          if (p < low || p > low + 1.0) leave = -1.0;
          return;
        }
        const double a = (low - p) / d;
        const double b = (low + 1.0 - p) / d;
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
      };
      slab(x, from.x, direction.x);
      slab(y, from.y, direction.y);
      if (enter <= leave) nearest = std::min(nearest, enter);
    }
  }
  return nearest <= range_max ? nearest : kInfinity;
}

TEST(RayField, AgreesWithEveryCellTriedOnRandomMaps) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  int hits = 0;
  for (int round = 0; round < 60; ++round) {
    const GridMap map =
        test::random_map(rng, 20 + static_cast<int>(rng.below(60)), 20 + static_cast<int>(rng.below(60)),
                         static_cast<int>(rng.below(40)), rng.below(2) == 0);
    const RayField field(map);
    for (int ray = 0; ray < 200; ++ray) {
      const Vec2 from{rng.uniform(0.0, map.width()), rng.uniform(0.0, map.height())};
      const double angle = rng.uniform(-4.0, 4.0);
      const Vec2 direction{std::cos(angle), std::sin(angle)};
      const double range_max = rng.uniform(5.0, 100.0);
      const double got = field.cast(from, direction, range_max);
      const double want = brute_force(map, from, direction, range_max);
      hits += std::isfinite(want) ? 1 : 0;
      if (std::isinf(want)) {
        EXPECT_EQ(got, want);
      } else {
        EXPECT_NEAR(got, want, 1e-9);
      }
    }
  }
  EXPECT_GT(hits, 1000);
}

// Rays from corners, edges and centres of cells, through corners: what is merely touched may stop them or not, what is
// entered must, and nothing else may.
TEST(RayField, ThroughCornersIsStoppedByWhatItEntersAndNothingThatItDoesNotTouch) {
  constexpr std::uint64_t kSeed = 12;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  // The nearest wall, each larger on all sides by `grow`.
  const auto nearest = [](const GridMap& map, Vec2 from, Vec2 direction, double grow) {
    double found = kInfinity;
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        if (!map.is_occupied({x, y})) continue;
        const double side = 1.0 + 2.0 * grow;
        found = std::min(found, ray_distance(Shape::box({x + 0.5, y + 0.5, 0.0}, side, side), from, direction));
      }
    }
    return found;
  };
  const std::array<Vec2, 8> along{Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}, Vec2{2, 1},
                                  Vec2{1, 3}, Vec2{3, 4}, Vec2{5, 2}, Vec2{7, 7}};
  int hits = 0;
  for (int round = 0; round < 40; ++round) {
    const GridMap map = test::random_map(rng, 40, 30, 20, round % 2 == 0, {}, 1.0);
    const RayField field(map);
    for (int ray = 0; ray < 200; ++ray) {
      const Vec2 from{static_cast<double>(2 + rng.below(72)) / 2, static_cast<double>(2 + rng.below(52)) / 2};
      Vec2 direction = along[rng.below(along.size())];
      direction = (1.0 / norm(direction)) * direction;
      if (rng.below(2) == 0) direction.x = -direction.x;
      if (rng.below(2) == 0) direction.y = -direction.y;
      const double got = field.cast(from, direction, 1000.0);
      EXPECT_GE(got, nearest(map, from, direction, 1e-9) - 1e-6) << from.x << ' ' << from.y;
      EXPECT_LE(got, nearest(map, from, direction, -1e-9) + 1e-6) << from.x << ' ' << from.y;
      hits += std::isfinite(got) ? 1 : 0;
    }
  }
  EXPECT_GT(hits, 1000);
}

TEST(RayField, DoesNotSlipBetweenWallsThatTouchAtACorner) {
  for (const bool rising : {true, false}) {
    std::vector<std::int8_t> cells(64, 0);
    for (int i = 0; i < 8; ++i) cells[static_cast<std::size_t>((rising ? i : 7 - i) * 8 + i)] = 100;
    const RayField field(GridMap(8, 8, 1.0, {}, cells));
    // Across the diagonal of walls, through each of its inner corners, from both sides.
    for (int corner = 2; corner <= 6; ++corner) {
      for (const double side : {1.0, -1.0}) {
        const Vec2 through{static_cast<double>(corner), rising ? corner : 8.0 - corner};
        const Vec2 away{side * std::sqrt(0.5), (rising ? -side : side) * std::sqrt(0.5)};
        const double got = field.cast(through + std::sqrt(2.0) * away, -1.0 * away, 100.0);
        EXPECT_NEAR(got, std::sqrt(2.0), 1e-9) << corner << ' ' << side;
      }
    }
  }
}

TEST(RayField, ManyRaysAreWhatOneByOneIs) {
  constexpr std::uint64_t kSeed = 13;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  const GridMap map = test::random_map(rng, 300, 280, 40, false);
  const RayField field(map);
  for (const std::size_t count : {0U, 1U, 3U, 4U, 101U}) {
    const Vec2 from{rng.uniform(0.0, 300.0), rng.uniform(0.0, 280.0)};
    std::vector<Vec2> directions(count);
    for (Vec2& d : directions) {
      const double angle = rng.uniform(-4.0, 4.0);
      d = {std::cos(angle), std::sin(angle)};
    }
    std::vector<double> ranges(count);
    field.cast(from, directions, 200.0, ranges);
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(ranges[i], field.cast(from, directions[i], 200.0));
  }
}

TEST(RayField, SquaresAreBoundedAndRaysCrossThemAll) {
  const GridMap hall(2000, 3, 1.0, {}, std::vector<std::int8_t>(6000, 0));
  std::vector<std::int8_t> cells(2000 * 600, 0);
  cells[300 * 2000 + 1990] = 100;
  const RayField field(GridMap(2000, 600, 1.0, {}, cells));
  EXPECT_EQ(field.cast({0.5, 300.5}, {1.0, 0.0}, 1e6), 1989.5) << "further than one octet counts";
  EXPECT_EQ(RayField(hall).cast({0.5, 1.5}, {1.0, 0.0}, 1e6), kInfinity);
}

TEST(RayField, AlongTheAxesStopsAtTheBoundaryOfTheCell) {
  std::vector<std::int8_t> cells(100, 0);
  cells[5 * 10 + 8] = 100;
  const RayField field(GridMap(10, 10, 1.0, {}, cells));
  EXPECT_EQ(field.cast({2.25, 5.5}, {1.0, 0.0}, 100.0), 5.75);
  EXPECT_EQ(field.cast({8.5, 9.5}, {0.0, -1.0}, 100.0), 3.5);
  EXPECT_EQ(field.cast({2.25, 5.5}, {-1.0, 0.0}, 100.0), kInfinity) << "nothing there but the end of the map";
  EXPECT_EQ(field.cast({2.25, 5.5}, {1.0, 0.0}, 5.7), kInfinity) << "beyond the range";
  EXPECT_EQ(field.cast({8.5, 5.5}, {1.0, 0.0}, 100.0), 0.0) << "from inside a wall";
  EXPECT_EQ(field.cast({-1.0, 5.5}, {1.0, 0.0}, 100.0), kInfinity) << "from outside the map";
}

TEST(RayField, UnknownCellsLetRaysPass) {
  std::vector<std::int8_t> cells(10, GridMap::kUnknown);
  cells[9] = 100;
  EXPECT_EQ(RayField(GridMap(10, 1, 1.0, {}, cells)).cast({0.5, 0.5}, {1.0, 0.0}, 100.0), 8.5);
}

TEST(Scan, IsTheSameOnATurnedMap) {
  Rng rng(3);
  const GridMap plain = test::random_map(rng, 80, 60, 25, true);
  const Pose2 origin{-3.0, 7.0, 0.7};
  const GridMap turned(80, 60, 0.05, origin, plain.cells());
  const LaserSpec spec{.beams = 90, .range_max_m = 20.0};
  const Pose2 pose{2.0, 1.5, 0.3};
  LaserSpec quarter = spec;
  quarter.angle_increment_rad = 2.0 * std::numbers::pi / 90;
  std::vector<double> a;
  std::vector<double> b;
  cast_scan(plain, RayField(plain), {}, pose, quarter, a);
  cast_scan(turned, RayField(turned), {}, compose(origin, pose), quarter, b);
  ASSERT_EQ(a.size(), 90U);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-6) << i;
}

TEST(Scan, SeesObstaclesInFrontOfWalls) {
  const GridMap open(200, 200, 0.05, {}, std::vector<std::int8_t>(40'000, 0));
  const RayField field(open);
  const std::vector<Shape> shapes{Shape::disc({7.0, 5.0}, 0.5), Shape::box({5.0, 8.0, 0.5}, 2.0, 0.2)};
  LaserSpec spec{.angle_min_rad = 0.0, .angle_increment_rad = std::numbers::pi / 2, .beams = 2};
  std::vector<double> ranges;
  cast_scan(open, field, shapes, {5.0, 5.0, 0.0}, spec, ranges);
  EXPECT_NEAR(ranges[0], 1.5, 1e-12);
  EXPECT_NEAR(ranges[1], 3.0 - 0.1 / std::cos(0.5), 1e-12);
}

TEST(Scan, ReportsTooNearAndTooFarAsInfinities) {
  const GridMap open(200, 200, 0.05, {}, std::vector<std::int8_t>(40'000, 0));
  const std::vector<Shape> shapes{Shape::disc({5.2, 5.0}, 0.1)};
  const LaserSpec spec{.angle_min_rad = 0.0, .angle_increment_rad = std::numbers::pi, .beams = 2, .range_min_m = 0.2};
  std::vector<double> ranges;
  cast_scan(open, RayField(open), shapes, {5.0, 5.0, 0.0}, spec, ranges);
  EXPECT_EQ(ranges[0], -kInfinity);
  EXPECT_EQ(ranges[1], kInfinity);
}

TEST(Scan, NoiseHasItsSpreadAndDropOutsTheirShare) {
  LaserSpec spec{.noise_m = 0.1, .dropout = 0.25};
  Rng rng(5);
  std::vector<double> ranges(20'000, 4.0);
  disturb_scan(spec, rng, ranges);
  double squares = 0.0;
  int lost = 0;
  for (const double range : ranges) {
    if (std::isinf(range))
      ++lost;
    else
      squares += (range - 4.0) * (range - 4.0);
  }
  EXPECT_NEAR(lost / 20'000.0, 0.25, 0.02);
  EXPECT_NEAR(std::sqrt(squares / (20'000.0 - lost)), 0.1, 0.005);
}

TEST(Scan, WithoutNoiseDrawsNothing) {
  Rng rng(5);
  std::vector<double> ranges(10, 4.0);
  disturb_scan(LaserSpec{}, rng, ranges);
  EXPECT_EQ(rng, Rng(5));
  EXPECT_EQ(ranges, std::vector<double>(10, 4.0));
}

TEST(Shape, DistanceAndRayAgree) {
  Rng rng(9);
  for (int i = 0; i < 2000; ++i) {
    const Pose2 pose{rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-3, 3)};
    const Shape shape = i % 2 == 0 ? Shape::disc(pose.position(), rng.uniform(0.1, 1.0))
                                   : Shape::box(pose, rng.uniform(0.1, 2.0), rng.uniform(0.1, 2.0));
    const double angle = rng.uniform(-3, 3);
    const Vec2 from{rng.uniform(-4, 4), rng.uniform(-4, 4)};
    const Vec2 direction{std::cos(angle), std::sin(angle)};
    const double range = ray_distance(shape, from, direction);
    if (std::isinf(range)) continue;
    // Just before the hit the ray is outside, at the hit it touches.
    EXPECT_NEAR(distance(shape, from + range * direction), 0.0, 1e-9);
    if (range > 1e-3) {
      EXPECT_GT(distance(shape, from + (range - 1e-3) * direction), 0.0);
    }
  }
}

}  // namespace
}  // namespace sentree::sim
