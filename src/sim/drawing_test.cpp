#include "sentree/sim/drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/simulation.h"
#include "sentree/text/xml.h"

namespace sentree::sim {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Drawing, ShowsMapPlacesRobotScanParticlesAndPath) {
  Loaded<World> house = test::load_house();
  ASSERT_TRUE(house.ok());
  World& world = *house.value;
  world.locations[0].name = "a<b";
  world.robots[0].localization.method = LocalizationSpec::Method::kAmcl;
  State state = initial_state(world, 1);
  start_goal(world.robots[0].navigation, state.robots[0].navigator, "", {{14.6, 8.8, 0.0}}, state.time);
  advance_by(world, state, std::chrono::seconds(5));
  const std::string svg = to_svg(world, state);
  const auto parsed = text::XmlDocument::parse(svg);
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(*parsed->root().attribute("width"), "640.00");
  EXPECT_THAT(svg, HasSubstr("a&lt;b"));
  EXPECT_THAT(svg, HasSubstr("robot 99 %"));
  EXPECT_THAT(svg, HasSubstr("<polyline"));
  EXPECT_THAT(svg, HasSubstr("#d0342c"));
  EXPECT_THAT(svg, HasSubstr("#7b4fa3"));
  EXPECT_THAT(svg, HasSubstr(">kitchen_area<"));
  EXPECT_THAT(svg, HasSubstr(">kitchen_door<"));
  EXPECT_THAT(svg, HasSubstr(">2.0 m   house   t = 5.00 s<")) << "the scale: 80 pixels";
  EXPECT_EQ(svg, to_svg(world, state));
  const std::string bare = to_svg(world, state, {.places = false, .scan = false, .particles = false, .path = false});
  EXPECT_THAT(bare, Not(HasSubstr("a&lt;b")));
  EXPECT_THAT(bare, Not(HasSubstr("<polyline")));
  EXPECT_THAT(bare, Not(HasSubstr("#d0342c")));
}

TEST(Drawing, YIsUp) {
  std::vector<std::int8_t> cells(4 * 2, 0);
  cells[0] = 100;  // lower left
  World world = test::world_around(GridMap(4, 2, 1.0, {}, cells), {3.5, 1.5, 0.0});
  const std::string svg = to_svg(world, initial_state(world, 1), {.pixels_per_m = 10.0});
  EXPECT_THAT(svg, HasSubstr("M0.00,20.00L10.00,20.00L10.00,10.00L0.00,10.00Z"));
}

}  // namespace
}  // namespace sentree::sim
