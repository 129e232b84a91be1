// Navigation beyond "go there": docking, straight drives, plans and maps, and what it says while it cannot.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/sim/detail/test_service_support.h"

namespace sentree::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class NavigationServices : public ::testing::Test, protected test::HouseServices {
 protected:
  std::string status() { return std::string(ask("Navigation", "getNavigationStatus").text()); }
  std::string failure() { return std::string(ask("Navigation", "getNavigationState").find("error_code")->text()); }
  // The status in which the goal ended; at most ten minutes.
  std::string wait() {
    for (int i = 0; i < 6000 && is_active(state_.robots[0].navigator.status); ++i) {
      now_ += 100ms;
      (void)status();
    }
    return status();
  }
  std::string code(std::string_view method, const Map& args = {}) {
    return std::string(ask("Navigation", method, args).find("code")->text());
  }
  const Pose2& truth() { return state_.robots[0].truth.pose; }
  static Value place(const Value& pose) { return Map{{"map_id", "house"}, {"pose", pose}, {"description", ""}}; }
};

TEST_F(NavigationServices, DocksWhereContactsChargeAndUndocksBackwards) {
  world_.stations[0].contacts = true;
  ask("Simulation", "setBatteryCharge", {{"percent", 50}});
  EXPECT_EQ(code("dockRobot", {{"station", "dock"}}), "OK");
  EXPECT_EQ(ask("Navigation", "getNameOfCurrentTarget").text(), "dock");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_TRUE(*ask("Battery", "isCharging").as_bool());
  const Pose2 docked = truth();
  EXPECT_EQ(code("undockRobot"), "OK");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_FALSE(*ask("Battery", "isCharging").as_bool());
  EXPECT_NEAR(relative(docked, truth()).x, -(world_.stations[0].linear_tolerance_m + 0.1), 0.03);
  EXPECT_EQ(state_.robots[0].truth.collisions, 0);
  EXPECT_EQ(code("undockRobot"), "NOT_READY");
}

TEST_F(NavigationServices, DockingSaysWhereItFailed) {
  const Value unknown = ask("Navigation", "dockRobot", {{"station", "quay"}});
  EXPECT_EQ(unknown.find("code")->text(), "UNKNOWN_NAME");
  EXPECT_EQ(unknown.find("error_code")->text(), "DOCK_NOT_IN_DB");
  ask("Navigation", "dockRobot", {{"station", "dock"}});
  EXPECT_EQ(wait(), "ABORTED") << "nobody plugs it in";
  EXPECT_EQ(failure(), "FAILED_TO_CHARGE");
  EXPECT_LT(distance(truth().position(), world_.stations[0].pose.position()), 0.1);
  ask("Simulation", "setRobotPose", {{"pose", pose(1.2, 1.2, 0)}});
  const auto wall = [&](const char* id, double x, double y, double x2, double y2) {
    ask("Simulation", "addWall",
        {{"id", id},
         {"a", Map{{"x", x}, {"y", y}}},
         {"b", Map{{"x", x2}, {"y", y2}}},
         {"thickness", 0.1},
         {"on_map", true}});
  };
  wall("a", 7.0, 4.2, 7.0, 5.8);
  wall("b", 9.5, 4.2, 9.5, 5.8);
  wall("c", 7.0, 4.25, 9.5, 4.25);
  wall("d", 7.0, 5.75, 9.5, 5.75);
  ask("Navigation", "dockRobot", {{"station", "dock"}});
  EXPECT_EQ(wait(), "ABORTED");
  EXPECT_EQ(failure(), "FAILED_TO_STAGE");
  EXPECT_THAT(std::string(ask("Navigation", "getNavigationState").find("error_msg")->text()),
              HasSubstr("the dock was not reached: no path leads"));
}

TEST_F(NavigationServices, DrivesStraightAndSpinsAndStopsBeforeWhatIsInTheWay) {
  ask("Simulation", "setRobotPose", {{"pose", pose(4.0, 5.0, 0.0)}});
  EXPECT_EQ(code("driveStraight", {{"distance", 1.0}}), "OK");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_NEAR(truth().x, 5.0, 0.05);
  EXPECT_EQ(code("driveStraight", {{"distance", -0.5}}), "OK");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_NEAR(truth().x, 4.5, 0.05);
  const TimePoint before = state_.time;
  EXPECT_EQ(code("driveStraightAt", {{"distance", 0.2}, {"speed", 0.05}}), "OK");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_NEAR(truth().x, 4.7, 0.05);
  EXPECT_GT(seconds(state_.time - before), 3.0) << "slowly";
  EXPECT_EQ(code("driveStraightAt", {{"distance", 0.2}, {"speed", -0.05}}), "OUT_OF_BOUNDS");
  EXPECT_EQ(code("spin", {{"angle", -7.0}}), "OK") << "more than a turn";
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_NEAR(wrap_angle(truth().theta + 7.0), 0.0, 0.1);
  ask("Simulation", "setRobotPose", {{"pose", pose(4.5, 5.0, 0.0)}});
  ask("Simulation", "addObstacle", {{"id", "box"}, {"centre", Map{{"x", 6.0}, {"y", 5.0}}}, {"radius", 0.2}});
  ask("Navigation", "driveStraight", {{"distance", 3.0}});
  EXPECT_EQ(wait(), "ABORTED");
  EXPECT_EQ(failure(), "COLLISION_AHEAD");
  EXPECT_EQ(state_.robots[0].truth.collisions, 0);
  EXPECT_EQ(code("spin", {{"angle", 1000.0}}), "OUT_OF_BOUNDS");
  EXPECT_EQ(code("driveStraight", {{"distance", 1e9}}), "OUT_OF_BOUNDS");
}

TEST_F(NavigationServices, APlanIsSaidWithoutDrivingIt) {
  const Value plan = ask("Navigation", "computePathTo", {{"target", place(pose(14.6, 8.8, 0.5))}});
  EXPECT_EQ(test::keys(&plan), test::fields("PlanReply"));
  EXPECT_EQ(plan.find("code")->text(), "OK");
  EXPECT_GT(plan.find("length")->number(), 15.0);
  EXPECT_EQ(plan.at({"path", "poses"})->as_list()->back().find("theta")->number(), 0.5);
  EXPECT_EQ(status(), "IDLE");
  ask("Simulation", "setDoor", {{"id", "kitchen_door"}, {"open", false}});
  const Value shut = ask("Navigation", "computePathTo", {{"target", place(pose(14.6, 8.8, 0.5))}});
  EXPECT_EQ(shut.find("code")->text(), "ERROR");
  EXPECT_EQ(shut.find("error_code")->text(), "NO_VALID_PATH");
  EXPECT_TRUE(shut.at({"path", "poses"})->as_list()->empty());
}

TEST_F(NavigationServices, APlanMayBeginElsewhere) {
  const Value plan =
      ask("Navigation", "computePathBetween", {{"start", pose(8.2, 5.2, 0)}, {"target", place(pose(14.6, 8.8, 0.5))}});
  EXPECT_EQ(plan.find("code")->text(), "OK");
  EXPECT_EQ(plan.at({"path", "poses"})->as_list()->front().find("x")->number(), 8.2);
  EXPECT_LT(plan.find("length")->number(), 12.0);
}

TEST_F(NavigationServices, APathIsValidWhileNothingKnownStandsOnIt) {
  const Value plan = ask("Navigation", "computePathTo", {{"target", place(pose(14.6, 8.8, 0.5))}});
  const Map path{{"path", *plan.find("path")}};
  EXPECT_EQ(ask("Navigation", "isPathValid", path), Value(true));
  ask("Simulation", "setDoor", {{"id", "kitchen_door"}, {"open", false}});
  EXPECT_EQ(ask("Navigation", "isPathValid", path), Value(false));
  EXPECT_EQ(
      ask("Navigation", "isPathValid", {{"path", Map{{"header", *plan.at({"path", "header"})}, {"poses", List{}}}}}),
      Value(false));
}

TEST_F(NavigationServices, TargetAndNextWaypointAreKnownWhileItDrives) {
  EXPECT_EQ(code("getAbsoluteLocationOfCurrentTarget"), "NOT_READY");
  EXPECT_EQ(code("getCurrentNavigationWaypoint"), "NOT_READY");
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
  now_ += 1s;
  const Value target = ask("Navigation", "getAbsoluteLocationOfCurrentTarget");
  EXPECT_EQ(target.at({"location", "pose", "x"})->number(), 14.6);
  EXPECT_EQ(target.at({"location", "description"})->text(), "kitchen");
  const Value ahead = ask("Navigation", "getRelativeLocationOfCurrentTarget");
  EXPECT_EQ(test::keys(&ahead), test::fields("PoseReply"));
  const Vec2 off{ahead.at({"pose", "x"})->number(), ahead.at({"pose", "y"})->number()};
  EXPECT_NEAR(norm(off), distance(truth().position(), {14.6, 8.8}), 1e-6);
  const Value corner = *ask("Navigation", "getCurrentNavigationWaypoint").at({"location", "pose"});
  const Value path = ask("Navigation", "getAllNavigationWaypoints");
  EXPECT_EQ(corner, path.find("poses")->as_list()->at(1));
}

TEST_F(NavigationServices, TheMapOfCostsShowsWhatWasSeenUntilItIsCleared) {
  ask("Simulation", "setRobotPose", {{"pose", pose(4.0, 5.0, 0.0)}});
  ask("Simulation", "addObstacle", {{"id", "box"}, {"centre", Map{{"x", 6.0}, {"y", 5.0}}}, {"radius", 0.2}});
  const auto cost = [&](double x, double y) {
    const Value reply = ask("Navigation", "getCurrentNavigationMap", {{"type", "GLOBAL"}});
    const Cell c = world_.map.cell_at({x, y});
    return static_cast<int>(
        static_cast<std::int8_t>(reply.at({"grid", "data"})->as_bytes()->octets[world_.map.index(c)]));
  };
  EXPECT_LT(cost(5.85, 5.0), 100);
  EXPECT_EQ(cost(0.1, 0.1), 100) << "a wall";
  ask("Navigation", "gotoTargetByRelativeLocation", {{"delta", pose(4.0, 0.0, 0.0)}});
  now_ += 1s;
  EXPECT_EQ(cost(5.85, 5.0), 100);
  const Value local = ask("Navigation", "getCurrentNavigationMap", {{"type", 1}});
  EXPECT_EQ(test::keys(&local), test::fields("OccupancyGridReply"));
  const double width = local.at({"grid", "info", "width"})->number();
  EXPECT_EQ(width, 2 * 60 + 1) << "3 m to each side";
  EXPECT_EQ(local.at({"grid", "data"})->as_bytes()->octets.size(),
            static_cast<std::size_t>(width * local.at({"grid", "info", "height"})->number()));
  ask("Simulation", "removeObstacle", {{"id", "box"}});
  ask("Navigation", "stopNavigation", {{"goal_id", 0}});
  ask("Navigation", "clearCurrentNavigationMap");
  EXPECT_LT(cost(5.85, 5.0), 100);
  EXPECT_THAT(error("Navigation", "getCurrentNavigationMap", {{"type", "ROUND"}}),
              HasSubstr("type is \"ROUND\"; GLOBAL or LOCAL is expected"));
}

TEST_F(NavigationServices, NearAndInsideAreAnsweredForGivenPlacesToo) {
  EXPECT_EQ(ask("Navigation", "findCurrentArea").text(), "");
  const auto near = [&](const Value& location, double linear) {
    return *ask("Navigation", "checkNearToGivenLocation",
                {{"location", location}, {"linear_tolerance", linear}, {"angular_tolerance", 7.0}})
                .as_bool();
  };
  EXPECT_TRUE(near(place(pose(1.3, 1.2, 0)), 0.11));
  EXPECT_FALSE(near(place(pose(1.3, 1.2, 0)), 0.09));
  EXPECT_FALSE(near(Map{{"map_id", "moon"}, {"pose", pose(1.2, 1.2, 0)}}, 0.5));
  const auto inside = [&](double x) {
    const List points{Map{{"x", 0}, {"y", 0}}, Map{{"x", x}, {"y", 0}}, Map{{"x", 0}, {"y", x}}};
    return *ask("Navigation", "checkInsideGivenArea", {{"area", Map{{"map_id", ""}, {"points", points}}}}).as_bool();
  };
  EXPECT_TRUE(inside(3.0));
  EXPECT_FALSE(inside(2.0));
  ask("Simulation", "setRobotPose", {{"pose", pose(4.0, 5.0, 0.0)}});
  EXPECT_EQ(ask("Navigation", "findCurrentArea").text(), "corridor");
}

TEST_F(NavigationServices, ARobotThatIsLostLooksAroundFirst) {
  world_.robots[0].localization.method = LocalizationSpec::Method::kAmcl;
  state_ = initial_state(world_, 1);
  EXPECT_EQ(ask("Localization", "reinitializeGlobalLocalization").text(), "OK");
  ask("Navigation", "gotoTargetByLocationName", {{"name", "bedroom"}});
  now_ += 200ms;
  EXPECT_EQ(status(), "PREPARING_BEFORE_MOVE");
  EXPECT_EQ(wait(), "GOAL_REACHED");
  EXPECT_LT(distance(truth().position(), {8.7, 2.5}), 0.3);
}

TEST_F(NavigationServices, WithoutLocalizationAGoalEndsInAnErrorOfTheRobot) {
  EXPECT_EQ(ask("Localization", "stopLocalizationService").text(), "OK");
  EXPECT_EQ(ask("Localization", "getLocalizationStatus").text(), "ERROR");
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
  EXPECT_EQ(wait(), "ERROR");
  EXPECT_EQ(failure(), "TF_ERROR");
  EXPECT_EQ(ask("Localization", "startLocalizationService").text(), "OK");
  EXPECT_EQ(ask("Localization", "getLocalizationStatus").text(), "LOCALIZED_OK");
  ask("Navigation", "gotoTargetByRelativeLocation", {{"delta", pose(0.5, 0.0, 0.0)}});
  EXPECT_EQ(wait(), "GOAL_REACHED");
}

}  // namespace
}  // namespace sentree::sim
