#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/sim/detail/clearance.h"
#include "sentree/sim/detail/yaml_fields.h"
#include "sentree/sim/world.h"
#include "sentree/sim/world_variant.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::sim {

namespace {

constexpr std::size_t kCornersMax = 1000;

class WorldReader {
 public:
  WorldReader(const text::YamlNode& root, const FileReader& read, const World* like, Loaded<World>& loaded)
      : root_(root), read_(read), like_(like), found_(loaded.diagnostics) {}

  World read() {
    YamlFields fields(root_, "sim", "the world", found_);
    map(fields);
    fields.duration("step", world_.step, {0.001, 0.1});
    locations(fields.node("locations"));
    areas(fields.node("areas"));
    stations(fields.node("stations"));
    obstacles(fields.node("obstacles"));
    doors(fields.node("doors"));
    people(fields.node("people"));
    robots(fields);
    fields.finish();
    if (!has_errors(found_)) check_sense();
    return std::move(world_);
  }

 private:
  struct Place {
    Pose2 pose;
    SourceSpan span;
    std::string what;
  };

  void error(std::string_view code, std::string message, const SourceSpan& span) {
    found_.push_back({Severity::kError, fmt::format("sim.{}", code), std::move(message), span});
  }

  void map(YamlFields& fields) {
    const text::YamlNode* node = fields.required("map");
    if (node == nullptr) return;
    std::string name;
    fields.text("map", name);
    if (name.empty()) return;
    if (like_ != nullptr) {
      world_.map_id = like_->map_id;
      world_.map = like_->map;
      world_.distance = like_->distance;
      world_.rays = like_->rays;
      return;
    }
    const auto source = read_(name);
    if (!source) {
      Diagnostic missing = source.error();
      missing.message = fmt::format("the world's map \"{}\": {}", name, missing.message);
      missing.span = node->span;
      found_.push_back(std::move(missing));
      return;
    }
    const std::filesystem::path folder = std::filesystem::path(name).parent_path();
    const auto beside = [&](const std::string& image) { return read_((folder / image).string()); };
    const std::string shown = (std::filesystem::path(node->span.file).parent_path() / name).string();
    Loaded<GridMap> map = parse_map(*source, shown, beside);
    found_.insert(found_.end(), map.diagnostics.begin(), map.diagnostics.end());
    if (!map.ok()) return;
    world_.map_id = std::filesystem::path(name).stem().string();
    world_.map = cropped_to_known(*map.value);
    world_.distance = DistanceField(world_.map);
    world_.rays = RayField(world_.map);
  }

  // Each entry of a mapping name → what, bounded, names as YAML keys (which are unique).
  template <class Read>
  void named(const text::YamlNode* node, const std::string& kind, std::size_t max, Read&& read) {
    if (node == nullptr || node->is_null()) return;
    if (!node->is_mapping()) {
      error("bad-value", fmt::format("the {} must be a mapping from names", kind), node->span);
      return;
    }
    if (node->entries.size() > max) {
      error("too-many", fmt::format("the world has {} {}; at most {} are supported", node->entries.size(), kind, max),
            node->span);
      return;
    }
    for (const auto& [key, value] : node->entries) read(key, value);
  }

  void locations(const text::YamlNode* node) {
    named(node, "locations", kLocationsMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      NamedLocation location{.name = key.scalar};
      if (const auto pose = read_pose(value)) {
        location.pose = *pose;
      } else if (value.is_sequence()) {
        error("bad-value", fmt::format("location \"{}\": {}", key.scalar, why_no_pose(value)), value.span);
      } else {
        YamlFields fields(value, "sim", fmt::format("location \"{}\"", key.scalar), found_);
        if (value.is_mapping() && fields.required("pose") != nullptr) fields.pose("pose", location.pose);
        fields.text("description", location.description);
        fields.finish();
      }
      places_.push_back({location.pose, value.span, fmt::format("location \"{}\"", location.name)});
      names_.push_back(location.name);
      world_.locations.push_back(std::move(location));
    });
  }

  void areas(const text::YamlNode* node) {
    named(node, "areas", kLocationsMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      NamedArea area{.name = key.scalar};
      YamlFields fields(value, "sim", fmt::format("area \"{}\"", key.scalar), found_);
      if (const text::YamlNode* corners = fields.required("corners")) {
        bool good = corners->is_sequence() && corners->items.size() >= 3 && corners->items.size() <= kCornersMax;
        for (const text::YamlNode& item : corners->items) {
          const auto corner = read_pose(item);
          good = good && corner && item.items.size() == 2;
          if (corner) area.points.push_back(corner->position());
        }
        if (!good) {
          fields.error(
              "bad-value",
              fmt::format("corners of area \"{}\" must be 3 to {} points [x, y] in m", key.scalar, kCornersMax),
              corners->span);
        }
      }
      fields.text("description", area.description);
      fields.finish();
      if (std::find(names_.begin(), names_.end(), area.name) != names_.end()) {
        error("duplicate-name", fmt::format("area \"{}\" has the name of a location; rename one", area.name), key.span);
      }
      names_.push_back(area.name);
      world_.areas.push_back(std::move(area));
    });
  }

  // A pose, or the name of a location.
  void pose_or_location(YamlFields& fields, std::string_view key, const std::string& what, Pose2& out,
                        SourceSpan& span) {
    const text::YamlNode* node = fields.required(key);
    if (node == nullptr) return;
    span = node->span;
    if (!node->is_scalar()) {
      fields.pose(key, out);
      return;
    }
    std::vector<std::string> names;
    for (const NamedLocation& location : world_.locations) {
      if (location.name == node->scalar) {
        out = location.pose;
        return;
      }
      names.push_back(location.name);
    }
    error("unknown-location",
          fmt::format("{} of {} is \"{}\", which is no location{}", key, what, node->scalar,
                      did_you_mean(node->scalar, names)),
          node->span);
  }

  void stations(const text::YamlNode* node) {
    named(node, "stations", kObstaclesMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      Station station{.name = key.scalar};
      const std::string what = fmt::format("station \"{}\"", key.scalar);
      YamlFields fields(value, "sim", what, found_);
      SourceSpan span = value.span;
      pose_or_location(fields, "pose", what, station.pose, span);
      fields.number("linear_tolerance", station.linear_tolerance_m, {0.0, 10.0, true});
      fields.number("angular_tolerance", station.angular_tolerance_rad, {0.0, std::numbers::pi, true}, angle_units());
      fields.boolean("contacts", station.contacts);
      fields.finish();
      places_.push_back({station.pose, span, what});
      station_spans_.push_back(value.span);
      world_.stations.push_back(std::move(station));
    });
  }

  void obstacles(const text::YamlNode* node) {
    named(node, "obstacles", kObstaclesMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      Obstacle obstacle{.id = key.scalar};
      const std::string what = fmt::format("obstacle \"{}\"", key.scalar);
      YamlFields fields(value, "sim", what, found_);
      Pose2 pose;
      fields.pose("pose", pose);
      double radius = 0.0;
      fields.number("radius", radius, {0.0, 100.0, true});
      if (const text::YamlNode* size = fields.node("size")) {
        Vec2 sides;
        fields.point("size", sides);
        if (radius > 0.0)
          error("bad-value", what + " has a radius and a size; a disc has the one, a box the other", size->span);
        else if (sides.x <= 0.0 || sides.y <= 0.0)
          error("bad-value", what + " has no positive size [length, width]", size->span);
        obstacle.shape = Shape::box(pose, sides.x, sides.y);
      } else if (radius > 0.0) {
        obstacle.shape = Shape::disc(pose.position(), radius);
      } else if (value.is_mapping()) {
        error("missing-key", what + " needs a radius (disc) or a size [length, width] (box)", value.span);
      }
      fields.boolean("on_map", obstacle.on_map);
      fields.finish();
      world_.obstacles.push_back(std::move(obstacle));
    });
  }

  void doors(const text::YamlNode* node) {
    named(node, "doors", kObstaclesMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      Door door{.id = key.scalar};
      YamlFields fields(value, "sim", fmt::format("door \"{}\"", key.scalar), found_);
      if (fields.required("from") != nullptr) fields.point("from", door.a);
      if (fields.required("to") != nullptr) fields.point("to", door.b);
      fields.number("thickness", door.thickness_m, {0.0, 10.0, true});
      fields.boolean("open", door.open);
      fields.boolean("on_map", door.on_map);
      fields.finish();
      world_.doors.push_back(std::move(door));
    });
  }

  void people(const text::YamlNode* node) {
    named(node, "people", kObstaclesMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      Person person{.name = key.scalar};
      const std::string what = fmt::format("person \"{}\"", key.scalar);
      YamlFields fields(value, "sim", what, found_);
      const text::YamlNode* where = fields.required("plugs_in_at");
      fields.text("plugs_in_at", person.station);
      fields.number("below", person.below, {0.0, 1.0}, ratio_units());
      fields.duration("after", person.after, {0.0, 1e6});
      fields.finish();
      std::vector<std::string> names;
      for (const Station& station : world_.stations) names.push_back(station.name);
      if (where != nullptr && std::find(names.begin(), names.end(), person.station) == names.end()) {
        error("unknown-station",
              fmt::format("{} plugs in at \"{}\", which is no station{}", what, person.station,
                          did_you_mean(person.station, names)),
              where->span);
      }
      world_.people.push_back(std::move(person));
    });
  }

  // The sections of a robot; what they do not mention stays as it is in `robot`.
  void sections(YamlFields& fields, RobotSpec& robot, const std::string& of) {
    const text::YamlNode empty;
    const auto section = [&](std::string_view name, auto&& read) {
      const text::YamlNode* node = fields.node(name);
      // `localization: exact` says the method alone.
      text::YamlNode method;
      if (node != nullptr && node->is_scalar() && name == "localization") {
        text::YamlNode key = *node;
        key.scalar = "method";
        method.kind = text::YamlNode::Kind::kMapping;
        method.span = node->span;
        method.entries.emplace_back(std::move(key), *node);
        node = &method;
      }
      YamlFields inner(node != nullptr ? *node : empty, "sim", std::string(name) + of, found_);
      read(inner);
      inner.finish();
    };
    section("body", [&](YamlFields& f) { f.number("radius", robot.radius_m, {0.0, 5.0, true}); });
    section("motion", [&](YamlFields& f) {
      f.number("speed", robot.limits.speed_m_s, {0.0, 10.0, true});
      f.number("turn_speed", robot.limits.turn_rad_s, {0.0, 20.0, true}, angle_units());
      f.number("acceleration", robot.limits.acceleration_m_s2, {0.0, 100.0, true});
      f.number("turn_acceleration", robot.limits.turn_acceleration_rad_s2, {0.0, 100.0, true}, angle_units());
    });
    section("odometry", [&](YamlFields& f) {
      f.number("scale", robot.odometry.scale, {-0.5, 0.5}, ratio_units());
      f.number("turn_scale", robot.odometry.turn_scale, {-0.5, 0.5}, ratio_units());
      f.number("noise", robot.odometry.white, {0.0, 1.0}, ratio_units());
    });
    section("laser", [&](YamlFields& f) { laser(f, robot.laser); });
    section("battery", [&](YamlFields& f) { battery(f, robot.battery); });
    section("localization", [&](YamlFields& f) { localization(f, robot.localization); });
    section("navigation", [&](YamlFields& f) { navigation(f, robot.navigation); });
  }

  void laser(YamlFields& f, LaserSpec& laser) {
    // A whole turn does not measure its first direction twice; a part of one has a beam at both ends.
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const auto gaps = [&](bool whole_turn) { return whole_turn ? laser.beams : std::max(1, laser.beams - 1); };
    const bool was_whole = laser.angle_increment_rad * laser.beams > kTurn - 1e-6;
    double view = laser.angle_increment_rad * gaps(was_whole);
    f.pose("mount", laser.mount);
    f.integer("beams", laser.beams, 1, kBeamsMax);
    f.number("view", view, {0.0, 2.0 * std::numbers::pi + 1e-9}, angle_units());
    f.number("range_min", laser.range_min_m, {0.0, 1000.0});
    f.number("range_max", laser.range_max_m, {0.0, 1000.0, true});
    f.duration("period", laser.period, {0.001, 10.0});
    f.number("noise", laser.noise_m, {0.0, 10.0});
    f.number("dropout", laser.dropout, {0.0, 1.0}, ratio_units());
    laser.angle_min_rad = -view / 2;
    laser.angle_increment_rad = view / gaps(view > kTurn - 1e-6);
  }

  void battery(YamlFields& f, BatterySpec& battery) {
    const auto ratio = ratio_units();
    f.number("initial", battery.initial_charge, {0.0, 1.0}, ratio);
    f.number("drain_standing", battery.drain_per_s, {0.0, 1.0}, ratio_by_time_units());
    f.number("drain_moving", battery.drain_per_m, {0.0, 1.0}, ratio_by_length_units());
    f.number("charging", battery.charge_per_s, {0.0, 1.0, true}, ratio_by_time_units());
    f.number("capacity_Ah", battery.capacity_Ah, {0.0, 1e6, true});
    f.number("voltage_empty", battery.voltage_empty_V, {0.0, 1e4});
    f.number("voltage_full", battery.voltage_full_V, {0.0, 1e4});
    f.number("ambient_C", battery.ambient_C, {-100.0, 100.0});
    f.number("heating_K_per_A", battery.heating_K_per_A, {0.0, 100.0});
    f.duration("thermal_time", battery.thermal_time, {0.001, 1e6});
    f.number("low", battery.low, {0.0, 1.0}, ratio);
    f.number("critical", battery.critical, {0.0, 1.0}, ratio);
  }

  void localization(YamlFields& f, LocalizationSpec& spec) {
    const std::array<std::string, 3> methods{"odometry", "amcl", "exact"};
    if (const auto method = f.choice("method", methods)) spec.method = static_cast<LocalizationSpec::Method>(*method);
    constexpr int kParticlesMax = 200'000;
    f.integer("particles_min", spec.particles_min, 10, kParticlesMax);
    f.integer("particles_max", spec.particles_max, 10, kParticlesMax);
    f.integer("particles_global", spec.particles_global, 10, kParticlesMax);
    f.integer("beams", spec.beams, 1, kBeamsMax);
    f.number("hit_sigma", spec.reading.hit_sigma_m, {0.0, 10.0, true});
    f.number("random_share", spec.reading.random_share, {0.0, 10.0, true});
    f.number("tempering", spec.tempering, {0.0, 1.0, true});
    f.number("update_distance", spec.update_distance_m, {0.0, 10.0});
    f.number("update_angle", spec.update_angle_rad, {0.0, std::numbers::pi}, angle_units());
    f.number("recovery_slow", spec.recovery_slow, {0.0, 1.0});
    f.number("recovery_fast", spec.recovery_fast, {0.0, 1.0});
    if (spec.particles_min > spec.particles_max) {
      f.error("bad-value", "particles_min is above particles_max", f.span());
    }
  }

  void navigation(YamlFields& f, NavigationSpec& spec) {
    f.number("margin", spec.margin_m, {0.0, 10.0});
    f.number("fade", spec.fade_m, {0.0, 10.0});
    f.number("linear_tolerance", spec.goal_linear_tolerance_m, {0.01, 10.0});
    f.number("angular_tolerance", spec.goal_angular_tolerance_rad, {0.01, std::numbers::pi}, angle_units());
    f.number("lookahead", spec.lookahead_m, {0.15, 10.0});
    f.duration("patience", spec.patience, {0.1, 1e6});
    f.integer("recoveries", spec.recoveries_max, 0, 1000);
    f.duration("time_limit", spec.goal_time_max, {0.1, 1e9});
    int expansions = static_cast<int>(spec.plan_expansions_max);
    f.integer("plan_cells", expansions, 1, std::numeric_limits<int>::max());
    spec.plan_expansions_max = static_cast<std::uint64_t>(expansions);
  }

  void robots(YamlFields& fields) {
    RobotSpec common;
    sections(fields, common, "");
    const text::YamlNode* one = fields.node("start");
    const text::YamlNode* several = fields.node("robots");
    if ((one == nullptr) == (several == nullptr)) {
      error("missing-key",
            one == nullptr ? "the world needs the robot's \"start\", or \"robots\""
                           : "the world has \"start\" and \"robots\"; give each robot its own start",
            (several != nullptr ? *several : root_).span);
      return;
    }
    if (one != nullptr) {
      SourceSpan span;
      pose_or_location(fields, "start", "the world", common.start, span);
      start_spans_.push_back(span);
      world_.robots.push_back(std::move(common));
      return;
    }
    named(several, "robots", kRobotsMax, [&](const text::YamlNode& key, const text::YamlNode& value) {
      RobotSpec robot = common;
      robot.name = key.scalar;
      const std::string what = fmt::format("robot \"{}\"", key.scalar);
      YamlFields own(value, "sim", what, found_);
      SourceSpan span = value.span;
      pose_or_location(own, "start", what, robot.start, span);
      sections(own, robot, " of " + what);
      own.finish();
      start_spans_.push_back(span);
      world_.robots.push_back(std::move(robot));
    });
    if (world_.robots.empty()) error("missing-key", "the world has no robot", several->span);
  }

  void check_sense() {
    for (std::size_t i = 0; i < world_.robots.size(); ++i) {
      RobotSpec& robot = world_.robots[i];
      const RobotSpec* known = like_ != nullptr && i < like_->robots.size() ? &like_->robots[i] : nullptr;
      if (known != nullptr && known->radius_m == robot.radius_m && known->navigation == robot.navigation &&
          known->localization.reading == robot.localization.reading) {
        robot.costs = known->costs;
        robot.likelihood = known->likelihood;
      } else {
        derive(world_, robot);
      }
      const Cell cell = world_.map.cell_at(robot.start.position());
      const double room = clearance(world_.map, world_.distance, robot.start.position(), robot.radius_m);
      if (!world_.map.is_free(cell) || room < robot.radius_m) {
        error("bad-place",
              fmt::format("robot \"{}\" starts {}, where a disc of radius {} m does not fit on the map", robot.name,
                          where(robot.start), shortest_decimal(robot.radius_m)),
              start_spans_[i]);
      }
    }
    const CostGrid& costs = world_.robots.front().costs;
    for (const Place& place : places_) {
      if (costs.at(world_.map.cell_at(place.pose.position())) != CostGrid::kBlocked) continue;
      error("bad-place",
            fmt::format(
                "{} is {}, where the robot cannot stand: off the known floor, or within {} m of a wall", place.what,
                where(place.pose),
                shortest_decimal(world_.robots.front().navigation.inflation(world_.robots.front().radius_m).blocked_m)),
            place.span);
    }
    const Tolerances goal = navigation_tolerances(world_);
    for (std::size_t i = 0; i < world_.stations.size(); ++i) {
      const Station& station = world_.stations[i];
      if (station.linear_tolerance_m <= goal.linear_m || station.angular_tolerance_rad <= goal.angular_rad) {
        error("tolerance",
              fmt::format("station \"{}\" charges within {} m and {} rad, but navigation stops within {} m and {} rad; "
                          "make the station's the larger",
                          station.name, shortest_decimal(station.linear_tolerance_m),
                          shortest_decimal(station.angular_tolerance_rad), shortest_decimal(goal.linear_m),
                          shortest_decimal(goal.angular_rad)),
              station_spans_[i]);
      }
    }
  }

  static std::string where(const Pose2& pose) {
    return fmt::format("at ({}, {})", shortest_decimal(pose.x), shortest_decimal(pose.y));
  }

  const text::YamlNode& root_;
  const FileReader& read_;
  const World* like_;
  Diagnostics& found_;
  World world_;
  std::vector<Place> places_;
  std::vector<std::string> names_;
  std::vector<SourceSpan> station_spans_;
  std::vector<SourceSpan> start_spans_;
};

}  // namespace

Loaded<World> parse_world(std::string_view source, const std::string& file, const FileReader& read) {
  const auto root = text::parse_yaml(source, file);
  if (!root) return {std::nullopt, {root.error()}};
  return parse_world(*root, read);
}

Loaded<World> parse_world(const text::YamlNode& root, const FileReader& read) {
  return parse_world_like(root, read, nullptr);
}

Loaded<World> parse_world_like(const text::YamlNode& root, const FileReader& read, const World* like) {
  Loaded<World> loaded;
  World world = WorldReader(root, read, like, loaded).read();
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(world);
  sort_by_place(loaded.diagnostics);
  return loaded;
}

Loaded<World> load_world(const std::string& path, std::string shown_as) {
  if (shown_as.empty()) shown_as = path;
  const auto source = text::read_file(path, shown_as);
  if (!source) return {std::nullopt, {source.error()}};
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const std::filesystem::path shown_folder = std::filesystem::path(shown_as).parent_path();
  return parse_world(*source, shown_as, [&](const std::string& name) {
    return text::read_file(folder / name, (shown_folder / name).string(), kImageBytesMax);
  });
}

}  // namespace sentree::sim
