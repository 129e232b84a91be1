#include "sentree/base/rng.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace sentree {
namespace {

TEST(Rng, GivesTheNumbersOfSplitMix64) {
  // The reference implementation's output for this seed.
  Rng rng(1234567);
  EXPECT_EQ(rng.next(), 6457827717110365317ULL);
  EXPECT_EQ(rng.next(), 3203168211198807973ULL);
  EXPECT_EQ(rng.next(), 9817491932198370423ULL);
  EXPECT_EQ(rng.next(), 4593380528125082431ULL);
  EXPECT_EQ(rng.next(), 16408922859458223821ULL);
}

TEST(Rng, ContinuesAlikeWhenCopied) {
  Rng a(5);
  for (int i = 0; i < 10; ++i) static_cast<void>(a.normal());
  Rng b = a;
  EXPECT_EQ(a, b);
  EXPECT_EQ(a.normal(), b.normal());
  EXPECT_EQ(a.state(), b.state());
  Rng restored(a.state());
  EXPECT_EQ(restored.next(), a.next());
}

TEST(Rng, GivesEachPartItsOwnNumbers) {
  EXPECT_EQ(Rng::of(1, "laser"), Rng::of(1, "laser"));
  EXPECT_NE(Rng::of(1, "laser").state(), Rng::of(1, "odometry").state());
  EXPECT_NE(Rng::of(1, "laser").state(), Rng::of(2, "laser").state());
}

TEST(Rng, DrawsUniformlyBelowABound) {
  Rng rng(9);
  EXPECT_EQ(rng.below(0), 0u);
  EXPECT_EQ(rng.below(1), 0u);
  constexpr int kDraws = 60'000;
  std::array<int, 6> counts{};
  for (int i = 0; i < kDraws; ++i) ++counts[rng.below(6)];
  // Chi-squared with 5 degrees of freedom; 20.5 is exceeded once in a thousand seeds, and this seed is fixed.
  double chi = 0;
  for (const int count : counts) chi += std::pow(count - kDraws / 6.0, 2) / (kDraws / 6.0);
  EXPECT_LT(chi, 20.5);
}

TEST(Rng, HasNoBiasForHugeBounds) {
  // With plain modulo two thirds of the draws would fall into the lower half.
  Rng rng(10);
  constexpr std::uint64_t kBound = 0xC000000000000000ULL;
  int low = 0;
  for (int i = 0; i < 10'000; ++i) low += rng.below(kBound) < kBound / 2 ? 1 : 0;
  EXPECT_NEAR(low, 5000, 200);
}

TEST(Rng, StaysInsideItsInterval) {
  Rng rng(2);
  const double next = std::nextafter(1.0, 2.0);
  double sum = 0;
  for (int i = 0; i < 10'000; ++i) {
    const double u = rng.uniform();
    EXPECT_GE(u, 0);
    EXPECT_LT(u, 1);
    sum += u;
    EXPECT_EQ(rng.uniform(1.0, next), 1.0);  // the only double in [1, next)
  }
  EXPECT_NEAR(sum / 10'000, 0.5, 0.01);
}

TEST(Rng, DrawsNormallyDistributedNumbers) {
  Rng rng(4);
  double sum = 0;
  double squares = 0;
  int beyond_two = 0;
  constexpr int kDraws = 100'000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.normal();
    sum += x;
    squares += x * x;
    beyond_two += std::abs(x) > 2 ? 1 : 0;
  }
  EXPECT_NEAR(sum / kDraws, 0, 0.01);
  EXPECT_NEAR(squares / kDraws, 1, 0.02);
  EXPECT_NEAR(beyond_two / static_cast<double>(kDraws), 0.0455, 0.003);
}

}  // namespace
}  // namespace sentree
