#include "sentree/sim/services.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>

#include "sentree/sim/detail/test_service_support.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class Services : public ::testing::Test, protected test::HouseServices {};
using test::fields;
using test::idl;
using test::keys;

TEST_F(Services, AreExactlyThoseOfTheIdl) {
  const std::string source = idl();
  const std::regex service(R"(service\s+(\w+)\s*\{([^}]*)\})");
  // A method's name stands between its result's type and the parenthesis that opens the parameters.
  const std::regex method(R"((?:\w|>)\s+(\w+)\s*\((?:[^()]|\([^()]*\))*\))");
  std::size_t count = 0;
  for (std::sregex_iterator i(source.begin(), source.end(), service), end; i != end; ++i) {
    if ((*i)[1] == "Telemetry") continue;  // it is published, and nobody calls it
    ++count;
    const ServiceInfo* info = find_service((*i)[1].str());
    ASSERT_NE(info, nullptr) << (*i)[1];
    const std::string body = (*i)[2];
    std::vector<std::string_view> names;
    std::vector<std::string> held;
    for (std::sregex_iterator m(body.begin(), body.end(), method), none; m != none; ++m) held.push_back((*m)[1]);
    for (const std::string& name : held) names.push_back(name);
    EXPECT_EQ(info->methods, names) << info->name;
    EXPECT_EQ(info->is_test_control, info->name == "Simulation");
  }
  EXPECT_EQ(count, services().size());
}

TEST_F(Services, StructsHaveTheFieldsOfTheIdlInItsOrder) {
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
  now_ += 1s;
  const Value navigation = ask("Navigation", "getNavigationState");
  EXPECT_EQ(keys(&navigation), fields("NavigationState"));
  EXPECT_EQ(keys(navigation.find("target")), fields("Location"));
  EXPECT_EQ(keys(navigation.at({"target", "pose"})), fields("Pose2D"));
  const Value battery = ask("Battery", "getBatteryState");
  EXPECT_EQ(keys(&battery), fields("BatteryState"));
  EXPECT_EQ(keys(battery.find("header")), fields("Header"));
  const Value position = ask("Localization", "getCurrentPosition");
  EXPECT_EQ(keys(&position), fields("PoseWithCovariance"));
  EXPECT_EQ(position.find("covariance")->as_list()->size(), 9U);
  const Value odometry = ask("Base", "getOdometry");
  EXPECT_EQ(keys(&odometry), fields("Odometry"));
  EXPECT_EQ(keys(odometry.find("twist")), fields("Twist2D"));
  const Value scan = ask("Laser", "getLaserMeasurement");
  EXPECT_EQ(keys(&scan), fields("LaserScan"));
  EXPECT_EQ(scan.find("ranges")->as_list()->size(), 360U);
  const Value map = ask("MapServer", "getMap", {{"map_id", ""}});
  EXPECT_EQ(keys(&map), fields("OccupancyGridReply"));
  EXPECT_EQ(keys(map.find("grid")), fields("OccupancyGrid"));
  EXPECT_EQ(keys(map.at({"grid", "info"})), fields("MapInfo"));
  EXPECT_EQ(map.at({"grid", "data"})->as_bytes()->octets.size(), 320U * 200U);
  const Value location = ask("MapServer", "getLocation", {{"name", "dock"}});
  EXPECT_EQ(keys(&location), fields("LocationReply"));
  EXPECT_EQ(location.find("code")->text(), "UNKNOWN_NAME");
  const Value area = ask("MapServer", "getArea", {{"name", "corridor"}});
  EXPECT_EQ(keys(&area), fields("AreaReply"));
  EXPECT_EQ(keys(area.find("area")), fields("Area"));
  const Value path = ask("Navigation", "getAllNavigationWaypoints");
  EXPECT_EQ(keys(&path), fields("Path"));
  EXPECT_GT(path.find("poses")->as_list()->size(), 2U);
  const Value poses = ask("Localization", "getEstimatedPoses");
  EXPECT_EQ(keys(&poses.as_list()->at(0)), fields("PoseStamped"));
  const Value reply = ask("Navigation", "followPath", {{"path", Map{{"poses", List{}}}}});
  EXPECT_EQ(keys(&reply), fields("GoalReply"));
}

TEST_F(Services, GoalsAreJudgedAndStoppedByTheirIds) {
  EXPECT_EQ(*ask("Navigation", "getNavigationState").find("goal_id")->as_int(), 0);
  const std::int64_t kitchen =
      *ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}}).find("goal_id")->as_int();
  now_ += 2s;
  const std::int64_t station =
      *ask("Navigation", "gotoTargetByLocationName", {{"name", "station"}}).find("goal_id")->as_int();
  EXPECT_EQ(station, kitchen + 1);
  // The halted leaf stops its goal after the new leaf has set its own.
  EXPECT_EQ(ask("Navigation", "stopNavigation", {{"goal_id", kitchen}}).text(), "OK");
  now_ += 1s;
  EXPECT_EQ(ask("Navigation", "getNavigationStatus").text(), "MOVING");
  EXPECT_EQ(ask("Navigation", "getNameOfCurrentTarget").text(), "station");
  EXPECT_EQ(ask("Navigation", "stopNavigation", {{"goal_id", static_cast<double>(station)}}).text(), "OK");
  EXPECT_EQ(ask("Navigation", "getNavigationStatus").text(), "IDLE");
  EXPECT_EQ(ask("Navigation", "getNameOfCurrentTarget").text(), "");
}

TEST_F(Services, UnknownDestinationIsSaidInTheReply) {
  const Value reply = ask("Navigation", "gotoTargetByLocationName", {{"name", "cellar"}});
  EXPECT_EQ(reply.find("code")->text(), "UNKNOWN_NAME");
  EXPECT_EQ(reply.find("error_code")->text(), "GOAL_REJECTED");
  EXPECT_EQ(ask("Navigation", "getNavigationStatus").text(), "IDLE");
}

TEST_F(Services, AnAreaIsEnteredAtAPlaceWhereOneCanStand) {
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen_area"}});
  for (int i = 0; i < 200 && ask("Navigation", "getNavigationStatus").text() != "GOAL_REACHED"; ++i) now_ += 1s;
  EXPECT_EQ(ask("Navigation", "getNavigationStatus").text(), "GOAL_REACHED");
  EXPECT_TRUE(*ask("Navigation", "checkInsideArea", {{"area_name", "kitchen_area"}}).as_bool());
  EXPECT_FALSE(*ask("Navigation", "checkInsideArea", {{"area_name", "corridor"}}).as_bool());
}

TEST_F(Services, RelativeAndAbsoluteGoalsAreFromHereAndOnTheMap) {
  ask("Navigation", "gotoTargetByRelativeLocation", {{"delta", pose(0.5, 0.0, 0.0)}});
  const Value target = *ask("Navigation", "getNavigationState").at({"target", "pose"});
  EXPECT_NEAR(target.find("x")->number(), 1.2 + 0.5 * std::sqrt(0.5), 1e-9);
  const Map elsewhere{{"target", Map{{"map_id", "other"}, {"pose", pose(1, 1, 0)}, {"description", ""}}}};
  EXPECT_EQ(ask("Navigation", "gotoTargetByAbsoluteLocation", elsewhere).find("code")->text(), "UNKNOWN_NAME");
  const Map here{{"target", Map{{"map_id", "house"}, {"pose", pose(1.2, 1.2, 0)}, {"description", ""}}}};
  EXPECT_EQ(ask("Navigation", "gotoTargetByAbsoluteLocation", here).find("code")->text(), "OK");
  now_ += 5s;
  EXPECT_EQ(ask("Navigation", "getNavigationStatus").text(), "GOAL_REACHED");
}

TEST_F(Services, WrongCallsAreErrorsWithAWayOut) {
  EXPECT_EQ(error("Batery", "isCharging"),
            "sim.unknown-service: the simulator has no service \"Batery\"; did you mean \"Battery\"?");
  EXPECT_EQ(error("Battery", "isCharged"),
            "sim.unknown-method: service Battery has no method \"isCharged\"; did you mean \"isCharging\"?");
  EXPECT_EQ(error("Navigation", "gotoTargetByLocationName"),
            "sim.bad-argument: Navigation.gotoTargetByLocationName: name is missing; a string is expected");
  EXPECT_EQ(error("Navigation", "stopNavigation", {{"goal_id", 1.5}}),
            "sim.bad-argument: Navigation.stopNavigation: goal_id is 1.5; a whole number is expected");
  EXPECT_THAT(error("Simulation", "setRobotPose", {{"pose", pose(1, std::numeric_limits<double>::infinity(), 0)}}),
              HasSubstr("pose.y is \"Infinity\"; a finite number is expected"));
  EXPECT_THAT(
      error("Localization", "setInitialPose", {{"pose", Map{{"pose", pose(1, 1, 0)}, {"covariance", List{1.0}}}}}),
      HasSubstr("a list of 9 numbers"));
  EXPECT_EQ(call(world_, state_, {.service = "Battery", .method = "isCharging", .args = {}, .robot = "robo"}, now_)
                .error()
                .message,
            "the world has no robot \"robo\"; did you mean \"robot\"?");
}

TEST_F(Services, BatteryChargesOnlyPluggedInAtTheStationAndStaysFull) {
  EXPECT_EQ(ask("Simulation", "plugIn").text(), "NOT_READY");
  ask("Simulation", "setRobotPose", {{"pose", pose(8.2, 5.2, 1.5)}});
  ask("Simulation", "setBatteryCharge", {{"percent", 10}});
  now_ += 1s;
  Value battery = ask("Battery", "getBatteryState");
  EXPECT_EQ(battery.find("power_supply_status")->text(), "DISCHARGING");
  EXPECT_EQ(battery.find("warning")->text(), "LOW");
  EXPECT_LT(battery.find("current")->number(), 0.0);
  EXPECT_EQ(ask("Simulation", "plugIn").text(), "OK");
  now_ += 1s;
  battery = ask("Battery", "getBatteryState");
  EXPECT_EQ(battery.find("power_supply_status")->text(), "CHARGING");
  EXPECT_GT(battery.find("current")->number(), 0.0);
  now_ += 300s;
  battery = ask("Battery", "getBatteryState");
  EXPECT_EQ(battery.find("power_supply_status")->text(), "FULL");
  EXPECT_EQ(battery.find("percentage")->number(), 1.0);
  EXPECT_FALSE(*ask("Battery", "isCharging").as_bool());
  EXPECT_GT(battery.find("temperature")->number(), 22.0);
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
  now_ += 20s;
  battery = ask("Battery", "getBatteryState");
  EXPECT_EQ(battery.find("power_supply_status")->text(), "DISCHARGING");
  EXPECT_LT(battery.find("percentage")->number(), 1.0);
  EXPECT_EQ(ask("Simulation", "setBatteryCharge", {{"percent", 101}}).text(), "OUT_OF_BOUNDS");
}

TEST_F(Services, PeopleOfTheWorldPlugInByThemselves) {
  world_.people.push_back({"ann", "dock", 0.3, 5s});
  ask("Simulation", "setRobotPose", {{"pose", pose(8.2, 5.2, 1.5)}});
  ask("Simulation", "setBatteryCharge", {{"percent", 20}});
  now_ += 4s;
  EXPECT_FALSE(*ask("Battery", "isCharging").as_bool());
  now_ += 2s;
  EXPECT_TRUE(*ask("Battery", "isCharging").as_bool());
}

TEST_F(Services, VelocityCommandsEndByThemselves) {
  const Map forward{{"cmd", Map{{"vx", 0.2}, {"vy", 0.0}, {"omega", 0.0}}}, {"timeout", 1.0}};
  EXPECT_EQ(ask("Base", "applyVelocityCommand", forward).text(), "OK");
  now_ += 900ms;
  EXPECT_EQ(ask("Base", "getLastVelocityCommand").find("vx")->number(), 0.2);
  now_ += 2s;
  EXPECT_EQ(ask("Base", "getOdometry").at({"twist", "vx"})->number(), 0.0);
  const double x = ask("Base", "getOdometry").at({"pose", "x"})->number();
  EXPECT_GT(x, 0.15);
  EXPECT_LT(x, 0.25);
  const Value before = ask("Localization", "getCurrentPosition");
  ask("Base", "resetOdometry");
  EXPECT_EQ(ask("Base", "getOdometry").at({"pose", "x"})->number(), 0.0);
  EXPECT_NEAR(ask("Localization", "getCurrentPosition").at({"pose", "x"})->number(), before.at({"pose", "x"})->number(),
              1e-12);
  const Map sideways{{"cmd", Map{{"vx", 0.0}, {"vy", 0.1}, {"omega", 0.0}}}, {"timeout", 1.0}};
  EXPECT_EQ(ask("Base", "applyVelocityCommand", sideways).text(), "NOT_IMPLEMENTED");
  const Map fast{{"cmd", Map{{"vx", 9.0}, {"vy", 0.0}, {"omega", 0.0}}}, {"timeout", 1.0}};
  EXPECT_EQ(ask("Base", "applyVelocityCommand", fast).text(), "OUT_OF_BOUNDS");
}

TEST_F(Services, LocationsAndAreasCanBeStoredAndOneNameMeansOnePlace) {
  const Value place = Map{{"map_id", "house"}, {"pose", pose(2, 1, 0)}, {"description", "new"}};
  EXPECT_EQ(ask("MapServer", "storeLocation", {{"name", "here"}, {"location", place}}).text(), "OK");
  EXPECT_EQ(ask("MapServer", "getLocation", {{"name", "here"}}).at({"location", "description"})->text(), "new");
  EXPECT_EQ(ask("MapServer", "storeLocation", {{"name", "corridor"}, {"location", place}}).text(), "ERROR");
  EXPECT_EQ(ask("MapServer", "deleteLocation", {{"name", "here"}}).text(), "OK");
  EXPECT_EQ(ask("MapServer", "deleteLocation", {{"name", "here"}}).text(), "UNKNOWN_NAME");
  const Value thin = Map{{"map_id", ""}, {"points", List{Map{{"x", 0}, {"y", 0}}}}, {"description", ""}};
  EXPECT_EQ(ask("MapServer", "storeArea", {{"name", "a"}, {"area", thin}}).text(), "ERROR");
  while (state_.locations.size() < kLocationsMax)
    state_.locations.push_back({std::to_string(state_.locations.size()), {}, {}});
  EXPECT_EQ(ask("MapServer", "storeLocation", {{"name", "one more"}, {"location", place}}).text(), "OUT_OF_BOUNDS");
}

TEST_F(Services, ObstaclesHaveABound) {
  const auto add = [&](const std::string& id) {
    return ask("Simulation", "addObstacle", {{"id", id}, {"centre", Map{{"x", 9.0}, {"y", 9.0}}}, {"radius", 0.1}});
  };
  EXPECT_EQ(add("a").text(), "OK");
  EXPECT_EQ(ask("Simulation", "moveObstacle", {{"id", "a"}, {"centre", Map{{"x", 8.0}, {"y", 9.0}}}}).text(), "OK");
  EXPECT_EQ(state_.obstacles[0].shape.pose.x, 8.0);
  while (state_.obstacles.size() < kObstaclesMax)
    state_.obstacles.push_back({std::to_string(state_.obstacles.size()), {}, false});
  EXPECT_EQ(add("b").text(), "OUT_OF_BOUNDS");
  EXPECT_EQ(add("a").text(), "OK") << "replaces the one of that name";
  EXPECT_EQ(ask("Simulation", "removeObstacle", {{"id", "a"}}).text(), "OK");
  EXPECT_EQ(ask("Simulation", "removeObstacle", {{"id", "a"}}).text(), "UNKNOWN_NAME");
  EXPECT_EQ(ask("Simulation", "setDoor", {{"id", "gate"}, {"open", true}}).text(), "UNKNOWN_NAME");
}

TEST_F(Services, TimeRunsAtAFactorPausesAndSteps) {
  now_ += 10s;
  EXPECT_EQ(ask("Battery", "getBatteryState").at({"header", "stamp"})->number(), 10.0);
  ask("Simulation", "setTimeFactor", {{"factor", 20.0}});
  now_ += 1s;
  EXPECT_EQ(ask("Battery", "getBatteryState").at({"header", "stamp"})->number(), 30.0);
  ask("Simulation", "setPaused", {{"paused", true}});
  now_ += 100s;
  EXPECT_EQ(ask("Battery", "getBatteryState").at({"header", "stamp"})->number(), 30.0);
  EXPECT_EQ(ask("Simulation", "step", {{"seconds", 0.5}}).number(), 30.5);
  ask("Simulation", "setPaused", {{"paused", false}});
  ask("Simulation", "setTimeFactor", {{"factor", 0.0}});
  now_ += 100s;
  EXPECT_EQ(ask("Battery", "getBatteryState").at({"header", "stamp"})->number(), 30.5) << "the host steps it";
  EXPECT_EQ(ask("Simulation", "setTimeFactor", {{"factor", -1.0}}).text(), "OUT_OF_BOUNDS");
  ask("Simulation", "setTimeFactor", {{"factor", 1.0}});
  EXPECT_EQ(ask("Simulation", "reset", {{"seed", 5}}).text(), "OK");
  EXPECT_EQ(state_.seed, 5U);
  now_ += 1s;
  EXPECT_EQ(ask("Battery", "getBatteryState").at({"header", "stamp"})->number(), 1.0);
}

TEST_F(Services, ALeapOfTheClockIsBounded) {
  world_.step = 100ms;
  world_.robots[0].laser.period = 1h;
  advance(world_, state_, TimePoint(kAdvanceMax * 1000));
  EXPECT_EQ(state_.time, TimePoint(kAdvanceMax));
  advance(world_, state_, TimePoint(kAdvanceMax * 1000 + 1s));
  EXPECT_EQ(state_.time, TimePoint(kAdvanceMax + 1s));
}

TEST_F(Services, EachRobotHasItsOwn) {
  RobotSpec second = world_.robots[0];
  second.name = "second";
  second.start = {2.7, 7.5, 0.0};
  world_.robots.push_back(second);
  state_ = initial_state(world_, 1);
  const Map percent{{"percent", 33}};
  ASSERT_TRUE(call(world_, state_,
                   {.service = "Simulation", .method = "setBatteryCharge", .args = percent, .robot = "second"}, now_));
  EXPECT_EQ(ask("Battery", "getBatteryCharge").number(), 100.0);
  const Map none;
  EXPECT_EQ(
      call(world_, state_, {.service = "Battery", .method = "getBatteryCharge", .args = none, .robot = "second"}, now_)
          ->number(),
      33.0);
}

TEST_F(Services, RobotsSeeEachOtherAndDoNotDriveThroughEachOther) {
  RobotSpec second = world_.robots[0];
  second.name = "second";
  second.start = {world_.robots[0].start.x + 1.0, world_.robots[0].start.y, 0.0};
  world_.robots[0].start.theta = 0.0;
  world_.robots.push_back(second);
  state_ = initial_state(world_, 1);
  const double gap = 1.0 - second.radius_m;
  EXPECT_NEAR(state_.robots[0].scan.ranges[180], gap, 1e-9) << "straight ahead";
  EXPECT_NEAR(state_.robots[1].scan.ranges[0], gap, 1e-9) << "straight behind";
  ask("Base", "applyVelocityCommand", {{"cmd", Map{{"vx", 0.3}, {"vy", 0}, {"omega", 0}}}, {"timeout", 20.0}});
  now_ += 20s;
  EXPECT_GT(ask("Simulation", "getCollisions").number(), 0.0);
  const double between = distance(state_.robots[0].truth.pose.position(), state_.robots[1].truth.pose.position());
  EXPECT_GE(between, 2 * second.radius_m);
  EXPECT_LT(between, 2 * second.radius_m + 0.02);
}

TEST_F(Services, AnswersMadeOfFormerOnesAreAsOthers) {
  const Map other{{"status", "IDLE"}, {"goal_id", 3}};
  for (const auto& [service, method] :
       {std::pair("Battery", "getBatteryState"), std::pair("Navigation", "getNavigationState")}) {
    ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
    const Value before = ask(service, method);
    Value more = before;
    (*more.as_map())["beyond"] = 1;
    now_ += 3s;
    const Value now = ask(service, method);
    ASSERT_NE(now, before) << method;
    const Map none;
    for (const Value& former : {before, more, Value(other), Value(Map()), Value("text"), Value()}) {
      const auto again =
          call(world_, state_, {.service = service, .method = method, .args = none, .former = former}, now_);
      ASSERT_TRUE(again) << method;
      EXPECT_EQ(*again, now) << method << " made of " << to_json(former);
    }
  }
}

TEST_F(Services, SavedStatesOfAnotherWorldAreRefused) {
  Value saved = save(state_);
  EXPECT_EQ(*restore(world_, saved), state_);
  saved.as_map()->erase("seed");
  EXPECT_THAT(restore(world_, saved).error().message, HasSubstr("seed is missing"));
  saved = save(state_);
  (*(*saved.as_map())["robots"].as_list())[0].as_map()->find("battery")->as_map()->find("charge")[0] = "much";
  EXPECT_THAT(restore(world_, saved).error().message, HasSubstr("robots[0].battery.charge is string"));
  saved = save(state_);
  world_.robots.push_back(world_.robots[0]);
  EXPECT_THAT(restore(world_, saved).error().message, HasSubstr("it has 1 robots and the world 2"));
  EXPECT_THAT(restore(world_, Value(3)).error().message, HasSubstr("int"));
}

}  // namespace
}  // namespace sentree::sim
