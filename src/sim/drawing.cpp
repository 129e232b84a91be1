#include "sentree/sim/drawing.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

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
    const std::string width = fixed((high.x - low.x) * scale);
    const std::string height = fixed((high.y - low.y) * scale);
    out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" + height +
           "\" viewBox=\"0 0 " + width + " " + height +
           "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
  }

  std::string x(double v) const { return fixed((v - left_) * scale_); }
  std::string y(double v) const { return fixed((top_ - v) * scale_); }
  std::string length(double v) const { return fixed(v * scale_); }
  std::string at(Vec2 p) const { return x(p.x) + "," + y(p.y); }

  void add(const std::string& markup) { out_ += markup + "\n"; }
  void disc(Vec2 centre, double radius_m, const std::string& style) {
    add("<circle cx=\"" + x(centre.x) + "\" cy=\"" + y(centre.y) + "\" r=\"" + length(radius_m) + "\" " + style + "/>");
  }
  void line(Vec2 a, Vec2 b, const std::string& style) {
    add("<line x1=\"" + x(a.x) + "\" y1=\"" + y(a.y) + "\" x2=\"" + x(b.x) + "\" y2=\"" + y(b.y) + "\" " + style +
        "/>");
  }
  void polygon(std::span<const Vec2> points, const std::string& style, std::string_view element = "polygon") {
    std::string list;
    for (const Vec2 p : points) list += (list.empty() ? "" : " ") + at(p);
    add("<" + std::string(element) + " points=\"" + list + "\" " + style + "/>");
  }
  void label(Vec2 p, std::string_view words, const std::string& style) {
    add("<text x=\"" + x(p.x) + "\" y=\"" + y(p.y) + "\" " + style + ">" + text::xml_escape(words) + "</text>");
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
  std::string finish() && { return std::move(out_) + "</svg>\n"; }

 private:
  double scale_;
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
        path += "M" + corner(x, y) + "L" + corner(end, y) + "L" + corner(end, y + 1) + "L" + corner(x, y + 1) + "Z";
        x = end;
      }
    }
    if (!path.empty()) canvas.add("<path fill=\"" + colour + "\" d=\"" + path + "\"/>");
  };
  rows([](std::int8_t v) { return v == GridMap::kUnknown; }, "#ccc");
  rows([](std::int8_t v) { return v >= GridMap::kOccupiedMin; }, "#222");
}

void draw_places(Canvas& canvas, const State& state) {
  for (const NamedArea& area : state.areas) {
    canvas.polygon(area.points, "fill=\"#4a90d9\" fill-opacity=\"0.08\" stroke=\"#4a90d9\" stroke-dasharray=\"4 4\"");
  }
  for (const NamedLocation& location : state.locations) {
    canvas.disc(location.pose.position(), 0.08, "fill=\"#4a90d9\"");
    canvas.arrow(location.pose, 0.3, "stroke=\"#4a90d9\" stroke-width=\"2\"");
    canvas.label(location.pose.position() + Vec2{0.12, -0.32}, location.name, "fill=\"#2c5f91\"");
  }
}

void draw_robot(Canvas& canvas, const RobotSpec& spec, const RobotState& robot, const DrawingOptions& options) {
  if (options.scan) {
    const Pose2 laser = compose(robot.truth.pose, spec.laser.mount);
    for (std::size_t i = 0; i < robot.scan.ranges.size(); ++i) {
      const double range = robot.scan.ranges[i];
      if (!std::isfinite(range)) continue;
      const double angle = spec.laser.angle_min_rad + static_cast<double>(i) * spec.laser.angle_increment_rad;
      canvas.disc(transform(laser, {range * std::cos(angle), range * std::sin(angle)}), 0.03, "fill=\"#d0342c\"");
    }
  }
  if (options.particles) {
    const auto& particles = robot.localization.particles;
    const std::size_t stride = particles.size() / kParticlesShown + 1;
    for (std::size_t i = 0; i < particles.size(); i += stride) {
      canvas.arrow(particles[i].pose, 0.12, "stroke=\"#7b4fa3\" stroke-opacity=\"0.5\"");
    }
  }
  const Navigator& navigator = robot.navigator;
  if (options.path && navigator.path.size() > 1) {
    canvas.polygon(navigator.path, "fill=\"none\" stroke=\"#2e8b57\" stroke-width=\"2\"", "polyline");
  }
  const Pose2 belief = estimated_pose(robot.localization, robot.odometry);
  if (distance(belief.position(), robot.truth.pose.position()) > 0.02) {
    canvas.disc(belief.position(), spec.radius_m, "fill=\"none\" stroke=\"#7b4fa3\" stroke-dasharray=\"3 3\"");
  }
  canvas.disc(robot.truth.pose.position(), spec.radius_m, "fill=\"#f5a623\" fill-opacity=\"0.85\" stroke=\"#8a5a00\"");
  canvas.arrow(robot.truth.pose, spec.radius_m, "stroke=\"#8a5a00\" stroke-width=\"3\"");
  const int percent = static_cast<int>(std::lround(robot.battery.charge * 100.0));
  canvas.label(robot.truth.pose.position() + Vec2{0.0, spec.radius_m + 0.1},
               spec.name + " " + std::to_string(percent) + " %", "text-anchor=\"middle\" fill=\"#8a5a00\"");
}

}  // namespace

std::string to_svg(const World& world, const State& state, const DrawingOptions& options) {
  Canvas canvas(world.map, std::clamp(options.pixels_per_m, 1.0, 1000.0));
  draw_map(canvas, world.map);
  if (options.places) draw_places(canvas, state);
  for (const Station& station : world.stations) {
    canvas.disc(station.pose.position(), station.linear_tolerance_m,
                "fill=\"#2e8b57\" fill-opacity=\"0.15\" stroke=\"#2e8b57\"");
  }
  for (const Obstacle& obstacle : state.obstacles) canvas.shape(obstacle.shape, "fill=\"#777\"");
  for (const Door& door : state.doors) {
    canvas.line(door.a, door.b,
                std::string("stroke=\"#b5651d\" stroke-width=\"4\"") + (door.open ? " stroke-opacity=\"0.25\"" : ""));
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i) draw_robot(canvas, world.robots[i], state.robots[i], options);
  return std::move(canvas).finish();
}

}  // namespace sentree::sim
