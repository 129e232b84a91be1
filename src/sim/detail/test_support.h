#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/map_file.h"
#include "sentree/sim/world.h"
#include "sentree/text/file.h"

// Test programs are told where the sources are; a build of the header alone is not.
#ifndef SENTREE_SOURCE_DIR
#define SENTREE_SOURCE_DIR "."
#endif

namespace sentree::sim::test {

/// A map of free floor with `walls` random boxes of walls in it; with a wall around it if `closed`.
inline GridMap random_map(Rng& rng, int width, int height, int walls, bool closed, Pose2 origin = {},
                          double resolution_m = 0.05) {
  std::vector<std::int8_t> cells(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  const auto set = [&](int x, int y) {
    if (x >= 0 && y >= 0 && x < width && y < height) cells[static_cast<std::size_t>(y * width + x)] = 100;
  };
  for (int i = 0; i < walls; ++i) {
    const int x = static_cast<int>(rng.below(static_cast<std::uint64_t>(width)));
    const int y = static_cast<int>(rng.below(static_cast<std::uint64_t>(height)));
    const int dx = 1 + static_cast<int>(rng.below(8));
    const int dy = 1 + static_cast<int>(rng.below(8));
    for (int v = y; v < y + dy; ++v) {
      for (int u = x; u < x + dx; ++u) set(u, v);
    }
  }
  for (int x = 0; closed && x < width; ++x) set(x, 0), set(x, height - 1);
  for (int y = 0; closed && y < height; ++y) set(0, y), set(width - 1, y);
  return {width, height, resolution_m, origin, std::move(cells)};
}

/// The folder of real maps: $SENTREE_TEST_MAPS, else shared/maps beside the source tree. Nothing where there is none.
inline std::optional<std::filesystem::path> real_maps() {
  const char* named = std::getenv("SENTREE_TEST_MAPS");
  const std::filesystem::path folder = named != nullptr
                                           ? std::filesystem::path(named)
                                           : std::filesystem::path(SENTREE_SOURCE_DIR) / ".." / "shared" / "maps";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) return std::nullopt;
  return folder;
}

inline Loaded<GridMap> load_map(const std::filesystem::path& yaml) {
  const auto source = text::read_file(yaml);
  if (!source) return {std::nullopt, {source.error()}};
  return parse_map(*source, yaml.filename().string(), [&](const std::string& image) {
    return text::read_file(yaml.parent_path() / image, image, kImageBytesMax);
  });
}

/// The world that the recharge example ships.
inline Loaded<World> load_house() {
  return load_world(SENTREE_SOURCE_DIR "/examples/recharge/world/world.yaml", "world.yaml");
}

/// A world around a map: one robot with defaults at `start`, everything derived filled in.
inline World world_around(GridMap map, Pose2 start, LocalizationSpec localization = {}) {
  World world;
  world.map_id = "test";
  world.map = std::move(map);
  world.distance = DistanceField(world.map);
  world.rays = RayField(world.map);
  RobotSpec robot;
  robot.start = start;
  robot.localization = localization;
  derive(world, robot);
  world.robots.push_back(std::move(robot));
  return world;
}

}  // namespace sentree::sim::test
