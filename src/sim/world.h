#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/sim/base.h"
#include "sentree/sim/battery.h"
#include "sentree/sim/cost_grid.h"
#include "sentree/sim/distance_field.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/laser.h"
#include "sentree/sim/localization.h"
#include "sentree/sim/map_file.h"
#include "sentree/sim/navigator.h"
#include "sentree/sim/shape.h"
#include "sentree/text/yaml.h"

namespace sentree::sim {

/// Things of one kind that a world may hold.
inline constexpr std::size_t kObstaclesMax = 1000;
inline constexpr std::size_t kLocationsMax = 10'000;
inline constexpr std::size_t kRobotsMax = 100;

struct NamedLocation {
  std::string name;
  Pose2 pose;
  std::string description;
  friend bool operator==(const NamedLocation&, const NamedLocation&) = default;
};

struct NamedArea {
  std::string name;
  std::vector<Vec2> points;  ///< A simple polygon, at least three corners.
  std::string description;
  friend bool operator==(const NamedArea&, const NamedArea&) = default;
};

struct NamedPath {
  std::string name;
  std::vector<Pose2> poses;
  friend bool operator==(const NamedPath&, const NamedPath&) = default;
};

/// Something that was noted on the map: a pose in space. Nothing is in its way.
struct NamedObject {
  std::string name;
  std::array<double, 6> pose{};  ///< x, y, z [m], roll, pitch, yaw [rad].
  std::string description;
  friend bool operator==(const NamedObject&, const NamedObject&) = default;
};

/// Where a robot charges while it stands within both tolerances and is plugged in.
struct Station {
  std::string name;
  Pose2 pose;
  double linear_tolerance_m = 0.5;
  double angular_tolerance_rad = 0.35;
  bool contacts = false;  ///< A robot that docks here is plugged in by that; else somebody has to do it.
  friend bool operator==(const Station&, const Station&) = default;
};

struct Obstacle {
  std::string id;
  Shape shape;
  bool on_map = false;  ///< The robots know it without seeing it.
  friend bool operator==(const Obstacle&, const Obstacle&) = default;
};

/// A wall from `a` to `b` while it is closed.
struct Door {
  std::string id;
  Vec2 a;
  Vec2 b;
  double thickness_m = 0.05;
  bool open = true;
  bool on_map = false;  ///< The robots know without looking whether it is open.
  friend bool operator==(const Door&, const Door&) = default;
};

/// Somebody who plugs a waiting robot in by themselves.
struct Person {
  std::string name;
  std::string station;
  double below = 0.3;                        ///< Only a robot with less charge than this.
  Duration after = std::chrono::seconds(5);  ///< How long it has to stand there.
  friend bool operator==(const Person&, const Person&) = default;
};

struct RobotSpec {
  std::string name = "robot";
  Pose2 start;
  double radius_m = 0.22;
  MotionLimits limits;
  OdometryNoise odometry;
  LaserSpec laser;
  BatterySpec battery;
  NavigationSpec navigation;
  LocalizationSpec localization;
  CostGrid costs;              ///< The map inflated for this robot.
  LikelihoodField likelihood;  ///< What its localization expects to see.
};

/// Everything about a world that does not change: a model in the sense of the design.
struct World {
  std::string map_id;  ///< Name of the map's file without extension.
  GridMap map;
  DistanceField distance;
  RayField rays;
  Duration step = std::chrono::milliseconds(20);  ///< Of physics.
  std::vector<RobotSpec> robots;                  ///< At least one.
  std::vector<Station> stations;
  std::vector<NamedLocation> locations;
  std::vector<NamedArea> areas;
  std::vector<Obstacle> obstacles;
  std::vector<Door> doors;
  std::vector<Person> people;

  /// Position of the robot in `robots`; an empty name is the first.
  [[nodiscard]] std::optional<std::size_t> robot(std::string_view name) const;
};

/// Fills in what follows from the map for a robot whose other members are set.
void derive(const World& world, RobotSpec& robot);

/// Reads a world file (docs/simulator.md describes it) and the map that it names.
///
/// Reports everything that is wrong at once. Besides the form it checks the sense: a robot that starts in a wall, a
/// location that the robot cannot stand on, a station's tolerance within the navigation's, names used twice.
/// Errors: sim.* with line and column of the world file, map.* of the map's files.
[[nodiscard]] Loaded<World> parse_world(std::string_view source, const std::string& file, const FileReader& read);

/// The same of a file that has been read already, changed by a scenario perhaps.
[[nodiscard]] Loaded<World> parse_world(const text::YamlNode& root, const FileReader& read);

/// The same of a file on disk. `shown_as` is the name used in messages (default: the path).
[[nodiscard]] Loaded<World> load_world(const std::string& path, std::string shown_as = {});

/// The least linear and angular distances to a station's pose at which a robot may fail to charge, over all
/// stations: what a skill's tolerance must stay below. Nothing without a station.
struct Tolerances {
  double linear_m = 0.0;
  double angular_rad = 0.0;
};
[[nodiscard]] std::optional<Tolerances> station_tolerances(const World& world);
/// The greatest distances from its target at which a robot may report GOAL_REACHED.
[[nodiscard]] Tolerances navigation_tolerances(const World& world);

}  // namespace sentree::sim
