#include "sentree/record/foxglove.h"

#include <cmath>

#include "sentree/base/json.h"
#include "sentree/record/detail/print.h"

namespace sentree::record {

namespace {

using detail::append_rounded;

template <class Number>
void append_number(std::string& out, Number number) {
  detail::append_integer(out, number);
}

void append_time(std::string& out, std::string_view key, TimePoint time) {
  const std::int64_t ns = time.time_since_epoch().count();
  out += '"';
  out += key;
  out += R"(":{"sec":)";
  append_number(out, ns / 1'000'000'000);
  out += R"(,"nsec":)";
  append_number(out, ns % 1'000'000'000);
  out += '}';
}

void append_stamped(std::string& out, TimePoint time) {
  out += '{';
  append_time(out, "timestamp", time);
  out += R"(,"frame_id":"map",)";
}

void append_pose_object(std::string& out, const Pose& pose, double z = 0.0) {
  out += R"({"position":{"x":)";
  append_rounded(out, pose.x, 6);
  out += R"(,"y":)";
  append_rounded(out, pose.y, 6);
  out += R"(,"z":)";
  append_rounded(out, z, 6);
  out += R"(},"orientation":{"x":0,"y":0,"z":)";
  append_rounded(out, std::sin(pose.theta / 2), 6);
  out += R"(,"w":)";
  append_rounded(out, std::cos(pose.theta / 2), 6);
  out += "}}";
}

void pack_stamped(PackedJson& out, TimePoint time) {
  const std::int64_t ns = time.time_since_epoch().count();
  out.raw(R"({"timestamp":{"sec":)");
  out.integer(ns / 1'000'000'000);
  out.raw(R"(,"nsec":)");
  out.integer(ns % 1'000'000'000);
  out.raw(R"(},"frame_id":"map",)");
}

void pack_pose_object(PackedJson& out, const Pose& pose) {
  out.raw(R"({"position":{"x":)");
  out.rounded(pose.x);
  out.raw(R"(,"y":)");
  out.rounded(pose.y);
  out.raw(R"(,"z":0},"orientation":{"x":0,"y":0,"z":)");
  out.rounded(std::sin(pose.theta / 2));
  out.raw(R"(,"w":)");
  out.rounded(std::cos(pose.theta / 2));
  out.raw("}}");
}

void append_size(std::string& out, double x, double y, double z) {
  out += R"("size":{"x":)";
  append_rounded(out, x, 6);
  out += R"(,"y":)";
  append_rounded(out, y, 6);
  out += R"(,"z":)";
  append_rounded(out, z, 6);
  out += '}';
}

void append_color(std::string& out, std::uint32_t rgba) {
  out += R"("color":{)";
  constexpr std::string_view kNames = "rgba";
  for (std::size_t i = 0; i < 4; ++i) {
    out += i == 0 ? "\"" : ",\"";
    out += kNames[i];
    out += "\":";
    append_rounded(out, static_cast<double>(rgba >> (24 - 8 * i) & 255) / 255.0, 3);
  }
  out += '}';
}

void append_thing(std::string& out, TimePoint time, const SceneThing& thing) {
  append_stamped(out, time);
  out += R"("id":)";
  append_json_string(out, thing.id);
  out += R"(,"lifetime":{"sec":0,"nsec":0},"frame_locked":false,"metadata":[],"arrows":[],"cubes":[)";
  const auto append_body = [&] {
    out += R"({"pose":)";
    append_pose_object(out, thing.pose_map, thing.height_m / 2);
    out += ',';
    append_size(out, thing.length_m, thing.disc ? thing.length_m : thing.width_m, thing.height_m);
    out += ',';
    if (thing.disc) out += R"("bottom_scale":1,"top_scale":1,)";
    append_color(out, thing.rgba);
    out += '}';
  };
  if (!thing.disc) append_body();
  out += R"(],"spheres":[],"cylinders":[)";
  if (thing.disc) append_body();
  out += R"(],"lines":[],"triangles":[],"texts":[)";
  if (!thing.text.empty()) {
    out += R"({"pose":)";
    append_pose_object(out, {thing.pose_map.x, thing.pose_map.y, 0.0}, thing.height_m + 0.2);
    out += R"(,"billboard":true,"font_size":0.25,"scale_invariant":false,)";
    append_color(out, 0x808080FF);
    out += R"(,"text":)";
    append_json_string(out, thing.text);
    out += '}';
  }
  out += R"(],"models":[]})";
}

}  // namespace

double as_recorded(double number) { return detail::rounded(number, 6); }
double range_as_recorded(double range) { return detail::rounded(range, 3); }

Pose as_recorded(const Pose& pose) {
  return {as_recorded(pose.x), as_recorded(pose.y),
          2 * std::atan2(as_recorded(std::sin(pose.theta / 2)), as_recorded(std::cos(pose.theta / 2)))};
}

void pack_pose(PackedJson& out, TimePoint time, const Pose& pose_map) {
  pack_stamped(out, time);
  out.raw(R"("pose":)");
  pack_pose_object(out, pose_map);
  out.raw("}");
}

void append_path(std::string& out, TimePoint time, std::span<const Pose> poses_map) {
  append_stamped(out, time);
  out += R"("poses":[)";
  for (std::size_t i = 0; i < poses_map.size(); ++i) {
    if (i > 0) out += ',';
    append_pose_object(out, poses_map[i]);
  }
  out += "]}";
}

void pack_scan(PackedJson& out, TimePoint time, const Pose& laser_map, double angle_min, double angle_increment,
               std::span<const double> ranges) {
  pack_stamped(out, time);
  out.raw(R"("pose":)");
  pack_pose_object(out, laser_map);
  out.raw(R"(,"start_angle":)");
  out.rounded(angle_min);
  out.raw(R"(,"end_angle":)");
  out.rounded(angle_min + angle_increment * static_cast<double>(ranges.empty() ? 0 : ranges.size() - 1));
  out.raw(R"(,"ranges":[)");
  out.rounded_list(ranges);
  out.raw(R"(],"intensities":[]})");
}

void append_grid(std::string& out, TimePoint time, const Grid& grid) {
  append_stamped(out, time);
  out += R"("pose":)";
  append_pose_object(out, grid.origin_map);
  out += R"(,"column_count":)";
  append_number(out, grid.columns);
  out += R"(,"cell_size":{"x":)";
  append_rounded(out, grid.cell_m, 6);
  out += R"(,"y":)";
  append_rounded(out, grid.cell_m, 6);
  out += R"(},"row_stride":)";
  append_number(out, grid.columns);
  out += R"(,"cell_stride":1,"fields":[{"name":"occupancy","offset":0,"type":2}],"data":")";
  append_base64(out, std::as_bytes(grid.cells));
  out += "\"}";
}

void append_log(std::string& out, TimePoint time, LogLevel level, std::string_view name, std::string_view text) {
  out += '{';
  append_time(out, "timestamp", time);
  out += R"(,"level":)";
  append_number(out, static_cast<int>(level));
  out += R"(,"message":)";
  append_json_string(out, text);
  out += R"(,"name":)";
  append_json_string(out, name);
  out += R"(,"file":"","line":0})";
}

void append_scene(std::string& out, TimePoint time, std::span<const SceneThing> things) {
  out += R"({"deletions":[{)";
  append_time(out, "timestamp", time);
  out += R"(,"type":1,"id":""}],"entities":[)";
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (i > 0) out += ',';
    append_thing(out, time, things[i]);
  }
  out += "]}";
}

}  // namespace sentree::record
