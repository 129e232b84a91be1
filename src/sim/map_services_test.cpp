// What is kept beside the map: locations, areas, paths, objects; and the getters of battery and laser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/sim/detail/test_service_support.h"

namespace sentree::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class MapServices : public ::testing::Test, protected test::HouseServices {
 protected:
  std::string code(std::string_view method, const Map& args = {}) {
    const Value reply = ask("MapServer", method, args);
    return std::string(reply.as_string() != nullptr ? reply.text() : reply.find("code")->text());
  }
  std::vector<std::string> list(std::string_view method) {
    std::vector<std::string> names;
    const Value reply = ask("MapServer", method);
    for (const Value& name : *reply.as_list()) names.emplace_back(name.text());
    return names;
  }
  static Value object(double x) { return Map{{"map_id", ""}, {"x", x}, {"y", 2.0}, {"yaw", 0.5}}; }
  static Value path() { return Map{{"poses", List{pose(1.2, 1.2, 0), pose(2.7, 7.5, 0)}}}; }
};

TEST_F(MapServices, PlacesAreRenamedDeletedAndClearedAndNeverShareAName) {
  EXPECT_EQ(code("renameLocation", {{"name", "study"}, {"new_name", "library"}}), "OK");
  EXPECT_EQ(code("getLocation", {{"name", "study"}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("getLocation", {{"name", "library"}}), "OK");
  EXPECT_EQ(code("renameLocation", {{"name", "library"}, {"new_name", "library"}}), "OK");
  EXPECT_EQ(code("renameLocation", {{"name", "library"}, {"new_name", "kitchen"}}), "ERROR");
  EXPECT_EQ(code("renameLocation", {{"name", "library"}, {"new_name", "corridor"}}), "ERROR") << "an area's";
  EXPECT_EQ(code("renameLocation", {{"name", "cellar"}, {"new_name", "attic"}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("renameLocation", {{"name", "library"}, {"new_name", ""}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("renameArea", {{"name", "corridor"}, {"new_name", "kitchen"}}), "ERROR") << "a location's";
  EXPECT_EQ(code("renameArea", {{"name", "corridor"}, {"new_name", "hall"}}), "OK");
  EXPECT_THAT(list("getAreasList"), ElementsAre("hall", "kitchen_area"));
  EXPECT_EQ(code("deleteArea", {{"name", "hall"}}), "OK");
  EXPECT_EQ(code("deleteArea", {{"name", "hall"}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("clearAllAreas"), "OK");
  EXPECT_EQ(code("clearAllLocations"), "OK");
  EXPECT_THAT(list("getAreasList"), ElementsAre());
  EXPECT_THAT(list("getLocationsList"), ElementsAre());
}

TEST_F(MapServices, PathsAreKeptAndFollowed) {
  EXPECT_EQ(code("storePath", {{"name", "round"}, {"path", path()}}), "OK");
  EXPECT_EQ(code("storePath", {{"name", ""}, {"path", path()}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("storePath", {{"name", "none"}, {"path", Map{{"poses", List{}}}}}), "ERROR");
  EXPECT_EQ(code("renamePath", {{"name", "round"}, {"new_name", "kitchen"}}), "OK") << "paths have names of their own";
  EXPECT_THAT(list("getPathsList"), ElementsAre("kitchen"));
  const Value reply = ask("MapServer", "getPath", {{"name", "kitchen"}});
  EXPECT_EQ(test::keys(&reply), test::fields("PathReply"));
  EXPECT_EQ(reply.at({"path", "poses"})->as_list()->size(), 2U);
  EXPECT_EQ(ask("Navigation", "followPath", {{"path", *reply.find("path")}}).find("code")->text(), "OK");
  EXPECT_EQ(code("getPath", {{"name", "round"}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("deletePath", {{"name", "kitchen"}}), "OK");
  EXPECT_EQ(code("clearAllPaths"), "OK");
}

TEST_F(MapServices, ObjectsHaveAPoseInSpace) {
  EXPECT_EQ(code("storeObject", {{"name", "cup"}, {"object", object(1.0)}}), "OK");
  EXPECT_EQ(code("storeObject", {{"name", "cup"}, {"object", object(3.0)}}), "OK") << "moves it";
  const Value reply = ask("MapServer", "getObject", {{"name", "cup"}});
  EXPECT_EQ(test::keys(&reply), test::fields("MapObjectReply"));
  EXPECT_EQ(test::keys(reply.find("object")), test::fields("MapObject"));
  EXPECT_EQ(reply.at({"object", "x"})->number(), 3.0);
  EXPECT_EQ(reply.at({"object", "yaw"})->number(), 0.5);
  EXPECT_EQ(reply.at({"object", "z"})->number(), 0.0);
  const Value elsewhere = Map{{"map_id", "moon"}, {"x", 0}, {"y", 0}};
  EXPECT_EQ(code("storeObject", {{"name", "cup"}, {"object", elsewhere}}), "UNKNOWN_NAME");
  EXPECT_EQ(code("renameObject", {{"name", "cup"}, {"new_name", "mug"}}), "OK");
  EXPECT_THAT(list("getObjectsList"), ElementsAre("mug"));
  EXPECT_EQ(code("deleteObject", {{"name", "mug"}}), "OK");
  EXPECT_EQ(code("clearAllObjects"), "OK");
  EXPECT_EQ(error("MapServer", "storeObject", {{"name", "cup"}, {"object", Map{{"x", 1}}}}),
            "sim.bad-argument: MapServer.storeObject: object.y is missing; a value is expected");
}

TEST_F(MapServices, WhatWasStoredIsPartOfTheState) {
  code("storePath", {{"name", "round"}, {"path", path()}});
  code("storeObject", {{"name", "cup"}, {"object", object(1.0)}});
  const auto restored = restore(world_, save(state_));
  ASSERT_TRUE(restored) << restored.error().message;
  EXPECT_EQ(*restored, state_);
  while (state_.objects.size() < kLocationsMax)
    state_.objects.push_back({std::to_string(state_.objects.size()), {}, {}});
  EXPECT_EQ(code("storeObject", {{"name", "one more"}, {"object", object(1.0)}}), "OUT_OF_BOUNDS");
}

TEST_F(MapServices, TheBatterysGettersAgreeWithItsState) {
  const Value state = ask("Battery", "getBatteryState");
  EXPECT_EQ(ask("Battery", "getBatteryVoltage").number(), state.find("voltage")->number());
  EXPECT_EQ(ask("Battery", "getBatteryCurrent").number(), state.find("current")->number());
  EXPECT_EQ(ask("Battery", "getBatteryTemperature").number(), state.find("temperature")->number());
  EXPECT_EQ(ask("Battery", "getBatteryInfo").text(), "simulated battery of robot, 0.5 Ah");
  EXPECT_EQ(ask("Battery", "getBatteryStatus").text(), "OK_STANDBY");
  ask("Navigation", "gotoTargetByLocationName", {{"name", "kitchen"}});
  now_ += 3s;
  EXPECT_EQ(ask("Battery", "getBatteryStatus").text(), "OK_IN_USE");
  ask("Simulation", "setBatteryCharge", {{"percent", 15}});
  EXPECT_EQ(ask("Battery", "getBatteryStatus").text(), "LOW_WARNING");
  ask("Simulation", "setBatteryCharge", {{"percent", 5}});
  EXPECT_EQ(ask("Battery", "getBatteryStatus").text(), "CRITICAL_WARNING");
  ask("Navigation", "stopNavigation", {{"goal_id", 0}});
  ask("Simulation", "setRobotPose", {{"pose", pose(8.2, 5.2, 1.5)}});
  ask("Simulation", "setBatteryCharge", {{"percent", 50}});
  now_ += 100ms;
  ask("Simulation", "plugIn");
  now_ += 1s;
  EXPECT_EQ(ask("Battery", "getBatteryStatus").text(), "OK_IN_CHARGE");
}

TEST_F(MapServices, TheLasersGettersAgreeWithItsScan) {
  const Value scan = ask("Laser", "getLaserMeasurement");
  EXPECT_EQ(ask("Laser", "getRawData"), *scan.find("ranges"));
  EXPECT_EQ(ask("Laser", "getScanLimits").find("min")->number(), scan.find("angle_min")->number());
  EXPECT_EQ(ask("Laser", "getScanLimits").find("max")->number(), scan.find("angle_max")->number());
  EXPECT_EQ(ask("Laser", "getDistanceRange").find("max")->number(), scan.find("range_max")->number());
  EXPECT_EQ(ask("Laser", "getHorizontalResolution").number(), scan.find("angle_increment")->number());
  EXPECT_EQ(ask("Laser", "getScanRate").number(), 10.0);
  EXPECT_EQ(ask("Laser", "getDeviceStatus").text(), "OK_IN_USE");
  EXPECT_EQ(ask("Laser", "getDeviceInfo").text(), "simulated laser of robot, 360 beams");
}

}  // namespace
}  // namespace sentree::sim
