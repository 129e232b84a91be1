#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include "sentree/sim/detail/exact_localization.h"

#include <string>

#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/world.h"

namespace sentree::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A room of 4 m x 4 m.
Loaded<World> parse(const std::string& yaml) {
  return parse_world(yaml, "world.yaml", [](const std::string& name) -> Result<std::string> {
    if (name == "room.yaml") return "image: room.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n";
    if (name != "room.pgm") return fail("file.not-found", name + " does not exist");
    std::string pgm = "P2 40 40 1\n";
    for (int i = 0; i < 1600; ++i) {
      const bool wall = i < 40 || i >= 1560 || i % 40 == 0 || i % 40 == 39;
      pgm += wall ? "0 " : "1 ";
    }
    return pgm;
  });
}

std::vector<std::string> messages(const std::string& yaml) {
  const Loaded<World> world = parse(yaml);
  EXPECT_FALSE(world.ok());
  std::vector<std::string> lines;
  for (const Diagnostic& d : world.diagnostics) lines.push_back(to_string(d));
  return lines;
}

TEST(WorldFile, ReadsEveryPart) {
  const Loaded<World> world = parse(R"(
map: room.yaml
step: 10 ms
robots:
  r1: {start: [1, 1, 90 deg], body: {radius: 0.2}}
  r2: {start: desk, laser: {beams: 180, view: 180 deg, noise: 0.02, dropout: 1 %}}
locations:
  desk: [3, 3, -1.0]
  dock: {pose: [1, 3], description: by the window}
areas:
  corner: {corners: [[0, 0], [1, 0], [0, 1]]}
stations:
  s: {pose: dock, linear_tolerance: 0.4, angular_tolerance: 20 deg}
obstacles:
  bin: {pose: [2, 2], radius: 0.1}
  shelf: {pose: [2, 3, 0.5], size: [0.5, 0.2], on_map: true}
doors:
  d: {from: [1, 0], to: [2, 0], open: false}
people:
  ann: {plugs_in_at: s, below: 40 %, after: 2 min}
battery: {initial: 50 %, drain_standing: 3 %/min, capacity_Ah: 10}
localization: {method: amcl, particles_min: 100}
navigation: {margin: 0.05, time_limit: 5 min}
motion: {speed: 0.5, turn_speed: 40 deg}
odometry: {noise: 10 %, scale: 3 %}
)");
  for (const Diagnostic& d : world.diagnostics) ADD_FAILURE() << to_string(d);
  ASSERT_TRUE(world.ok());
  const World& w = *world.value;
  EXPECT_EQ(w.map_id, "room");
  EXPECT_EQ(w.step, std::chrono::milliseconds(10));
  ASSERT_EQ(w.robots.size(), 2U);
  EXPECT_EQ(w.robots[0].radius_m, 0.2);
  EXPECT_NEAR(w.robots[0].start.theta, std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(w.robots[1].start, (Pose2{3, 3, -1.0}));
  EXPECT_EQ(w.robots[1].laser.beams, 180);
  EXPECT_NEAR(w.robots[1].laser.angle_increment_rad * 179, std::numbers::pi, 1e-12) << "a beam at both ends";
  EXPECT_EQ(w.robots[1].laser.dropout, 0.01);
  EXPECT_EQ(w.robots[0].laser.beams, 360);
  EXPECT_NEAR(w.robots[0].battery.drain_per_s, 0.0005, 1e-15);
  EXPECT_EQ(w.robots[0].localization.method, LocalizationSpec::Method::kAmcl);
  EXPECT_NEAR(w.robots[0].navigation.inflation(0.2).blocked_m, 0.25, 1e-12);
  EXPECT_EQ(w.robots[1].laser.range_max_m, 8.0);
  EXPECT_EQ(w.stations[0].pose, (Pose2{1, 3, 0}));
  EXPECT_EQ(w.people[0].after, std::chrono::minutes(2));
  EXPECT_EQ(w.obstacles[1].shape, Shape::box({2, 3, 0.5}, 0.5, 0.2));
  EXPECT_TRUE(w.obstacles[1].on_map);
  EXPECT_FALSE(w.doors[0].open);
  EXPECT_EQ(w.robot(""), 0U);
  EXPECT_EQ(w.robot("r2"), 1U);
  EXPECT_EQ(w.robot("r3"), std::nullopt);
}

TEST(WorldFile, TakesOfEachMemberItsOwnDimension) {
  const auto refusal = [](const std::string& battery) {
    const auto all = messages("map: room.yaml\nstart: [1, 1]\nbattery: {" + battery + "}\n");
    return all.size() == 1 ? all.front() : "";
  };
  EXPECT_THAT(refusal("drain_standing: 1 %/m"), HasSubstr("is \"1 %/m\"; a number is expected, unit %/s, %/min"));
  EXPECT_THAT(refusal("drain_moving: 0.1 %/s"), HasSubstr("a number is expected, unit %/m"));
  EXPECT_THAT(refusal("charging: 1 %"), HasSubstr("a number is expected, unit %/s, %/min"));
  EXPECT_THAT(refusal("initial: 50 %/min"), HasSubstr("a number is expected, unit %"));
  EXPECT_THAT(refusal("initial: 100"), HasSubstr("at most 1.0; write 100 %"));
  EXPECT_THAT(refusal("initial: 200"), ::testing::EndsWith("at most 1.0"));
}

TEST(WorldFile, SaysWhatOfAPoseIsWrong) {
  const auto refusal = [](const std::string& pose) {
    const auto all = messages("map: room.yaml\nstart: [1, 1]\nlocations: {door: " + pose + "}\n");
    return all.size() == 1 ? all.front() : "";
  };
  EXPECT_THAT(refusal("[1, 1, 180]"), HasSubstr("location \"door\": 180 is no heading in rad; write 180 deg"));
  EXPECT_THAT(refusal("[1, 1, 180 degrees]"), HasSubstr("\"180 degrees\" is no heading; write 180 deg"));
  EXPECT_THAT(refusal("[1, 1, north]"), HasSubstr("\"north\" is no heading; write [x, y, heading]"));
  EXPECT_THAT(refusal("[1, 1 km, 0]"), HasSubstr("\"1 km\" is no coordinate in m"));
  EXPECT_THAT(refusal("[1]"), HasSubstr("a list is no pose; write [x, y, heading]"));
}

TEST(WorldFile, TakesTheMethodOfLocalizationAlone) {
  const Loaded<World> world = parse("map: room.yaml\nstart: [1, 1]\nlocalization: exact\n");
  ASSERT_TRUE(world.ok());
  EXPECT_EQ(world.value->robots[0].localization.method, kExact);
  EXPECT_THAT(messages("map: room.yaml\nstart: [1, 1]\nlocalization: exakt\n"),
              ElementsAre(HasSubstr("one of odometry, amcl, exact is expected")));
}

TEST(WorldFile, ReportsEverythingAtOnceWithPlaces) {
  EXPECT_THAT(
      messages(R"(map: room.yaml
start: [1, 1]
batery: {}
laser: {beams: 0, veiw: 3}
motion: {speed: fast}
stations:
  dock: {pose: desc}
locations:
  desk: [1, 2, 3, 4]
people:
  ann: {plugs_in_at: dok}
)"),
      ElementsAre(
          "world.yaml:3:1: the world has no \"batery\"; did you mean \"battery\"?",
          "world.yaml:4:16: beams of laser is \"0\"; a whole number from 1 to 10000 is expected",
          "world.yaml:4:19: laser has no \"veiw\"; did you mean \"view\"?",
          "world.yaml:5:17: speed of motion is \"fast\"; a number is expected",
          "world.yaml:7:16: pose of station \"dock\" is \"desc\", which is no location; did you mean \"desk\"?",
          "world.yaml:9:9: location \"desk\": a list is no pose; write [x, y, heading] in m and rad, or \"90 deg\"",
          "world.yaml:11:22: person \"ann\" plugs in at \"dok\", which is no station; did you mean \"dock\"?"));
}

TEST(WorldFile, ChecksTheSense) {
  EXPECT_THAT(messages("map: room.yaml\nstart: [0.2, 2]\n"),
              ElementsAre("world.yaml:2:8: robot \"robot\" starts at (0.2, 2.0), where a disc of radius 0.22 m does "
                          "not fit on the map"));
  EXPECT_THAT(
      messages("map: room.yaml\nstart: [2, 2]\nlocations: {edge: [3.7, 2, 0]}\n"),
      ElementsAre(HasSubstr("world.yaml:3:19: location \"edge\" is at (3.7, 2.0), where the robot cannot stand")));
  EXPECT_THAT(messages("map: room.yaml\nstart: [2, 2]\nstations: {s: {pose: [1, 1], linear_tolerance: 0.05}}\n"),
              ElementsAre(HasSubstr("station \"s\" charges within 0.05 m")));
  EXPECT_THAT(messages("map: room.yaml\n"),
              ElementsAre(HasSubstr("the world needs the robot's \"start\", or \"robots\"")));
  EXPECT_THAT(messages("map: room.yaml\nstart: [1, 1]\nrobots: {a: {start: [2, 2]}}\n"),
              ElementsAre(HasSubstr("\"start\" and \"robots\"")));
  EXPECT_THAT(messages("map: house.yaml\nstart: [1, 1]\n"),
              ElementsAre("world.yaml:1:6: the world's map \"house.yaml\": house.yaml does not exist"));
  EXPECT_THAT(messages("start: [1, 1]\n"), ElementsAre(HasSubstr("the world needs \"map\"")));
  EXPECT_THAT(
      messages(
          "map: room.yaml\nstart: [1, 1]\nlocations: {a: [2, 2]}\nareas: {a: {corners: [[0, 0], [1, 0], [0, 1]]}}\n"),
      ElementsAre(HasSubstr("area \"a\" has the name of a location")));
}

TEST(WorldFile, BoundsHowMuchAWorldHolds) {
  std::string yaml = "map: room.yaml\nstart: [2, 2]\nobstacles:\n";
  for (std::size_t i = 0; i < kObstaclesMax; ++i) yaml += "  o" + std::to_string(i) + ": {pose: [1, 1], radius: 0.1}\n";
  EXPECT_TRUE(parse(yaml).ok());
  EXPECT_THAT(messages(yaml + "  last: {pose: [1, 1], radius: 0.1}\n"),
              ElementsAre(HasSubstr("the world has 1001 obstacles; at most 1000 are supported")));
}

TEST(WorldFile, HouseOfTheExampleLoads) {
  const Loaded<World> house = test::load_house();
  for (const Diagnostic& d : house.diagnostics) ADD_FAILURE() << to_string(d);
  ASSERT_TRUE(house.ok());
}

}  // namespace
}  // namespace sentree::sim
