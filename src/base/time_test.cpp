#include "sentree/base/time.h"

#include <gtest/gtest.h>

#include <limits>

namespace sentree {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TEST(FromSeconds, RoundsToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(0.1), milliseconds(100));
  EXPECT_EQ(from_seconds(-0.1), milliseconds(-100));
  EXPECT_EQ(from_seconds(1.4e-9), nanoseconds(1));
  EXPECT_EQ(from_seconds(1.6e-9), nanoseconds(2));
  EXPECT_EQ(from_seconds(-1.6e-9), nanoseconds(-2));
}

TEST(FromSeconds, SaturatesAndTakesNanForNothing) {
  EXPECT_EQ(from_seconds(1e10), Duration::max());
  EXPECT_EQ(from_seconds(std::numeric_limits<double>::infinity()), Duration::max());
  EXPECT_EQ(from_seconds(-1e10), Duration::min());
  EXPECT_EQ(from_seconds(std::numeric_limits<double>::quiet_NaN()), Duration(0));
}

TEST(AddSaturating, NeverWrapsRound) {
  EXPECT_EQ(add_saturating(TimePoint(milliseconds(1)), milliseconds(2)), TimePoint(milliseconds(3)));
  EXPECT_EQ(add_saturating(TimePoint(milliseconds(1)), Duration::max()), kNever);
  EXPECT_EQ(add_saturating(kNever, nanoseconds(1)), kNever);
  EXPECT_EQ(add_saturating(kNever, Duration(0)), kNever);
  EXPECT_EQ(add_saturating(TimePoint(milliseconds(-1)), Duration::min()), TimePoint::min());
}

TEST(Seconds, AreCountedFromTheStartOfTheRun) {
  EXPECT_EQ(seconds(TimePoint(milliseconds(1500))), 1.5);
  EXPECT_EQ(seconds(milliseconds(-250)), -0.25);
}

TEST(ManualClock, StandsStillUntilSet) {
  ManualClock clock;
  EXPECT_EQ(clock.now(), TimePoint{});
  clock.advance(milliseconds(5));
  clock.set(clock.now());
  EXPECT_EQ(clock.now(), TimePoint(milliseconds(5)));
}

TEST(ManualClockDeathTest, DoesNotRunBackwards) {
  ManualClock clock;
  clock.advance(milliseconds(5));
  EXPECT_DEATH(clock.set(TimePoint(milliseconds(4))), "time\\.cpp:.*broken invariant: now >= now_");
}

}  // namespace
}  // namespace sentree
