// The recharge mission's numbers on the world that the example ships: what its scenarios rely on.

#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <string>

#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

const World& house() {
  static const World kWorld = [] {
    Loaded<World> loaded = load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
    for (const Diagnostic& d : loaded.diagnostics) std::cerr << to_string(d) << '\n';
    return loaded.ok() ? *std::move(loaded.value) : World{};
  }();
  return kWorld;
}

// Plays the mission's part at 10 Hz: calls, and lets time pass.
class Recharge : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(house().robots.empty());
    state_ = initial_state(house(), 1);
  }
  Value ask(std::string_view service, std::string_view method, const Map& args = {}) {
    const auto result = call(house(), state_, {.service = service, .method = method, .args = args}, now_);
    EXPECT_TRUE(result) << (result ? "" : to_string(result.error()));
    return result ? *result : Value();
  }
  std::int64_t go(const std::string& name) {
    const Value reply = ask("Navigation", "gotoTargetByLocationName", {{"name", name}});
    EXPECT_EQ(reply.find("code")->text(), "OK");
    return *reply.find("goal_id")->as_int();
  }
  double charge() { return ask("Battery", "getBatteryCharge").number(); }
  bool is_near(const std::string& name) {
    return *ask("Navigation", "checkNearToLocation",
                {{"name", name}, {"linear_tolerance", 0.3}, {"angular_tolerance", 0.2}})
                .as_bool();
  }
  std::string status() { return std::string(ask("Navigation", "getNavigationStatus").text()); }
  // Seconds until `done`, asked every tick; fails after `limit_s`.
  double wait(const std::function<bool()>& done, double limit_s) {
    const TimePoint start = now_;
    while (!done()) {
      now_ += std::chrono::milliseconds(100);
      if (seconds(now_ - start) > limit_s) {
        ADD_FAILURE() << "nothing came of it within " << limit_s << " s; "
                      << to_json(ask("Navigation", "getNavigationState"));
        break;
      }
    }
    return seconds(now_ - start);
  }

  State state_;
  TimePoint now_{};
};

TEST_F(Recharge, ReachesTheKitchenInAboutAMinute) {
  go("kitchen");
  const double s = wait([&] { return is_near("kitchen"); }, 120);
  RecordProperty("seconds", std::to_string(s));
  std::cout << "start to kitchen: " << s << " s, charge " << charge() << " %\n";
  EXPECT_GT(s, 40);
  EXPECT_LT(s, 90);
  wait([&] { return status() == "GOAL_REACHED"; }, 30);
  EXPECT_EQ(state_.robots[0].truth.collisions, 0);
}

TEST_F(Recharge, StoryHasRoomForItsMonitors) {
  ask("Simulation", "setBatteryCharge", {{"percent", 40.0}});
  go("kitchen");
  const double low = wait([&] { return charge() < 30.0; }, 120);
  EXPECT_FALSE(is_near("kitchen"));
  go("station");
  const double there = wait([&] { return is_near("station"); }, 60);
  const double lowest = charge();
  EXPECT_GT(lowest, 22.0);
  ask("Navigation", "stopNavigation", {{"goal_id", 0}});
  now_ += std::chrono::seconds(5);
  EXPECT_EQ(*ask("Battery", "isCharging").as_bool(), false);
  EXPECT_EQ(ask("Simulation", "plugIn").text(), "OK");
  EXPECT_EQ(*ask("Battery", "isCharging").as_bool(), true);
  const double full = wait([&] { return !*ask("Battery", "isCharging").as_bool(); }, 200);
  EXPECT_GT(full, 60);
  EXPECT_LT(full, 120);
  EXPECT_EQ(charge(), 100.0);
  now_ += std::chrono::seconds(30);
  EXPECT_EQ(charge(), 100.0) << "full stays full at the station";
  go("kitchen");
  const double rest = wait([&] { return is_near("kitchen"); }, 120);
  EXPECT_LT(charge(), 100.0);
  std::cout << "below 30 % after " << low << " s, station after " << there << " s more at " << lowest
            << " %, full after " << full << " s, kitchen after " << rest << " s, total " << seconds(now_) << " s\n";
}

TEST_F(Recharge, TwentyFivePercentLastsFifteenSecondsOfDriving) {
  go("kitchen");
  now_ += std::chrono::seconds(10);
  ask("Simulation", "setBatteryCharge", {{"percent", 25.0}});
  now_ += std::chrono::seconds(15);
  EXPECT_GT(charge(), 20.0);
}

TEST_F(Recharge, AWalledOffKitchenIsAnErrorBeforeTheNextTick) {
  const Map door{{"id", "kitchen_door"}, {"open", false}};
  EXPECT_EQ(ask("Simulation", "setDoor", door).text(), "OK");
  const std::int64_t id = go("kitchen");
  now_ += std::chrono::milliseconds(100);
  const Value state = ask("Navigation", "getNavigationState");
  EXPECT_EQ(state.find("status")->text(), "ABORTED");
  EXPECT_EQ(state.find("error_code")->text(), "NO_VALID_PATH");
  EXPECT_EQ(*state.find("goal_id")->as_int(), id);
}

TEST_F(Recharge, AWallAcrossTheDoorDoesTheSame) {
  const Map wall{{"id", "wall"},
                 {"a", Map{{"x", 11.0}, {"y", 5.75}}},
                 {"b", Map{{"x", 12.4}, {"y", 5.75}}},
                 {"thickness", 0.2},
                 {"on_map", true}};
  EXPECT_EQ(ask("Simulation", "addWall", wall).text(), "OK");
  go("kitchen");
  now_ += std::chrono::milliseconds(100);
  EXPECT_EQ(ask("Navigation", "getNavigationState").find("error_code")->text(), "NO_VALID_PATH");
}

TEST_F(Recharge, TolerancesNest) {
  const Tolerances goal = navigation_tolerances(house());
  const auto station = station_tolerances(house());
  ASSERT_TRUE(station);
  EXPECT_LE(goal.linear_m, 0.3);
  EXPECT_LE(goal.angular_rad, 0.2);
  EXPECT_LT(0.3, station->linear_m);
  EXPECT_LT(0.2, station->angular_rad);
}

TEST_F(Recharge, SameSeedSameStateWhateverTheCallsBetween) {
  State other = state_;
  const Map kitchen{{"name", "kitchen"}};
  go("kitchen");
  ASSERT_TRUE(
      call(house(), other, {.service = "Navigation", .method = "gotoTargetByLocationName", .args = kitchen}, now_));
  for (int i = 0; i < 300; ++i) {
    now_ += std::chrono::milliseconds(33);
    advance(house(), state_, now_);
  }
  advance(house(), other, now_);
  EXPECT_EQ(state_, other);
  EXPECT_EQ(state_.hash(), other.hash());
  const auto restored = restore(house(), save(state_));
  ASSERT_TRUE(restored) << restored.error().message;
  EXPECT_EQ(*restored, state_);
}

}  // namespace
}  // namespace sentree::sim
