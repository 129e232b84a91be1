#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/record/packed_json.h"

namespace sentree::record {

// Robot and world in Foxglove's shapes, as JSON at the end of `out`; what comes often is packed. Frame "map"; metres
// and radians.

struct Pose {
  double x = 0.0;
  double y = 0.0;
  double theta = 0.0;  ///< Counter-clockwise from +x.
};

/// A pose, and a range [m], as readers of a recording find them.
[[nodiscard]] Pose as_recorded(const Pose& pose);
[[nodiscard]] double range_as_recorded(double range);
/// Any other number that is packed rounded.
[[nodiscard]] double as_recorded(double number);

void pack_pose(PackedJson& out, TimePoint time, const Pose& pose_map);

void append_path(std::string& out, TimePoint time, std::span<const Pose> poses_map);

/// Ranges [m] are written in millimetres' precision; what is not finite becomes 0.
void pack_scan(PackedJson& out, TimePoint time, const Pose& laser_map, double angle_min, double angle_increment,
               std::span<const double> ranges);

/// An occupancy grid, row-major from the lower left cell: -1 unknown, 0 free to 100 occupied.
struct Grid {
  Pose origin_map;  ///< Of the corner of cell (0, 0).
  double cell_m = 0.0;
  std::uint32_t columns = 0;
  std::span<const std::int8_t> cells;
};
void append_grid(std::string& out, TimePoint time, const Grid& grid);

enum class LogLevel { kInfo = 2, kWarning = 3, kError = 4 };
void append_log(std::string& out, TimePoint time, LogLevel level, std::string_view name, std::string_view text);

/// A thing of the world: a box or a disc lying flat, with a name above it.
struct SceneThing {
  std::string id;
  std::string text;  ///< Empty: none.
  Pose pose_map;
  bool disc = false;
  double length_m = 0.0;  ///< Of a box along its x axis; of a disc, its diameter.
  double width_m = 0.0;
  double height_m = 0.0;
  std::uint32_t rgba = 0;  ///< 0xRRGGBBAA.
};
/// The things that are there, in place of all that were there before.
void append_scene(std::string& out, TimePoint time, std::span<const SceneThing> things);

}  // namespace sentree::record
