#include "sentree/sim/scan_memo.h"

#include <gtest/gtest.h>

#include "sentree/base/rng.h"
#include "sentree/sim/remember.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

World seen_house() {
  Loaded<World> loaded = load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  return loaded.ok() ? *std::move(loaded.value) : World{};
}

// Whatever happens, a world whose scans are remembered goes on as one whose are not.
TEST(ScanMemo, ChangesNothing) {
  for (const double noise_m : {0.0, 0.02}) {
    World world = seen_house();
    ASSERT_FALSE(world.robots.empty());
    world.robots[0].laser.noise_m = noise_m;
    constexpr std::uint64_t kSeed = 11;
    Rng rng(kSeed);
    State plain = initial_state(world, kSeed);
    State remembered = plain;
    ScanMemo memo;
    TimePoint now{};
    for (int i = 0; i < 600; ++i) {
      now += std::chrono::milliseconds(100);
      const auto both = [&](auto&& change) {
        change(plain);
        const Remember<ScanMemo> remembers(memo);
        change(remembered);
      };
      switch (rng.below(12)) {
        case 0:
          both([&](State& state) {
            (void)call(world, state,
                       {.service = "Navigation",
                        .method = "gotoTargetByLocationName",
                        .args = Map{{"name", i % 2 == 0 ? "kitchen" : "station"}}},
                       now);
          });
          break;
        case 1: both([](State& state) { state.doors[0].open = !state.doors[0].open; }); break;
        case 2: {
          const Vec2 at{rng.uniform(1.0, 15.0), rng.uniform(1.0, 9.0)};
          both([&](State& state) {
            state.obstacles.assign(1, Obstacle());
            state.obstacles[0].shape = Shape::disc(at, 0.3);
          });
          break;
        }
        case 3:
          if (i % 3 == 0) both([](State& state) { state.robots[0].truth.pose.theta += 0.1; });
          break;
        default: break;  // nothing, for a while
      }
      both([&](State& state) { advance(world, state, now); });
      ASSERT_EQ(plain, remembered) << "noise " << noise_m << ", seed " << kSeed << ", step " << i;
    }
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

}  // namespace
}  // namespace sentree::sim
