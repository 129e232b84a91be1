#include "sentree/sim/sight.h"

#include <gtest/gtest.h>

#include "sentree/base/present.h"
#include "sentree/base/rng.h"
#include "sentree/sim/detail/exact_localization.h"
#include "sentree/sim/scan_memo.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

// A drop-out that never comes has every scan cast at once: the reference.
TEST(Sight, WhatNobodyLooksAtNeedsNoRays) {
  Loaded<World> loaded = load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
  ASSERT_TRUE(loaded.ok());
  World world = *std::move(loaded.value);
  for (const auto method : {LocalizationSpec::Method::kOdometry, LocalizationSpec::Method::kAmcl, kExact}) {
    world.robots[0].laser.dropout = 0.0;
    world.robots[0].localization.method = method;
    derive(world, world.robots[0]);
    World casting = world;
    casting.robots[0].laser.dropout = 1e-300;
    constexpr std::uint64_t kSeed = 5;
    Rng rng(kSeed);
    ScanMemo memo;
    State lazy = initial_state(world, kSeed);
    State cast = initial_state(casting, kSeed);
    TimePoint now{};
    int uncast = 0;
    for (int i = 0; i < 900; ++i) {
      now += std::chrono::milliseconds(100);
      const auto change = rng.below(40);
      const Vec2 at{rng.uniform(1.0, 15.0), rng.uniform(1.0, 9.0)};
      const auto both = [&](auto&& what) {
        what(world, lazy);
        what(casting, cast);
      };
      const auto drive = [&](const char* where) {
        const Map args{{"name", where}};
        const Call call{.service = "Navigation", .method = "gotoTargetByLocationName", .args = args};
        EXPECT_TRUE(call_uncast(world, lazy, call, now));
        EXPECT_TRUE(sim::call(casting, cast, call, now));
      };
      if (i % 300 == 0) drive(i % 600 == 0 ? "kitchen" : "start");
      if (change == 0) both([](const World&, State& state) { state.doors[0].open = !state.doors[0].open; });
      if (change == 1) {
        both([&](const World&, State& state) {
          state.obstacles.assign(1, Obstacle());
          state.obstacles[0].shape = Shape::disc(at, 0.3);
        });
      }
      if (change > 30) both([](const World&, State& state) { state.obstacles.clear(); });
      {
        const Present<ScanMemo> remembers(memo);
        advance_uncast(world, lazy, now);
      }
      advance(casting, cast, now);
      uncast += lazy.robots[0].uncast ? 1 : 0;
      State looked_at = lazy;
      cast_scans(world, looked_at);
      looked_at.robots[0].laser_rng = cast.robots[0].laser_rng;
      ASSERT_EQ(looked_at, cast) << "method " << static_cast<int>(method) << ", seed " << kSeed << ", step " << i;
    }
    EXPECT_GT(uncast, 200) << "method " << static_cast<int>(method);
  }
}

}  // namespace
}  // namespace sentree::sim
