#include "sentree/sim/likelihood_field.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sentree/sim/detail/test_support.h"

namespace sentree::sim {
namespace {

// As the book has it: a normal over the distance to the nearest wall plus a uniform part.
double by_the_book(const GridMap& map, const DistanceField& distance, const ReadingSpec& spec, const BeamEnds& ends,
                   Vec2 at, double heading) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ends.x.size(); ++i) {
    const Vec2 end = at + rotated({ends.x[i], ends.y[i]}, heading);
    const Cell c{static_cast<int>(std::floor(end.x)), static_cast<int>(std::floor(end.y))};
    double hit = 0.0;
    if (map.contains(c)) {
      const double d = std::sqrt(static_cast<double>(distance.squared_cells(c))) * map.resolution_m();
      hit = std::exp(-d * d / (2.0 * spec.hit_sigma_m * spec.hit_sigma_m));
    }
    sum += std::log(hit + spec.random_share);
  }
  return sum;
}

TEST(LikelihoodField, IsTheBooksUpToItsSteps) {
  constexpr std::uint64_t kSeed = 21;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  const ReadingSpec spec{.hit_sigma_m = 0.2, .random_share = 0.4};
  const double step = std::log((1.0 + spec.random_share) / spec.random_share) / 255;
  for (int round = 0; round < 300; ++round) {
    const GridMap map = test::random_map(rng, 40 + static_cast<int>(rng.below(40)), 50, 10, round % 2 == 0);
    const DistanceField distance(map);
    const LikelihoodField field(map, distance, spec);
    BeamEnds ends;
    const std::size_t beams = rng.below(14);
    for (std::size_t i = 0; i < beams; ++i) {
      ends.x.push_back(static_cast<float>(rng.uniform(-60.0, 60.0)));
      ends.y.push_back(static_cast<float>(rng.uniform(-60.0, 60.0)));
    }
    const Vec2 at{rng.uniform(-20.0, 100.0), rng.uniform(-20.0, 70.0)};
    const double heading = rng.uniform(-4.0, 4.0);
    EXPECT_NEAR(field.log_likelihood(ends, at, heading), by_the_book(map, distance, spec, ends, at, heading),
                0.5 * step * static_cast<double>(beams) + 1e-9)
        << round;
  }
}

TEST(LikelihoodField, IsBestOnAWallAndAMissOutsideTheMap) {
  std::vector<std::int8_t> cells(100, 0);
  cells[55] = 100;
  const GridMap map(10, 10, 0.5, {}, cells);
  const ReadingSpec spec{.hit_sigma_m = 0.1, .random_share = 0.25};
  const LikelihoodField field(map, DistanceField(map), spec);
  EXPECT_NEAR(field.best(), 1.25, 1e-12);
  const BeamEnds one{{0.0F}, {0.0F}};
  EXPECT_NEAR(field.log_likelihood(one, {5.5, 5.5}, 1.0), std::log(1.25), 1e-12);
  for (const Vec2 outside : {Vec2{-1e9, 5.0}, Vec2{1e9, 5.0}, Vec2{5.0, -0.1}, Vec2{5.0, 1e12}}) {
    EXPECT_NEAR(field.log_likelihood(one, outside, 1.0), std::log(0.25), 1e-12) << outside.x << ' ' << outside.y;
  }
}

}  // namespace
}  // namespace sentree::sim
