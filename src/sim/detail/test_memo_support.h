#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "sentree/base/present.h"
#include "sentree/base/rng.h"
#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim::test {

/// The world of the recharge example, with its one robot. Without robots: it could not be loaded.
inline World house() {
  Loaded<World> loaded = load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
  return loaded.ok() ? *std::move(loaded.value) : World{};
}

/// Steps of a life in which goals, doors, obstacles and the robot's place change at random.
struct Life {
  std::uint64_t seed = 0;
  int steps = 0;
  Duration step{};
  std::uint32_t quiet = 0;  ///< Of four and that many draws, these change nothing.
};

/// Where a world of which something is remembered goes another way than one of which nothing is.
/// Empty: nowhere.
template <typename Memo>
std::string difference(const World& world, const Life& life, Memo& memo) {
  Rng rng(life.seed);
  State plain = initial_state(world, life.seed);
  State remembered = plain;
  const auto both = [&](auto&& change) {
    change(plain);
    const Present<Memo> remembers(memo);
    change(remembered);
  };
  TimePoint now{};
  for (int i = 0; i < life.steps; ++i) {
    now += life.step;
    switch (rng.below(4 + life.quiet)) {
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
      default: break;
    }
    both([&](State& state) { advance(world, state, now); });
    if (plain != remembered) return "seed " + std::to_string(life.seed) + ", step " + std::to_string(i);
  }
  return {};
}

}  // namespace sentree::sim::test
