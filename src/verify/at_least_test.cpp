#include "sentree/verify/at_least.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// Runs until it is decided.
int runs_of(AtLeast& test, AtLeast::Run run) {
  int runs = 0;
  for (; test.state() == State::kOpen; ++runs) test.add(run);
  return runs;
}

TEST(AtLeastTest, DecidesAsSoonAsTheRunsSay) {
  // 1 % is allowed; of rates there are 0, 0.5 %, 0.75 %, … to a thousandth of 1 % beside it: eleven. What is never
  // violated is 1/0.99 times as likely at 0 with each run, and more or less so at the others.
  AtLeast holds(0.99, 0.95);
  const int kept = runs_of(holds, AtLeast::Run::kKept);
  EXPECT_EQ(holds.state(), State::kHolds);
  EXPECT_LE(kept, std::ceil(std::log(11 * 20) / -std::log(0.99)));
  EXPECT_GE(kept, std::ceil(std::log(20) / -std::log(0.99)));
  AtLeast refuted(0.99, 0.95);
  EXPECT_EQ(runs_of(refuted, AtLeast::Run::kViolated), 2);  // 100² and less, of 17: beyond 20
  EXPECT_EQ(refuted.state(), State::kRefuted);
}

TEST(AtLeastTest, DecidesNearTheShareToo) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  constexpr int kNearTests = 60;
  for (const double allowed : {0.02, 0.3, 0.9}) {
    for (const double off : {-0.15, 0.15}) {
      const double rate = allowed + off * std::min(allowed, 1 - allowed);
      SCOPED_TRACE(rate);
      int right = 0;
      for (int i = 0; i < kNearTests; ++i) {
        AtLeast test(1 - allowed, 0.95);
        for (int run = 0; test.state() == State::kOpen && run < 200'000; ++run)
          test.add(rng.uniform() < rate ? AtLeast::Run::kViolated : AtLeast::Run::kKept);
        right += test.state() == (off < 0 ? State::kHolds : State::kRefuted) ? 1 : 0;
      }
      EXPECT_GE(right, kNearTests - 7) << "5 % of 60 are wrong, and three standard deviations";
    }
  }
}

TEST(AtLeastTest, SaysWhatSoManyRunsDoNotTell) {
  AtLeast test(0.9, 0.95);
  EXPECT_EQ(test.indifference().low, 0);
  EXPECT_EQ(test.indifference().high, 1);
  // As often as is allowed: it stays open, and less and less is left between.
  double width = 1;
  for (int i = 1; i <= 100'000; ++i) {
    test.add(i % 10 == 0 ? AtLeast::Run::kViolated : AtLeast::Run::kKept);
    if (i % 20'000 != 0) continue;
    const auto [low, high] = test.indifference();
    EXPECT_LT(low, 0.9);
    EXPECT_GT(high, 0.9);
    EXPECT_LT(high - low, width);
    width = high - low;
  }
  EXPECT_EQ(test.state(), State::kOpen);
  // n δ² / (2 p (1 − p)) = log(14 / 0.05), both ways.
  EXPECT_NEAR(width, 2 * std::sqrt(2 * 0.1 * 0.9 * std::log(14 / 0.05) / 100'000), 0.001);
}

TEST(AtLeastTest, DecidesHalfOfThoseAtTheEdgeOfWhatItTells) {
  constexpr std::uint64_t kSeed = 13;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  constexpr int kRuns = 5'000;
  AtLeast regular(0.9, 0.95);
  for (int i = 1; i <= kRuns; ++i) regular.add(i % 10 == 0 ? AtLeast::Run::kViolated : AtLeast::Run::kKept);
  const auto [low, high] = regular.indifference();
  const auto decided_of = [&](double share) {
    int decided = 0;
    for (int i = 0; i < 100; ++i) {
      AtLeast test(0.9, 0.95);
      for (int run = 0; run < kRuns; ++run)
        test.add(rng.uniform() < share ? AtLeast::Run::kKept : AtLeast::Run::kViolated);
      decided += test.state() == State::kOpen ? 0 : 1;
    }
    return decided;
  };
  for (const double edge : {low, high}) {
    SCOPED_TRACE(edge);
    EXPECT_GE(decided_of(edge), 35);
    EXPECT_LE(decided_of(0.9 + (edge - 0.9) / 3), 35) << "well inside";
    EXPECT_GE(decided_of(0.9 + (edge - 0.9) * 1.6), 85) << "well outside";
  }
}

TEST(AtLeastTest, SaysNothingOfRunsThatAreNotKnown) {
  AtLeast test(0.99, 0.95);
  for (int i = 0; i < 10'000; ++i) test.add(AtLeast::Run::kUnknown);
  EXPECT_EQ(test.state(), State::kOpen);
}

}  // namespace
}  // namespace sentree::verify
