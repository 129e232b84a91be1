#include "sentree/verify/at_least.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sentree/base/rng.h"

namespace sentree::verify {
namespace {

using State = AtLeast::State;

struct Counts {
  int holds = 0;
  int refuted = 0;
};

constexpr int kTests = 400;

// @param share  That is asked for.
// @param rate   Of violations.
Counts decided(double share, double rate, Rng& rng) {
  Counts out;
  for (int i = 0; i < kTests; ++i) {
    AtLeast test(share, 0.95);
    for (int run = 0; run < 4'000 && test.state() == State::kOpen; ++run)
      test.add(rng.uniform() < rate ? AtLeast::Run::kViolated : AtLeast::Run::kKept);
    out.holds += test.state() == State::kHolds ? 1 : 0;
    out.refuted += test.state() == State::kRefuted ? 1 : 0;
  }
  return out;
}

TEST(AtLeastTest, IsWrongAsSeldomAsItSays) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  constexpr int kWrongMax = 34;  // 5 % of 400, and three standard deviations
  for (const double allowed : {0.01, 0.1, 0.5, 0.9}) {
    SCOPED_TRACE(allowed);
    // What is kept often enough, if only just, is not refuted,
    for (const double rate : {0.5, 0.8, 1.0}) EXPECT_LE(decided(1 - allowed, allowed * rate, rng).refuted, kWrongMax);
    // and what is not does not hold.
    for (const double rate : {1.0, 1.2}) {
      if (allowed * rate >= 1) continue;
      EXPECT_LE(decided(1 - allowed, allowed * rate, rng).holds, kWrongMax);
    }
  }
  EXPECT_GE(decided(0.9, 0.03, rng).holds, kTests - kWrongMax);
  EXPECT_GE(decided(0.9, 0.3, rng).refuted, kTests - kWrongMax);
  EXPECT_EQ(decided(0.9, 0, rng).holds, kTests);
  EXPECT_EQ(decided(0.9, 1, rng).refuted, kTests);
}

TEST(AtLeastTest, DecidesAsSoonAsTheRunsSay) {
  AtLeast holds(0.99, 0.95);
  int runs = 0;
  for (; holds.state() == State::kOpen; ++runs) holds.add(AtLeast::Run::kKept);
  EXPECT_EQ(holds.state(), State::kHolds);
  EXPECT_EQ(runs, static_cast<int>(std::ceil(std::log(20) / std::log(0.995 / 0.99))));
  AtLeast refuted(0.99, 0.95);
  for (runs = 0; refuted.state() == State::kOpen; ++runs) refuted.add(AtLeast::Run::kViolated);
  EXPECT_EQ(refuted.state(), State::kRefuted);
  EXPECT_EQ(runs, 5);  // 2^5 > 20
}

TEST(AtLeastTest, SaysNothingOfRunsThatAreNotKnown) {
  AtLeast test(0.99, 0.95);
  for (int i = 0; i < 10'000; ++i) test.add(AtLeast::Run::kUnknown);
  EXPECT_EQ(test.state(), State::kOpen);
}

}  // namespace
}  // namespace sentree::verify
