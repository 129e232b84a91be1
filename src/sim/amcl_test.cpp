#include "sentree/sim/localization.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "sentree/sim/astar.h"
#include "sentree/sim/detail/exact_localization.h"
#include "sentree/sim/detail/particle_filter.h"
#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

LocalizationSpec amcl() { return {.method = LocalizationSpec::Method::kAmcl}; }

// A robot with the errors of real wheels and a real laser.
World noisy_world(GridMap map, Pose2 start) {
  World world = test::world_around(std::move(map), start, amcl());
  RobotSpec& robot = world.robots[0];
  robot.odometry = {.scale = 0.03, .turn_scale = 0.02, .white = 0.1};
  robot.laser.noise_m = 0.02;
  robot.laser.dropout = 0.02;
  return world;
}

// A place that the robot can reach from `from`, or stand on if there is no `from`.
Pose2 random_place(const World& world, Rng& rng, const Pose2* from) {
  const CostGrid& costs = world.robots[0].costs;
  for (;;) {
    const Cell c{static_cast<int>(rng.below(static_cast<std::uint64_t>(world.map.width()))),
                 static_cast<int>(rng.below(static_cast<std::uint64_t>(world.map.height())))};
    if (costs.at(c) == CostGrid::kBlocked) continue;
    if (from != nullptr) {
      const Plan plan = find_path(costs, world.map.cell_at(from->position()), c, 10'000'000);
      if (plan.outcome != Plan::Outcome::kFound || plan.cells.size() < 40) continue;
    }
    const Vec2 p = world.map.centre(c);
    return {p.x, p.y, rng.uniform(-std::numbers::pi, std::numbers::pi)};
  }
}

double error_m(const RobotState& robot) {
  return distance(estimated_pose(robot.localization, robot.odometry).position(), robot.truth.pose.position());
}

// Drives to random places for `limit_s` and calls `each` every 0.1 s, until it says false.
template <class Each>
void drive(const World& world, State& state, Rng& rng, double limit_s, Each&& each) {
  const TimePoint end = state.time + from_seconds(limit_s);
  while (state.time < end) {
    RobotState& robot = state.robots[0];
    if (!is_active(robot.navigator.status)) {
      const Pose2 goal = random_place(world, rng, &robot.truth.pose);
      start_goal(world.robots[0].navigation, robot.navigator, "", {goal}, state.time);
    }
    advance_by(world, state, std::chrono::milliseconds(100));
    if (!each(state.robots[0])) return;
  }
}

// Turns and drives about by itself, as long as it is lost: forward where there is room, else turning.
template <class Each>
void wander(const World& world, State& state, double limit_s, Each&& each) {
  const TimePoint end = state.time + from_seconds(limit_s);
  int turn_left = 0;
  while (state.time < end) {
    RobotState& robot = state.robots[0];
    double front = 10.0;
    const auto& ranges = robot.scan.ranges;
    for (std::size_t i = 130; i < 230; ++i) {
      if (ranges[i] > 0.0) front = std::min(front, ranges[i]);
    }
    if (front < 0.6 && turn_left == 0) turn_left = 25;
    const Twist2 twist = turn_left > 0 ? Twist2{0.0, 0.7} : Twist2{0.3, 0.0};
    if (turn_left > 0) --turn_left;
    robot.command = {twist, TimePoint(std::chrono::hours(1000))};
    advance_by(world, state, std::chrono::milliseconds(100));
    if (!each(state.robots[0])) return;
  }
}

// House always; the others where the real maps are.
std::optional<GridMap> test_map(const std::string& name) {
  if (name == "house") {
    const Loaded<World> house = test::load_house();
    return house.ok() ? std::optional(house.value->map) : std::nullopt;
  }
  const auto folder = test::real_maps();
  if (!folder) return std::nullopt;
  Loaded<GridMap> map = test::load_map(*folder / name);
  return map.ok() ? std::optional(cropped_to_known(*map.value)) : std::nullopt;
}

class Amcl : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    map_ = test_map(GetParam());
    if (!map_) GTEST_SKIP() << "no " << GetParam() << ": set SENTREE_TEST_MAPS to a folder that has it";
  }
  std::optional<GridMap> map_;
};

TEST_P(Amcl, TracksWithinFiveCentimetresThroughNoise) {
  constexpr std::uint64_t kSeed = 4;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  World world = noisy_world(*map_, {});
  world.robots[0].start = random_place(world, rng, nullptr);
  State state = initial_state(world, kSeed);
  double squares = 0.0;
  double worst = 0.0;
  int count = 0;
  drive(world, state, rng, 300.0, [&](const RobotState& robot) {
    const double error = error_m(robot);
    worst = std::max(worst, error);
    squares += error * error;
    ++count;
    return true;
  });
  const double rmse = std::sqrt(squares / count);
  std::cout << GetParam() << ": rmse " << rmse << " m, worst " << worst << " m\n";
  EXPECT_LT(rmse, 0.05);
}

// What an update makes of the error, in the robot's frame.
struct Measured {
  struct Part {
    double rms = 0.0;       // of the error behind it
    double stays = 0.0;     // regression of the error behind it on the one before
    double residual = 0.0;  // root mean square of the rest
  };
  Part along;
  Part across;
  Part heading;
};

Measured measured_errors(const GridMap& map, LocalizationSpec::Method method, std::uint64_t seed) {
  Rng rng(seed);
  World world = noisy_world(map, {});
  world.robots[0].localization.method = method;
  world.robots[0].start = random_place(world, rng, nullptr);
  State state = initial_state(world, seed);
  std::vector<std::pair<Pose2, Pose2>> errors;
  Localization last = state.robots[0].localization;
  // Scans come as often as this looks, so an update is seen before the robot moves on by more than a step.
  drive(world, state, rng, 400.0, [&](const RobotState& robot) {
    if (robot.localization.updated_at != last.updated_at) {
      errors.emplace_back(relative(robot.truth.pose, estimated_pose(last, robot.odometry)),
                          relative(robot.truth.pose, estimated_pose(robot.localization, robot.odometry)));
    }
    last = robot.localization;
    return true;
  });
  const auto of = [&](auto&& part) {
    Measured::Part out;
    double before = 0.0;
    double after = 0.0;
    double both = 0.0;
    for (const auto& [b, a] : errors) {
      before += part(b) * part(b);
      after += part(a) * part(a);
      both += part(a) * part(b);
    }
    const auto count = static_cast<double>(errors.size());
    out.rms = std::sqrt(after / count);
    out.stays = both / before;
    out.residual = std::sqrt(std::max(0.0, after - both * both / before) / count);
    return out;
  };
  return {of([](const Pose2& e) { return e.x; }), of([](const Pose2& e) { return e.y; }),
          of([](const Pose2& e) { return wrap_angle(e.theta); })};
}

TEST_P(Amcl, ErrsAsTheExactLocalizationDoes) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(seed);
    const Measured filter = measured_errors(*map_, LocalizationSpec::Method::kAmcl, seed);
    const Measured exact = measured_errors(*map_, kExact, seed);
    const auto compare = [&](const char* what, const Measured::Part& f, const Measured::Part& e) {
      SCOPED_TRACE(what);
      std::cout << GetParam() << ", " << what << ": amcl " << f.rms << ", stays " << f.stays << ", rest " << f.residual
                << "; exact " << e.rms << ", stays " << e.stays << ", rest " << e.residual << "\n";
      EXPECT_GT(e.rms, f.rms / 2);
      EXPECT_LT(e.rms, f.rms * 2);
      EXPECT_NEAR(e.stays, f.stays, 0.15);
      EXPECT_GT(e.residual, f.residual / 2);
      EXPECT_LT(e.residual, f.residual * 2);
    };
    compare("along", filter.along, exact.along);
    compare("across", filter.across, exact.across);
    compare("heading", filter.heading, exact.heading);
  }
}

TEST(ExactLocalization, IsTheSameForTheSameSeedAndForgetsWhatItWasTold) {
  const Loaded<World> house = test::load_house();
  ASSERT_TRUE(house.ok());
  World world = *house.value;
  world.robots[0].localization.method = kExact;
  const auto after = [&](std::uint64_t seed) {
    State state = initial_state(world, seed);
    RobotState& robot = state.robots[0];
    set_initial_pose(world.robots[0].localization, robot.localization, {.pose = {3.0, 1.2, 0.0}}, robot.odometry);
    Rng rng(1);
    drive(world, state, rng, 30.0, [](const RobotState&) { return true; });
    return state;
  };
  const State state = after(7);
  EXPECT_EQ(state, after(7));
  EXPECT_NE(state.robots[0].localization.estimate.pose, after(8).robots[0].localization.estimate.pose);
  EXPECT_LT(error_m(state.robots[0]), 0.1);
  EXPECT_GT(error_m(state.robots[0]), 0.0);
}

TEST(ExactLocalization, KnowsItsPlaceAgainOnceItHasMoved) {
  const Loaded<World> house = test::load_house();
  ASSERT_TRUE(house.ok());
  World world = *house.value;
  world.robots[0].localization.method = kExact;
  State state = initial_state(world, 1);
  RobotState& robot = state.robots[0];
  reinitialize_globally(world.robots[0].localization, world.map, robot.localization, robot.odometry);
  EXPECT_EQ(robot.localization.status, LocalizationStatus::kNotYetLocalized);
  wander(world, state, 2.0, [](const RobotState&) { return true; });
  EXPECT_EQ(robot.localization.status, LocalizationStatus::kLocalizedOk);
  EXPECT_LT(error_m(robot), 0.1);
}

TEST_P(Amcl, FindsItselfAnywhere) {
  constexpr int kSeeds = 40;
  int found = 0;
  double time_s = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Rng rng(seed);
    World world = noisy_world(*map_, {});
    world.robots[0].start = random_place(world, rng, nullptr);
    State state = initial_state(world, seed);
    RobotState& robot = state.robots[0];
    reinitialize_globally(world.robots[0].localization, world.map, robot.localization, robot.odometry);
    EXPECT_EQ(robot.localization.status, LocalizationStatus::kNotYetLocalized);
    int good = 0;
    // Found means found for ten seconds, not once by chance.
    wander(world, state, 300.0, [&](const RobotState& r) {
      const bool is_good = r.localization.status == LocalizationStatus::kLocalizedOk && error_m(r) < 0.15;
      good = is_good ? good + 1 : 0;
      return good < 100;
    });
    if (good >= 100)
      ++found;
    else
      std::cout << GetParam() << ": seed " << seed << " not found, error " << error_m(state.robots[0]) << " m\n";
    time_s += seconds(state.time);
  }
  std::cout << GetParam() << ": " << found << " of " << kSeeds << " seeds, " << time_s / kSeeds << " s on average\n";
  EXPECT_GE(found, kSeeds - 1);
}

TEST_P(Amcl, FindsItselfAgainAfterBeingCarriedAway) {
  constexpr int kSeeds = 10;
  int found = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Rng rng(seed);
    World world = noisy_world(*map_, {});
    world.robots[0].start = random_place(world, rng, nullptr);
    State state = initial_state(world, seed);
    wander(world, state, 20.0, [](const RobotState&) { return true; });
    state.robots[0].truth.pose = random_place(world, rng, nullptr);
    int good = 0;
    wander(world, state, 400.0, [&](const RobotState& r) {
      good = error_m(r) < 0.15 ? good + 1 : 0;
      return good < 100;
    });
    found += good >= 100 ? 1 : 0;
    std::cout << GetParam() << ": seed " << seed << (good >= 100 ? " found after " : " lost for ")
              << seconds(state.time) - 20.0 << " s\n";
  }
  EXPECT_EQ(found, kSeeds);
}

INSTANTIATE_TEST_SUITE_P(Maps, Amcl, ::testing::Values("house", "nav2/depot.yaml", "aws_small_house/map.yaml"),
                         [](const auto& map) { return map.param.substr(0, map.param.find('/')); });

TEST(OdometryLocalization, IsExactWithoutNoise) {
  Loaded<World> house = test::load_house();
  ASSERT_TRUE(house.ok());
  State state = initial_state(*house.value, 1);
  Rng rng(2);
  drive(*house.value, state, rng, 120.0, [](const RobotState& robot) {
    EXPECT_LT(error_m(robot), 1e-6);
    return true;
  });
}

TEST(OdometryLocalization, DriftsWithNoiseAndIsTheSameForTheSameSeed) {
  Loaded<World> house = test::load_house();
  ASSERT_TRUE(house.ok());
  house.value->robots[0].odometry = {.scale = 0.03, .turn_scale = 0.02, .white = 0.1};
  const auto run = [&](std::uint64_t seed) {
    State state = initial_state(*house.value, seed);
    state.robots[0].command = {{0.2, 0.1}, TimePoint(std::chrono::hours(1000))};
    advance_by(*house.value, state, std::chrono::seconds(20));
    EXPECT_GT(error_m(state.robots[0]), 0.01);
    return state.hash();
  };
  EXPECT_EQ(run(1), run(1));
  EXPECT_NE(run(1), run(2));
}

// Two rooms that differ in one corner only: the filter is told the wrong one, and every particle is there.
TEST(AmclFilter, LeavesARoomThatLooksAlmostRight) {
  constexpr int kWidth = 160;
  constexpr int kHeight = 60;
  std::vector<std::int8_t> cells(kWidth * kHeight, 0);
  const auto wall = [&](int x0, int y0, int x1, int y1) {
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) cells[static_cast<std::size_t>(y * kWidth + x)] = 100;
    }
  };
  wall(0, 0, kWidth - 1, 0), wall(0, kHeight - 1, kWidth - 1, kHeight - 1);
  wall(0, 0, 0, kHeight - 1), wall(kWidth - 1, 0, kWidth - 1, kHeight - 1), wall(80, 0, 80, kHeight - 1);
  wall(20, 40, 28, 44), wall(100, 40, 108, 44);
  wall(150, 50, 158, 58);
  World world = noisy_world(GridMap(kWidth, kHeight, 0.05, {}, std::move(cells)), {5.0, 1.0, 0.0});
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    State state = initial_state(world, seed);
    RobotState& robot = state.robots[0];
    set_initial_pose(world.robots[0].localization, robot.localization, {.pose = {1.0, 1.0, 0.0}}, robot.odometry);
    wander(world, state, 120.0, [](const RobotState& r) { return error_m(r) > 0.15; });
    found += error_m(state.robots[0]) <= 0.15 ? 1 : 0;
  }
  EXPECT_EQ(found, 10);
}

TEST(AmclFilter, WithoutFreeFloorHasNothingToSearch) {
  const GridMap map(10, 10, 0.05, {}, std::vector<std::int8_t>(100, 100));
  Localization state = initial_localization(amcl(), {.pose = {0.2, 0.2, 0}}, Rng(1));
  const std::vector<Particle> before = state.particles;
  scatter_everywhere(amcl(), map, state);
  EXPECT_EQ(state.particles, before);
}

TEST(AmclFilter, FindsTheOnlyFreeCell) {
  std::vector<std::int8_t> cells(1'000'000, GridMap::kUnknown);
  cells[123'456] = 0;
  const GridMap map(1000, 1000, 0.05, {}, std::move(cells));
  LocalizationSpec spec = amcl();
  spec.particles_global = 50;
  Localization state = initial_localization(spec, {}, Rng(1));
  scatter_everywhere(spec, map, state);
  ASSERT_EQ(state.particles.size(), 50U);
  for (const Particle& p : state.particles) EXPECT_EQ(map.cell_at(p.pose.position()), (Cell{456, 123}));
}

TEST(AmclFilter, IsToldWhereItIs) {
  const GridMap map(100, 100, 0.05, {}, std::vector<std::int8_t>(10'000, 0));
  Localization state = initial_localization(amcl(), {.pose = {1, 1, 0}}, Rng(1));
  set_initial_pose(amcl(), state, {.pose = {3, 2, 1}, .covariance = {0.04, 0, 0, 0, 0.09, 0, 0, 0, 0.01}}, {5, 5, 2});
  const Pose2 pose = estimated_pose(state, {5, 5, 2});
  EXPECT_NEAR(pose.x, 3, 1e-12);
  EXPECT_NEAR(pose.y, 2, 1e-12);
  EXPECT_NEAR(pose.theta, 1, 1e-12);
  Vec2 mean;
  double spread_y = 0.0;
  for (const Particle& p : state.particles) mean = mean + p.weight * p.pose.position();
  for (const Particle& p : state.particles) spread_y += p.weight * (p.pose.y - mean.y) * (p.pose.y - mean.y);
  EXPECT_NEAR(mean.x, 3, 0.02);
  EXPECT_NEAR(std::sqrt(spread_y), 0.3, 0.03);
}

TEST(AmclFilter, StandsStillWhileTheRobotDoes) {
  World world = noisy_world(test_map("house").value(), {1.2, 1.2, 0});
  State state = initial_state(world, 1);
  const Localization before = state.robots[0].localization;
  advance_by(world, state, std::chrono::seconds(10));
  EXPECT_EQ(state.robots[0].localization, before);
}

}  // namespace
}  // namespace sentree::sim
