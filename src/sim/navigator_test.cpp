#include "sentree/sim/navigator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>
#include <set>
#include <utility>

#include "sentree/sim/astar.h"
#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

using namespace std::chrono_literals;

constexpr NavigationError kNone = NavigationError::kNone;

// An empty hall of 8 m x 6 m with a wall around it, and a robot in it.
class Hall : public ::testing::Test {
 protected:
  Hall() : Hall(hall()) {}
  explicit Hall(GridMap map)
      : world_(test::world_around(std::move(map), {1.0, 3.0, 0.0})), state_(initial_state(world_, 1)) {}

  static GridMap hall() {
    Rng rng(1);
    return test::random_map(rng, 160, 120, 0, true);
  }
  std::int64_t go(const Pose2& goal) { return go(std::vector<Pose2>{goal}); }
  std::int64_t go(std::vector<Pose2> goals) {
    return start_goal(world_.robots[0].navigation, navigator(), "", std::move(goals), state_.time);
  }
  // Until the goal ended; at most 200 s.
  NavigationStatus wait() {
    for (int i = 0; i < 2000 && is_active(navigator().status); ++i) advance_by(world_, state_, 100ms);
    return navigator().status;
  }
  void pass(Duration time) { advance_by(world_, state_, time); }
  Navigator& navigator() { return state_.robots[0].navigator; }
  GroundTruth& truth() { return state_.robots[0].truth; }
  void put(std::string id, Shape shape, bool on_map = false) {
    state_.obstacles.push_back({std::move(id), shape, on_map});
  }

  World world_;
  State state_;
};

TEST_F(Hall, GoalIsReachedWithinItsTolerancesStanding) {
  const Pose2 goal{6.5, 4.5, -2.0};
  go(goal);
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_LE(distance(truth().pose.position(), goal.position()), 0.10);
  EXPECT_LE(std::abs(wrap_angle(truth().pose.theta - goal.theta)), 0.05);
  pass(2s);
  EXPECT_EQ(truth().twist, Twist2{});
  EXPECT_LE(distance(truth().pose.position(), goal.position()), 0.10);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, StatusOfTheLastGoalStaysUntilTheNext) {
  const std::int64_t first = go({1.5, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  pass(60s);
  EXPECT_EQ(navigator().status, NavigationStatus::kGoalReached);
  EXPECT_EQ(navigator().goal.id, first);
  EXPECT_EQ(go({6.0, 3.0, 0.0}), first + 1);
  EXPECT_EQ(navigator().status, NavigationStatus::kThinking);
}

TEST_F(Hall, StopEndsOnlyTheGoalOfItsId) {
  const std::int64_t first = go({6.0, 3.0, 0.0});
  pass(1s);
  const std::int64_t second = go({6.0, 1.5, 0.0});
  EXPECT_FALSE(stop_goal(navigator(), first, state_.time));
  pass(1s);
  EXPECT_EQ(navigator().status, NavigationStatus::kMoving);
  EXPECT_TRUE(stop_goal(navigator(), second, state_.time));
  EXPECT_EQ(navigator().status, NavigationStatus::kIdle);
  pass(2s);
  EXPECT_EQ(truth().twist, Twist2{});
  go({6.0, 3.0, 0.0});
  EXPECT_TRUE(stop_goal(navigator(), 0, state_.time)) << "0 stops whichever runs";
  EXPECT_FALSE(stop_goal(navigator(), 0, state_.time)) << "none does now";
}

TEST_F(Hall, SuspendStopsUntilResumedOrItsTimeIsOver) {
  go({6.0, 3.0, 0.0});
  pass(3s);
  ASSERT_TRUE(suspend(navigator(), state_.time, kNever));
  pass(2s);
  const Pose2 there = truth().pose;
  pass(100s);
  EXPECT_EQ(truth().pose, there);
  EXPECT_EQ(navigator().status, NavigationStatus::kPaused);
  ASSERT_TRUE(resume(navigator(), state_.time));
  pass(1s);
  EXPECT_EQ(navigator().status, NavigationStatus::kMoving);
  ASSERT_TRUE(suspend(navigator(), state_.time, state_.time + 5s));
  pass(4s);
  EXPECT_EQ(navigator().status, NavigationStatus::kPaused);
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_FALSE(suspend(navigator(), state_.time, kNever));
  EXPECT_FALSE(resume(navigator(), state_.time));
}

TEST_F(Hall, WaypointsAreVisitedInOrder) {
  const std::vector<Pose2> points{{2.0, 1.0, 0.0}, {6.0, 1.0, 0.0}, {6.0, 5.0, 0.0}, {2.0, 5.0, 1.0}};
  go(points);
  std::size_t next = 0;
  for (int i = 0; i < 2000 && is_active(navigator().status); ++i) {
    pass(100ms);
    if (next < points.size() && distance(truth().pose.position(), points[next].position()) < 0.3) ++next;
  }
  EXPECT_EQ(navigator().status, NavigationStatus::kGoalReached);
  EXPECT_EQ(next, points.size());
}

TEST_F(Hall, GoesAroundWhatItSeesOnTheWay) {
  put("box", Shape::box({4.0, 3.0, 0.3}, 0.6, 2.0));
  go({7.0, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_EQ(truth().collisions, 0);
  EXPECT_GT(navigator().seen.size(), 0U);
}

TEST_F(Hall, ForgetsAnObstacleThatIsGone) {
  put("box", Shape::box({3.0, 3.0, 0.0}, 0.4, 1.0));
  go({7.0, 3.0, 0.0});
  pass(2s);
  EXPECT_GT(navigator().seen.size(), 0U);
  state_.obstacles.clear();
  pass(1s);
  EXPECT_EQ(navigator().seen.size(), 0U);
}

TEST_F(Hall, WaitsAtABarrierAndGoesOnWhenItOpens) {
  put("barrier", Shape::wall({4.0, 0.0}, {4.0, 6.0}, 0.1));
  go({7.0, 3.0, 0.0});
  // It looks for a way along the barrier, as far as it has not seen all of it.
  for (int i = 0; i < 600 && navigator().status != NavigationStatus::kWaitingObstacle; ++i) pass(100ms);
  EXPECT_EQ(navigator().status, NavigationStatus::kWaitingObstacle);
  state_.obstacles.clear();
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, GivesUpAtABarrierThatStaysAndNamesTheReason) {
  put("barrier", Shape::wall({4.0, 0.0}, {4.0, 6.0}, 0.1));
  go({7.0, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kAborted);
  EXPECT_EQ(navigator().error, NavigationError::kNoValidPath);
  EXPECT_EQ(navigator().recoveries, world_.robots[0].navigation.recoveries_max);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, KnownBarrierIsNoPathAtOnce) {
  put("barrier", Shape::wall({4.0, 0.0}, {4.0, 6.0}, 0.1), true);
  go({7.0, 3.0, 0.0});
  pass(100ms);
  EXPECT_EQ(navigator().status, NavigationStatus::kAborted);
  EXPECT_EQ(navigator().error, NavigationError::kNoValidPath);
}

TEST_F(Hall, GoalsThatCannotBeAreNamed) {
  const auto error = [&](const Pose2& goal) {
    go(goal);
    pass(100ms);
    EXPECT_EQ(navigator().status, NavigationStatus::kAborted);
    EXPECT_FALSE(navigator().error_message.empty());
    return navigator().error;
  };
  EXPECT_EQ(error({100.0, 3.0, 0.0}), NavigationError::kGoalOutsideMap);
  EXPECT_EQ(error({0.02, 3.0, 0.0}), NavigationError::kGoalOccupied);
  world_.robots[0].navigation.plan_expansions_max = 10;
  EXPECT_EQ(error({7.0, 3.0, 0.0}), NavigationError::kPlanTimeout);
  world_.robots[0].navigation.goal_time_max = 2s;
  world_.robots[0].navigation.plan_expansions_max = 1'000'000;
  go({7.0, 3.0, 0.0});
  wait();
  EXPECT_EQ(navigator().error, NavigationError::kTimeout);
}

TEST_F(Hall, LeavesAStartInsideTheInflationOfAWall) {
  // The reference deployment starts 0.20 m from an occupied cell with a robot that keeps 0.30 m.
  const Pose2 start{0.05 + 0.23, 3.0, 0.0};
  ASSERT_EQ(world_.robots[0].costs.at(world_.map.cell_at(start.position())), CostGrid::kBlocked);
  world_.robots[0].start = start;
  state_ = initial_state(world_, 1);
  go({5.0, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, KeepsVelocityAndAccelerationWithinLimits) {
  const MotionLimits limits = world_.robots[0].limits;
  go({6.5, 5.0, 3.0});
  Twist2 before;
  while (is_active(navigator().status)) {
    pass(world_.step);
    const Twist2 now = truth().twist;
    EXPECT_LE(std::abs(now.vx), limits.speed_m_s + 1e-12);
    EXPECT_LE(std::abs(now.omega), limits.turn_rad_s + 1e-12);
    EXPECT_LE(std::abs(now.vx - before.vx), limits.acceleration_m_s2 * 0.02 + 1e-12);
    EXPECT_LE(std::abs(now.omega - before.omega), limits.turn_acceleration_rad_s2 * 0.02 + 1e-12);
    before = now;
  }
}

// A wall with a gap through which the robot just fits, by the map. Two posts beside it are too near to the wall to be
// told from it, and leave too little: the plan holds and every command is refused.
class Gap : public Hall {
 protected:
  Gap() : Hall(map()) {
    world_.robots[0].radius_m = 0.25;
    derive(world_, world_.robots[0]);
  }
  static GridMap map() {
    GridMap open = hall();
    std::vector<std::int8_t> cells = open.cells();
    for (int y = 0; y < open.height(); ++y) {
      if (y < 53 || y >= 67) cells[open.index({80, y})] = 100;
    }
    return {open.width(), open.height(), open.resolution_m(), open.origin(), std::move(cells)};
  }
};

TEST_F(Gap, IsPassedWhereItIsFree) {
  go({7.0, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kGoalReached);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Gap, ThatNoCommandFitsThroughIsNoValidControl) {
  put("post", Shape::box({4.025, 2.695, 0.0}, 0.04, 0.10));
  put("other", Shape::box({4.025, 3.305, 0.0}, 0.04, 0.10));
  go({7.0, 3.0, 0.0});
  EXPECT_EQ(wait(), NavigationStatus::kAborted);
  EXPECT_EQ(navigator().error, NavigationError::kNoValidControl);
  EXPECT_EQ(navigator().recoveries, world_.robots[0].navigation.recoveries_max);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, RecoversByTurningWaitingAndBackingUp) {
  put("barrier", Shape::wall({4.0, 0.0}, {4.0, 6.0}, 0.1));
  world_.robots[0].navigation.recoveries_max = 7;
  go({7.0, 3.0, 0.0});
  std::set<std::pair<double, double>> recoveries;
  for (int i = 0; i < 20'000 && is_active(navigator().status); ++i) {
    pass(20ms);
    if (state_.time < navigator().recovering_until)
      recoveries.insert({navigator().recovery.vx, navigator().recovery.omega});
  }
  EXPECT_EQ(recoveries, (std::set<std::pair<double, double>>{{0.0, 0.0}, {0.0, 0.5}, {-0.1, 0.0}}));
  EXPECT_EQ(navigator().status, NavigationStatus::kAborted);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(Hall, TwoRobotsPassEachOther) {
  RobotSpec other = world_.robots[0];
  other.name = "other";
  other.start = {7.0, 3.0, 3.1};
  world_.robots.push_back(other);
  state_ = initial_state(world_, 1);
  go({7.0, 3.0, 0.0});
  start_goal(other.navigation, state_.robots[1].navigator, "", {{1.0, 3.0, 0.0}}, state_.time);
  for (int i = 0; i < 3000 && (is_active(navigator().status) || is_active(state_.robots[1].navigator.status)); ++i)
    pass(100ms);
  EXPECT_EQ(navigator().status, NavigationStatus::kGoalReached);
  EXPECT_EQ(state_.robots[1].navigator.status, NavigationStatus::kGoalReached);
  EXPECT_EQ(truth().collisions + state_.robots[1].truth.collisions, 0);
}

// Missions of one robot among obstacles that the map does not know: no touch, and every one ends with a name.
class Missions : public ::testing::Test {
 protected:
  // Sends the robot to `goals` random places of `map`, past `obstacles` at others.
  void drive(const GridMap& map, Rng& rng, std::uint64_t seed, int goals, int obstacles) {
    World world = test::world_around(map, {});
    const CostGrid& costs = world.robots[0].costs;
    const auto open_place = [&] {
      for (;;) {
        const Cell c{static_cast<int>(rng.below(static_cast<std::uint64_t>(map.width()))),
                     static_cast<int>(rng.below(static_cast<std::uint64_t>(map.height())))};
        if (costs.at(c) == CostGrid::kBlocked) continue;
        const Vec2 p = map.centre(c);
        return Pose2{p.x, p.y, rng.uniform(-3.0, 3.0)};
      }
    };
    world.robots[0].start = open_place();
    State state = initial_state(world, seed);
    for (int i = 0; i < obstacles; ++i) {
      const Pose2 pose = open_place();
      if (distance(pose.position(), world.robots[0].start.position()) < 1.0) continue;
      state.obstacles.push_back({std::to_string(i), i % 2 == 0 ? Shape::disc(pose.position(), rng.uniform(0.1, 0.4))
                                                               : Shape::box(pose, rng.uniform(0.1, 1.0), 0.2)});
    }
    Navigator& navigator = state.robots[0].navigator;
    for (int g = 0; g < goals; ++g) {
      start_goal(world.robots[0].navigation, navigator, "", {open_place()}, state.time);
      for (int i = 0; i < 9100 && is_active(navigator.status); ++i) advance_by(world, state, 100ms);
      ASSERT_FALSE(is_active(navigator.status)) << "seed " << seed << " goal " << g;
      const bool reached = navigator.status == NavigationStatus::kGoalReached;
      EXPECT_TRUE(reached || navigator.error != kNone) << "seed " << seed << " goal " << g;
      ++ends_[reached ? "reached" : std::to_string(static_cast<int>(navigator.error))];
      EXPECT_EQ(state.robots[0].truth.collisions, 0) << "seed " << seed << " goal " << g;
      state.robots[0].truth.collisions = 0;
    }
  }
  void tell() const {
    for (const auto& [end, count] : ends_) std::cout << end << ": " << count << '\n';
  }
  std::map<std::string, int> ends_;
};

TEST_F(Missions, ThousandRandomOnesEndWithoutCollision) {
  constexpr std::uint64_t kSeed = 1000;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  for (std::uint64_t w = 0; w < 100; ++w) {
    const GridMap map = test::random_map(rng, 120, 100, 6 + static_cast<int>(rng.below(10)), true);
    drive(map, rng, kSeed + w, 10, 3);
  }
  tell();
  EXPECT_GT(ends_["reached"], 700);
}

TEST_F(Missions, OnRealMapsEndWithoutCollision) {
  const auto folder = test::real_maps();
  if (!folder) GTEST_SKIP() << "no real maps: set SENTREE_TEST_MAPS to a folder of them";
  constexpr std::uint64_t kSeed = 2000;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  for (const char* file : {"nav2/depot.yaml", "aws_small_house/map.yaml", "turtlebot3_world/map.yaml"}) {
    SCOPED_TRACE(file);
    const Loaded<GridMap> map = test::load_map(*folder / file);
    ASSERT_TRUE(map.ok());
    for (std::uint64_t w = 0; w < 4; ++w) drive(cropped_to_known(*map.value), rng, kSeed + w, 10, 8);
  }
  tell();
  EXPECT_GT(ends_["reached"], 60) << "of 120; some places of these maps are shut off";
}

}  // namespace
}  // namespace sentree::sim
