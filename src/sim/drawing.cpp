#include "sentree/sim/drawing.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/sim/area.h"
#include "sentree/text/xml.h"

namespace sentree::sim {

namespace {

constexpr std::size_t kParticlesShown = 1000;

// Hundredths of a pixel: more only make the file large.
std::string fixed(double v) {
  std::array<char, 64> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), v, std::chars_format::fixed, 2).ptr;
  std::string text(buffer.data(), end);
  return text == "-0.00" ? "0.00" : text;
}

// SVG with y down, from the map frame with y up.
class Canvas {
 public:
  Canvas(const GridMap& map, double scale) : scale_(scale) {
    const double w = map.width();
    const double h = map.height();
    Vec2 low{1e18, 1e18};
    Vec2 high{-1e18, -1e18};
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{w, 0}, Vec2{w, h}, Vec2{0, h}}) {
      const Vec2 p = map.from_grid(corner);
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    left_ = low.x;
    top_ = high.y;
    bottom_ = (high.y - low.y) * scale;
    const std::string width = fixed((high.x - low.x) * scale);
    const std::string height = fixed(bottom_ + kFooter);
    out_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {} {}\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        width, height, width, height);
  }

  std::string x(double v) const { return fixed((v - left_) * scale_); }
  std::string y(double v) const { return fixed((top_ - v) * scale_); }
  std::string length(double v) const { return fixed(v * scale_); }
  double metres(double pixels) const { return pixels / scale_; }
  std::string at(Vec2 p) const { return fmt::format("{},{}", x(p.x), y(p.y)); }

  void add(const std::string& markup) { out_ += markup + "\n"; }
  void disc(Vec2 centre, double radius_m, const std::string& style) {
    add(fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/>", x(centre.x), y(centre.y), length(radius_m), style));
  }
  void line(Vec2 a, Vec2 b, const std::string& style) {
    add(fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" {}/>", x(a.x), y(a.y), x(b.x), y(b.y), style));
  }
  void polygon(std::span<const Vec2> points, const std::string& style, std::string_view element = "polygon") {
    std::string list;
    for (const Vec2 p : points) list += (list.empty() ? "" : " ") + at(p);
    add(fmt::format("<{} points=\"{}\" {}/>", element, list, style));
  }
  void label(Vec2 p, std::string_view words, const std::string& style) {
    add(fmt::format("<text x=\"{}\" y=\"{}\" {}>{}</text>", x(p.x), y(p.y), style, text::xml_escape(words)));
  }
  void arrow(const Pose2& pose, double length_m, const std::string& style) {
    line(pose.position(), transform(pose, {length_m, 0.0}), style);
  }
  void shape(const Shape& shape, const std::string& style) {
    if (shape.kind == Shape::Kind::kDisc)
      disc(shape.pose.position(), shape.radius_m, style);
    else
      polygon(corners(shape), style);
  }
  // Below the map: how long a round number of metres is, and some words.
  void footer(std::string_view words) {
    double metres = 0.1;
    for (const double step : {0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
      if (step * scale_ <= kScaleBar) metres = step;
    }
    const std::string y = fixed(bottom_ + kFooter / 2);
    const std::string text_y = fixed(bottom_ + kFooter / 2 + 4.0);
    const double end = 8.0 + metres * scale_;
    add(fmt::format("<path d=\"M8,{}v8M8,{}H{}m0,-4v8\" stroke=\"#444\" fill=\"none\"/>",
                    fixed(bottom_ + kFooter / 2 - 4.0), y, fixed(end)));
    add(fmt::format("<text x=\"{}\" y=\"{}\" fill=\"#444\">{} m   {}</text>", fixed(end + 8.0), text_y,
                    shortest_decimal(metres), text::xml_escape(words)));
  }
  std::string finish() && { return std::move(out_) + "</svg>\n"; }

 private:
  static constexpr double kFooter = 24.0;     // pixels
  static constexpr double kScaleBar = 120.0;  // at most
  double scale_;
  double bottom_ = 0.0;
  double left_ = 0.0;
  double top_ = 0.0;
  std::string out_;
};

// Runs of equal cells of each row become one rectangle, in the map's own frame.
void draw_map(Canvas& canvas, const GridMap& map) {
  const auto rows = [&](auto&& belongs, const std::string& colour) {
    std::string path;
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        if (!belongs(map.at({x, y}))) continue;
        int end = x;
        while (end < map.width() && belongs(map.at({end, y}))) ++end;
        const auto corner = [&](int cx, int cy) {
          return canvas.at(map.from_grid({static_cast<double>(cx), static_cast<double>(cy)}));
        };
        path += fmt::format("M{}L{}L{}L{}Z", corner(x, y), corner(end, y), corner(end, y + 1), corner(x, y + 1));
        x = end;
      }
    }
    if (!path.empty()) canvas.add(fmt::format("<path fill=\"{}\" d=\"{}\"/>", colour, path));
  };
  rows([](std::int8_t v) { return v == GridMap::kUnknown; }, "#ccc");
  rows([](std::int8_t v) { return v >= GridMap::kOccupiedMin; }, "#222");
}

void draw_areas(Canvas& canvas, const State& state) {
  for (const NamedArea& area : state.areas) {
    canvas.polygon(area.points, "fill=\"#4a90d9\" fill-opacity=\"0.08\" stroke=\"#4a90d9\" stroke-dasharray=\"4 4\"");
    canvas.label(centroid(area.points), area.name,
                 "text-anchor=\"middle\" fill=\"#4a90d9\" fill-opacity=\"0.8\" font-style=\"italic\"");
  }
}

void draw_places(Canvas& canvas, const State& state) {
  for (const NamedLocation& location : state.locations) {
    canvas.disc(location.pose.position(), std::max(0.08, canvas.metres(3.0)), "fill=\"#4a90d9\"");
    canvas.arrow(location.pose, std::max(0.3, canvas.metres(9.0)), "stroke=\"#4a90d9\" stroke-width=\"2\"");
    canvas.label(location.pose.position() + Vec2{0.12, -0.32}, location.name, "fill=\"#2c5f91\"");
  }
}

void draw_robot(Canvas& canvas, const RobotSpec& spec, const RobotState& robot, const DrawingOptions& options) {
  if (options.scan) {
    // From where it was taken, as far as odometry knows how the robot moved since.
    const Pose2 moved = relative(robot.odometry, robot.scan_odometry);
    const Pose2 laser = compose(compose(robot.truth.pose, moved), spec.laser.mount);
    const double view = spec.laser.angle_increment_rad * static_cast<double>(robot.scan.ranges.size());
    std::vector<Vec2> seen;
    if (view < 2.0 * std::numbers::pi - 1e-6) seen.push_back(laser.position());
    for (std::size_t i = 0; i < robot.scan.ranges.size(); ++i) {
      const double range = std::clamp(robot.scan.ranges[i], 0.0, spec.laser.range_max_m);
      const double angle = spec.laser.angle_min_rad + static_cast<double>(i) * spec.laser.angle_increment_rad;
      seen.push_back(transform(laser, {range * std::cos(angle), range * std::sin(angle)}));
    }
    canvas.polygon(seen, "fill=\"#d0342c\" fill-opacity=\"0.06\"");
    for (std::size_t i = 0; i < robot.scan.ranges.size(); ++i) {
      const double range = robot.scan.ranges[i];
      if (!std::isfinite(range)) continue;
      const double angle = spec.laser.angle_min_rad + static_cast<double>(i) * spec.laser.angle_increment_rad;
      canvas.disc(transform(laser, {range * std::cos(angle), range * std::sin(angle)}),
                  std::max(0.03, canvas.metres(1.5)), "fill=\"#d0342c\"");
    }
  }
  if (options.particles) {
    const auto& particles = robot.localization.particles;
    const std::size_t stride = particles.size() / kParticlesShown + 1;
    for (std::size_t i = 0; i < particles.size(); i += stride) {
      canvas.arrow(particles[i].pose, std::max(0.12, canvas.metres(6.0)), "stroke=\"#7b4fa3\" stroke-opacity=\"0.5\"");
    }
  }
  const Navigator& navigator = robot.navigator;
  if (options.path && navigator.path.size() > 1) {
    canvas.polygon(navigator.path, "fill=\"none\" stroke=\"#2e8b57\" stroke-width=\"2\"", "polyline");
  }
  if (options.path && is_active(navigator.status)) {
    for (std::size_t i = navigator.waypoint; i < navigator.goal.waypoints.size(); ++i) {
      const Pose2& stop = navigator.goal.waypoints[i];
      canvas.disc(stop.position(), spec.radius_m, "fill=\"none\" stroke=\"#2e8b57\" stroke-width=\"2\"");
      canvas.arrow(stop, spec.radius_m, "stroke=\"#2e8b57\" stroke-width=\"2\"");
    }
  }
  const Pose2 belief = estimated_pose(robot.localization, robot.odometry);
  if (distance(belief.position(), robot.truth.pose.position()) > 0.02) {
    canvas.disc(belief.position(), spec.radius_m, "fill=\"none\" stroke=\"#7b4fa3\" stroke-dasharray=\"3 3\"");
  }
  canvas.disc(robot.truth.pose.position(), spec.radius_m, "fill=\"#f5a623\" fill-opacity=\"0.85\" stroke=\"#8a5a00\"");
  canvas.arrow(robot.truth.pose, spec.radius_m, "stroke=\"#8a5a00\" stroke-width=\"3\"");
  const int percent = static_cast<int>(std::lround(robot.battery.charge * 100.0));
  canvas.label(robot.truth.pose.position() + Vec2{0.0, spec.radius_m + 0.1}, fmt::format("{} {} %", spec.name, percent),
               "text-anchor=\"middle\" fill=\"#8a5a00\"");
}

}  // namespace

std::string to_svg(const World& world, const State& state, const DrawingOptions& options) {
  Canvas canvas(world.map, std::clamp(options.pixels_per_m, 1.0, 1000.0));
  if (options.places) draw_areas(canvas, state);
  draw_map(canvas, world.map);
  if (options.places) draw_places(canvas, state);
  for (const Station& station : world.stations) {
    canvas.disc(station.pose.position(), station.linear_tolerance_m,
                "fill=\"#2e8b57\" fill-opacity=\"0.15\" stroke=\"#2e8b57\"");
  }
  for (const Obstacle& obstacle : state.obstacles) {
    canvas.shape(obstacle.shape, obstacle.on_map ? "fill=\"#555\"" : "fill=\"#8a6d5a\"");
    if (options.places) {
      canvas.label(obstacle.shape.pose.position() + Vec2{0.0, bounding_radius(obstacle.shape) + 0.05}, obstacle.id,
                   "text-anchor=\"middle\" fill=\"#6b4f3c\" font-size=\"10\"");
    }
  }
  for (const Door& door : state.doors) {
    canvas.line(door.a, door.b,
                fmt::format("stroke=\"#b5651d\" stroke-width=\"{}\"{}", canvas.length(std::max(door.thickness_m, 0.05)),
                            door.open ? " stroke-opacity=\"0.25\" stroke-dasharray=\"4 3\"" : ""));
    if (options.places) {
      canvas.label(0.5 * (door.a + door.b) + Vec2{0.0, 0.12}, door.id,
                   "text-anchor=\"middle\" fill=\"#b5651d\" font-size=\"10\"");
    }
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i) draw_robot(canvas, world.robots[i], state.robots[i], options);
  canvas.footer(fmt::format("{}   t = {} s", world.map_id, fixed(seconds(state.time))));
  return std::move(canvas).finish();
}

}  // namespace sentree::sim
