#include "sentree/sim/scan_memo.h"

#include <gtest/gtest.h>

#include <chrono>
#include "sentree/sim/detail/test_memo_support.h"

namespace sentree::sim {
namespace {

TEST(ScanMemo, ChangesNothing) {
  for (const double noise_m : {0.0, 0.02}) {
    SCOPED_TRACE(noise_m);
    World world = test::house();
    ASSERT_FALSE(world.robots.empty());
    world.robots[0].laser.noise_m = noise_m;
    ScanMemo memo;
    EXPECT_EQ(
        test::difference(world, {.seed = 11, .steps = 600, .step = std::chrono::milliseconds(100), .quiet = 8}, memo),
        "");
  }
}

TEST(ScanMemo, RecallsWhatWasSeenFromTheSamePlaceAmongTheSameShapes) {
  ScanMemo memo;
  const Pose2 pose{1.0, 2.0, 0.5};
  const std::vector<Shape> shapes{Shape::disc({3.0, 2.0}, 0.2)};
  std::vector<double> ranges;
  EXPECT_FALSE(memo.recall(1, pose, shapes, ranges));
  memo.keep(1, pose, shapes, {1.5, 2.5});
  ASSERT_TRUE(memo.recall(1, pose, shapes, ranges));
  EXPECT_EQ(ranges, (std::vector<double>{1.5, 2.5}));
  EXPECT_FALSE(memo.recall(0, pose, shapes, ranges));
  EXPECT_FALSE(memo.recall(2, pose, shapes, ranges));
  EXPECT_FALSE(memo.recall(1, {1.0, 2.0, 0.6}, shapes, ranges));
  EXPECT_FALSE(memo.recall(1, pose, {}, ranges));
  EXPECT_FALSE(memo.recall(1, pose, std::vector<Shape>{Shape::disc({3.0, 2.0}, 0.3)}, ranges));
}

TEST(ScanMemo, RecallsWhatIsNearFromTheSamePlaceAsFarAsItWasLooked) {
  ScanMemo memo;
  const Pose2 pose{1.0, 2.0, 0.5};
  EXPECT_EQ(memo.recall_near(1, pose, 0.5), nullptr);
  EXPECT_EQ(memo.keep_near(1, pose, 0.6, {0.4, kInfinity}), (std::vector<double>{0.4, kInfinity}));
  ASSERT_NE(memo.recall_near(1, pose, 0.6), nullptr);
  EXPECT_EQ(*memo.recall_near(1, pose, 0.5), (std::vector<double>{0.4, kInfinity}));
  EXPECT_EQ(memo.recall_near(1, pose, 0.61), nullptr);
  EXPECT_EQ(memo.recall_near(1, {1.0, 2.0, 0.6}, 0.5), nullptr);
  EXPECT_EQ(memo.recall_near(0, pose, 0.5), nullptr);
}

}  // namespace
}  // namespace sentree::sim
