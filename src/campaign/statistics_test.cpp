#include "sentree/campaign/statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sentree/base/rng.h"

namespace sentree::campaign {
namespace {

using ::testing::HasSubstr;

TEST(ClopperPearson, GivesTheTabulatedIntervals) {
  // 95 %, as in tables of exact limits.
  const auto near = [](const Interval& interval, double low, double high) {
    EXPECT_NEAR(interval.low, low, 5e-5);
    EXPECT_NEAR(interval.high, high, 5e-5);
  };
  near(clopper_pearson(0, 10, 0.95), 0.0, 0.3085);
  near(clopper_pearson(1, 10, 0.95), 0.0025, 0.4450);
  near(clopper_pearson(5, 10, 0.95), 0.1871, 0.8129);
  near(clopper_pearson(10, 10, 0.95), 0.6915, 1.0);
  EXPECT_EQ(clopper_pearson(0, 0, 0.95), (Interval{0.0, 1.0}));
}

TEST(ClopperPearson, HoldsTheRateAtLeastAsOftenAsItSays) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  for (const double rate : {0.01, 0.2, 0.5}) {
    int held = 0;
    constexpr int kRepeats = 2000;
    for (int i = 0; i < kRepeats; ++i) {
      std::uint64_t hits = 0;
      for (int run = 0; run < 60; ++run) hits += rng.uniform() < rate ? 1 : 0;
      const Interval interval = clopper_pearson(hits, 60, 0.9);
      held += interval.low <= rate && rate <= interval.high ? 1 : 0;
    }
    EXPECT_GE(held, 0.9 * kRepeats - 3 * std::sqrt(0.09 * kRepeats)) << rate;
  }
}

TEST(MeanOfShares, IsStudentsInterval) {
  // The quantile of 3 degrees of freedom is 3.182.
  const Interval found = mean_of_shares({0.4, 0.4, 0.6, 0.6}, 0.95);
  EXPECT_NEAR(found.low, 0.5 - 3.182 * std::sqrt(0.04 / 3 / 4), 1e-4);
  EXPECT_NEAR(found.high, 0.5 + 3.182 * std::sqrt(0.04 / 3 / 4), 1e-4);
  EXPECT_EQ(mean_of_shares({0.001, 0.5}, 0.95), (Interval{0, 1})) << "it is cut to what a probability can be";
  EXPECT_EQ(mean_of_shares({0.5}, 0.95), (Interval{0, 1}));
}

TEST(Tally, HasTheQuantilesOfTheSortedValues) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  Tally tally(0.1, 600);
  std::vector<double> values;
  for (int i = 0; i < 5000; ++i) {
    values.push_back(std::abs(rng.normal()) * 100);
    tally.add(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double p : {0.05, 0.5, 0.95})
    EXPECT_NEAR(tally.quantile(p), values[static_cast<std::size_t>(std::ceil(p * 5000)) - 1], 0.1 + 1e-9);
  std::uint64_t counted = 0;
  for (const auto& [low, count] : tally.histogram(40)) counted += count;
  EXPECT_EQ(counted, 5000U);
  EXPECT_LE(tally.histogram(40).size(), 40U);
}

TEST(Tally, CountsWhatLiesBeyondItsEndInTheLastBin) {
  Tally tally(1, 10);
  tally.add(1e9);
  tally.add(-3);
  EXPECT_EQ(tally.count(), 2U);
  EXPECT_EQ(tally.least(), -3);
  EXPECT_EQ(tally.most(), 1e9);
}

TEST(Influence, IsThatOfTheAnalysisOfVariance) {
  // Three groups of five: means 5.2, 9.2 and 9.6, squares 59.2 between and 60.8 within, F(2, 12) = 5.842.
  std::vector<Group> groups(3);
  const std::vector<std::vector<double>> values{{6, 8, 4, 5, 3}, {8, 12, 9, 11, 6}, {13, 9, 11, 8, 7}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (const double value : values[i]) groups[i].add(value);
  }
  const Influence found = influence(groups);
  EXPECT_NEAR(found.p_value, 0.0169, 5e-5);
  EXPECT_NEAR(found.share, (59.2 - 2 * 60.8 / 12) / (120.0 + 60.8 / 12), 1e-9);
}

TEST(Influence, OfWhatDoesNotMatterIsNone) {
  constexpr std::uint64_t kSeed = 21;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  int named = 0;
  for (int i = 0; i < 500; ++i) {
    std::vector<Group> groups(10);
    for (int run = 0; run < 400; ++run) groups[rng.below(10)].add(rng.uniform() < 0.2 ? 1.0 : 0.0);
    named += influence(groups).p_value < 0.01 ? 1 : 0;
  }
  EXPECT_LE(named, 15);  // of 5 to expect
  EXPECT_EQ(influence({{5, 5, 5}, {5, 5, 5}}).share, 0.0);
}

// At the ends of the indifference region, where it is wrong most often, and beyond them.
TEST(SequentialTest, IsWrongAsSeldomAsItSays) {
  constexpr std::uint64_t kSeed = 31;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  const auto refuted = [&](const Expectation& expectation, double confidence, int repeats, double rate) {
    int count = 0;
    for (int i = 0; i < repeats; ++i) {
      SequentialTest test(expectation, confidence);
      while (test.state() == SequentialTest::State::kOpen) test.add(rng.uniform() < rate);
      count += test.state() == SequentialTest::State::kRefuted ? 1 : 0;
    }
    return count;
  };
  for (const auto& [confidence, repeats] : {std::pair(0.9, 1000), std::pair(0.99, 400)}) {
    const double most = (1 - confidence) * repeats + 4 * std::sqrt(confidence * (1 - confidence) * repeats);
    for (const double bound : {0.01, 0.1, 0.5, 0.9, 0.99}) {
      for (const bool below : {false, true}) {
        SCOPED_TRACE(testing::Message() << (below ? "< " : "> ") << bound << " at " << confidence);
        const Expectation expectation{.text = {}, .subject = "r", .what = "violated", .below = below, .rate = bound};
        const auto [low, high] = SequentialTest(expectation, confidence).indifference();
        EXPECT_DOUBLE_EQ(below ? high : low, bound);
        EXPECT_LE(high - low, std::min(bound, 1 - bound) * (1 + 1e-9));
        for (const double rate : {low, low / 3}) {
          const int count = refuted(expectation, confidence, repeats, rate);
          EXPECT_LE(below ? count : repeats - count, most) << rate;
        }
        for (const double rate : {high, 1 - (1 - high) / 3}) {
          const int count = refuted(expectation, confidence, repeats, rate);
          EXPECT_LE(below ? repeats - count : count, most) << rate;
        }
      }
    }
  }
}

TEST(SequentialTest, TellsFromTheBoundOnTheSideOfTheSmallerRate) {
  const auto indifference = [](const std::string& text) {
    const auto expectation = parse_expectation(text, {});
    return expectation ? SequentialTest(*expectation, 0.99).indifference() : Interval{};
  };
  const auto is = [](const Interval& found, double low, double high) {
    EXPECT_NEAR(found.low, low, 1e-12);
    EXPECT_NEAR(found.high, high, 1e-12);
  };
  is(indifference("mission FAILURE < 1 %"), 0.005, 0.01);
  is(indifference("mission FAILURE > 1 %"), 0.01, 0.02);
  is(indifference("mission SUCCESS < 99 %"), 0.98, 0.99);
  is(indifference("mission SUCCESS > 99 %"), 0.99, 0.995);
  is(indifference("mission SUCCESS < 50 %"), 0.25, 0.5);
  is(indifference("mission SUCCESS > 50 %"), 0.5, 0.75);
}

TEST(SequentialTest, DecidesAboutARareViolationAsSoonAsTheRunsSay) {
  auto expectation = parse_expectation("never_empty violated < 1e-3", {"never_empty"});
  ASSERT_TRUE(expectation);
  SequentialTest test(*expectation, 0.99);
  while (test.state() == SequentialTest::State::kOpen) test.add(false);
  EXPECT_EQ(test.state(), SequentialTest::State::kHolds);
  EXPECT_EQ(test.runs(), static_cast<std::uint64_t>(std::ceil(std::log(100) / std::log((1 - 5e-4) / (1 - 1e-3)))));
  SequentialTest bad(*expectation, 0.99);
  while (bad.state() == SequentialTest::State::kOpen) bad.add(true);
  EXPECT_EQ(bad.state(), SequentialTest::State::kRefuted);
  EXPECT_EQ(bad.runs(), 7U);  // 2^7 > 100
}

TEST(SequentialTest, TurnsWhatMustBeOftenRound) {
  auto expectation = parse_expectation("mission SUCCESS > 95 %", {});
  ASSERT_TRUE(expectation);
  SequentialTest test(*expectation, 0.95);
  while (test.state() == SequentialTest::State::kOpen) test.add(true);
  EXPECT_EQ(test.state(), SequentialTest::State::kHolds);
}

TEST(Share, IsTheNearestToWhatIsWritten) {
  EXPECT_EQ(parse_share("99.9 %"), 0.999);
  EXPECT_EQ(parse_share("2.7%"), 0.027);
  EXPECT_EQ(parse_share("1e-1 %"), 0.001);
  EXPECT_EQ(parse_share("0.01"), 0.01);
  for (const char* none : {"", "%", "0", "100 %", "-1 %", "nan", "nan %", "5 m", "5 % %"})
    EXPECT_EQ(parse_share(none), std::nullopt) << none;
}

TEST(Expectation, OfNothingThatThereIsSaysWhatThereIs) {
  const auto message = [](const std::string& text) {
    const auto parsed = parse_expectation(text, {"never_empty"});
    return parsed ? std::string() : parsed.error().message;
  };
  EXPECT_THAT(message("never_emty violated < 1e-3"), HasSubstr("did you mean \"never_empty\""));
  EXPECT_THAT(message("never_empty violted < 1e-3"), HasSubstr("did you mean \"violated\""));
  EXPECT_THAT(message("never_empty violated = 1e-3"), HasSubstr("needs < or >"));
  EXPECT_THAT(message("never_empty violated < 2"), HasSubstr("above 0 and below 1"));
  EXPECT_THAT(message("mission violated < 0.1"), HasSubstr("there is no \"violated\""));
  EXPECT_THAT(message(""), HasSubstr("write"));
}

}  // namespace
}  // namespace sentree::campaign
