#include "sentree/sim/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <iostream>

#include "sentree/sim/detail/test_support.h"

namespace sentree::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kYaml = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n";

Loaded<GridMap> map_of(const std::string& yaml, const std::string& image) {
  return parse_map(yaml, "m.yaml", [&](const std::string&) -> Result<std::string> { return image; });
}

// The first message about a map that must be refused.
std::string refusal(const std::string& yaml, const std::string& image) {
  const Loaded<GridMap> map = map_of(yaml, image);
  EXPECT_FALSE(map.ok());
  return map.diagnostics.empty() ? "" : to_string(map.diagnostics[0]);
}

std::string p5(int width, int height, std::string data) {
  return "P5\n# by hand\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" + std::move(data);
}

std::string png_of(int format, int width, int height, const std::vector<std::uint8_t>& samples) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = static_cast<png_uint_32>(format);
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  EXPECT_NE(png_image_write_to_memory(&png, bytes.data(), &size, 0, samples.data(), 0, nullptr), 0);
  bytes.resize(size);
  return bytes;
}

TEST(MapFile, TrinaryReadsWallsFloorAndUnknown) {
  // Bottom row first: the image's last row.
  const Loaded<GridMap> map = map_of(kYaml, p5(3, 2, std::string("\xFE\xCD\x00", 3) + std::string("\x00\xFF\x7F", 3)));
  ASSERT_TRUE(map.ok());
  EXPECT_THAT(map.value->cells(), ElementsAre(100, 0, -1, 0, 0, 100));
}

TEST(MapFile, ScaleKeepsShadesAndRawKeepsNumbers) {
  const std::string image = p5(4, 1, std::string("\x00\x64\x80\xFF", 4));
  const Loaded<GridMap> scale = map_of(kYaml + "mode: scale\nfree_thresh: 0.2\noccupied_thresh: 0.8\n", image);
  ASSERT_TRUE(scale.ok());
  // 0x64: darkness (255-100)/255 = 0.608 lies at 0.680 between the thresholds, 0x80: 0.498 at 0.497.
  EXPECT_THAT(scale.value->cells(), ElementsAre(100, 67, 49, 0));
  const Loaded<GridMap> raw = map_of(kYaml + "mode: raw\n", image);
  ASSERT_TRUE(raw.ok());
  EXPECT_THAT(raw.value->cells(), ElementsAre(0, 100, -1, -1));
}

TEST(MapFile, NegateTurnsBlackIntoFloor) {
  const Loaded<GridMap> map = map_of(kYaml + "negate: 1\n", p5(2, 1, std::string("\x00\xFF", 2)));
  ASSERT_TRUE(map.ok());
  EXPECT_THAT(map.value->cells(), ElementsAre(0, 100));
}

TEST(MapFile, OriginMayBeTurned) {
  const Loaded<GridMap> map = map_of("image: m.pgm\nresolution: 0.5\norigin: [1, 2, 1.5707963267948966]\n",
                                     p5(2, 1, std::string("\x00\xFF", 2)));
  ASSERT_TRUE(map.ok());
  const Vec2 centre = map.value->centre({1, 0});
  EXPECT_NEAR(centre.x, 0.75, 1e-12);
  EXPECT_NEAR(centre.y, 2.75, 1e-12);
}

TEST(MapFile, ReadsAsciiOtherDepthsAndTwoOctets) {
  const std::string ascii = "P2\n# c\n3 1 # size\n2\n0 1\n2";
  EXPECT_THAT(map_of(kYaml, ascii).value->cells(), ElementsAre(100, -1, 0));
  EXPECT_THAT(map_of(kYaml, std::string("P5 2 1 65535 \xFF\xFF\x00\x01", 16 + 1)).value->cells(), ElementsAre(0, 100));
}

TEST(MapFile, ReadsPngGreyColourAndAlpha) {
  const std::string yaml = "image: m.png\nresolution: 0.05\norigin: [0, 0, 0]\n";
  EXPECT_THAT(map_of(yaml, png_of(PNG_FORMAT_GRAY, 3, 1, {0, 255, 127})).value->cells(), ElementsAre(100, 0, -1));
  // The mean of the channels, as map_server has it: yellow is light.
  EXPECT_THAT(map_of(yaml, png_of(PNG_FORMAT_RGB, 2, 1, {255, 255, 90, 20, 20, 20})).value->cells(),
              ElementsAre(0, 100));
  const std::string with_alpha = png_of(PNG_FORMAT_GA, 2, 1, {0, 255, 0, 10});
  EXPECT_THAT(map_of(yaml + "mode: scale\n", with_alpha).value->cells(), ElementsAre(100, -1));
}

TEST(MapFile, RefusesWhatIsBrokenAndSaysHow) {
  EXPECT_EQ(refusal(kYaml, p5(100, 100, std::string(9'000, 'x'))),
            "m.pgm: the image ends after 9000 of 10000 cells; the file was cut off, fetch it again");
  EXPECT_EQ(refusal(kYaml, "P2 2 2 1 0 1 1"),
            "m.pgm: the image ends after 3 of 4 cells; the file was cut off, fetch it again");
  EXPECT_THAT(refusal(kYaml, "P2 2 2 1 0 1 1 7"), HasSubstr("cell 3 is no number from 0 to 1"));
  EXPECT_THAT(refusal(kYaml, "P5 0 2 255 "), HasSubstr("width, height and greatest value"));
  EXPECT_THAT(refusal(kYaml, "P5"), HasSubstr("width, height and greatest value"));
  EXPECT_THAT(refusal(kYaml, "P5 99999999999 2 255 "), HasSubstr("width, height and greatest value"));
  EXPECT_THAT(refusal(kYaml, "P5 5000 5000 255 "), HasSubstr("5000 x 5000 cells; at most 16777216"));
  EXPECT_THAT(refusal(kYaml, "P5 40000 1 255 "), HasSubstr("32768 a side"));
  EXPECT_THAT(refusal(kYaml, "GIF89a"), HasSubstr("neither PGM (P2, P5) nor PNG"));
  EXPECT_THAT(refusal(kYaml, "version https://git-lfs.github.com/spec/v1\n"), HasSubstr("git lfs pull"));
  EXPECT_THAT(refusal(kYaml, ""), HasSubstr("neither PGM"));
  const std::string png = png_of(PNG_FORMAT_GRAY, 64, 64, std::vector<std::uint8_t>(4096, 3));
  EXPECT_THAT(refusal(kYaml, png.substr(0, png.size() / 2)), HasSubstr("the PNG cannot be read"));
}

TEST(MapFile, NamesWhatIsWrongInTheYamlWithItsPlace) {
  const std::string image = p5(1, 1, "x");
  EXPECT_EQ(refusal("image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_tresh: 0.6\n", image),
            "m.yaml:4:1: the map has no \"occupied_tresh\"; did you mean \"occupied_thresh\"?");
  EXPECT_EQ(refusal("image: m.pgm\nresolution: 0\norigin: [0, 0, 0]\n", image),
            "m.yaml:2:13: resolution of the map is 0.0; it must be above 0.0 and at most 100.0");
  EXPECT_EQ(refusal("image: m.pgm\nresolution: 0.05\n", image), "m.yaml:1:1: the map needs \"origin\"");
  EXPECT_EQ(
      refusal(kYaml + "mode: tinary\n", image),
      "m.yaml:4:7: mode of the map is \"tinary\"; one of trinary, scale, raw is expected; did you mean \"trinary\"?");
  EXPECT_THAT(refusal(kYaml + "free_thresh: 0.9\n", image),
              HasSubstr("free_thresh 0.9 is not below occupied_thresh 0.65"));
  EXPECT_THAT(refusal("image: [", image), HasSubstr("m.yaml:1"));
  EXPECT_THAT(refusal("just text", image), HasSubstr("a mapping is expected"));
}

TEST(MapFile, AMissingImageIsReportedWhereItIsNamed) {
  const Loaded<GridMap> map = parse_map(kYaml, "m.yaml", [](const std::string& name) -> Result<std::string> {
    return fail("file.not-found", name + " does not exist");
  });
  ASSERT_EQ(map.diagnostics.size(), 1U);
  EXPECT_EQ(to_string(map.diagnostics[0]), "m.yaml:1:8: m.pgm does not exist (the map's image)");
}

TEST(MapFile, ReadsRealMaps) {
  const auto folder = test::real_maps();
  if (!folder) GTEST_SKIP() << "no real maps: set SENTREE_TEST_MAPS to a folder of them";
  struct Expected {
    const char* file;
    int width;
    int height;
  };
  for (const Expected& e :
       {Expected{"aws_small_house/map.yaml", 500, 500}, Expected{"nav2/depot.yaml", 604, 307},
        Expected{"nav2/warehouse.yaml", 1006, 1674}, Expected{"nav2/tb3_sandbox.yaml", 384, 384},
        Expected{"turtlebot3_world/map.yaml", 384, 384}, Expected{"willow/willow-full.yaml", 584, 526},
        Expected{"willow/willow-full-0.05.yaml", 1165, 945}}) {
    const Loaded<GridMap> map = test::load_map(*folder / e.file);
    ASSERT_TRUE(map.ok()) << e.file << ": " << to_string(map.diagnostics.at(0));
    EXPECT_EQ(map.value->width(), e.width) << e.file;
    EXPECT_EQ(map.value->height(), e.height) << e.file;
    int walls = 0;
    int floor = 0;
    for (const std::int8_t cell : map.value->cells()) {
      walls += cell >= GridMap::kOccupiedMin ? 1 : 0;
      floor += cell == 0 ? 1 : 0;
    }
    EXPECT_GT(walls, 500) << e.file;
    EXPECT_GT(floor, walls) << e.file;
  }
}

}  // namespace
}  // namespace sentree::sim
