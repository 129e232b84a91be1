#include "sentree/sim/detail/yaml_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/value.h"

namespace sentree::sim {

namespace {

// Coordinates beyond this are a slip of the pen.
constexpr double kCoordinateMax_m = 1e6;
constexpr double kAngleMax_rad = 1e3;

std::string shown(const text::YamlNode& node) {
  switch (node.kind) {
    case text::YamlNode::Kind::kNull: return "nothing";
    case text::YamlNode::Kind::kScalar: return fmt::format("\"{}\"", node.scalar);
    case text::YamlNode::Kind::kSequence: return "a list";
    case text::YamlNode::Kind::kMapping: return "a mapping";
  }
  return {};
}

std::optional<double> number_with_unit(const text::YamlNode& node, std::span<const Unit> units) {
  if (!node.is_scalar()) return std::nullopt;
  if (const auto plain = node.number()) return *plain;
  const std::size_t split = node.scalar.find_first_not_of("0123456789+-.eE");
  if (split == std::string::npos || split == 0) return std::nullopt;
  text::YamlNode head = node;
  head.quoted = false;
  head.scalar = node.scalar.substr(0, split);
  const auto value = head.number();
  const std::size_t unit_start = node.scalar.find_first_not_of(' ', split);
  if (!value || unit_start == std::string::npos) return std::nullopt;
  const std::string_view unit = std::string_view(node.scalar).substr(unit_start);
  for (const Unit& candidate : units) {
    if (candidate.name == unit) return *value * candidate.factor;
  }
  return std::nullopt;
}

std::string unit_names(std::span<const Unit> units) {
  std::string names;
  for (const Unit& unit : units) names += (names.empty() ? ", unit " : ", ") + std::string(unit.name);
  return names;
}

// "; write 100 %" for a number that is too large, as one is whose unit was forgotten.
std::string with_unit(const text::YamlNode& node, double high, std::span<const Unit> units) {
  const auto bare = node.number();
  if (!bare || !(*bare > high)) return {};
  for (const Unit& unit : units) {
    if (unit.factor != 1.0 && *bare * unit.factor <= high) return fmt::format("; write {} {}", node.scalar, unit.name);
  }
  return {};
}

}  // namespace

std::span<const Unit> time_units() {
  static constexpr std::array<Unit, 4> kUnits{Unit{"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}, {"h", 3600.0}};
  return kUnits;
}

std::span<const Unit> angle_units() {
  static constexpr std::array<Unit, 2> kUnits{Unit{"rad", 1.0}, {"deg", std::numbers::pi / 180.0}};
  return kUnits;
}

std::span<const Unit> ratio_units() {
  static constexpr std::array<Unit, 1> kUnits{Unit{"%", 0.01}};
  return kUnits;
}

std::span<const Unit> ratio_by_time_units() {
  static constexpr std::array<Unit, 2> kUnits{Unit{"%/s", 0.01}, {"%/min", 0.01 / 60.0}};
  return kUnits;
}

std::span<const Unit> ratio_by_length_units() {
  static constexpr std::array<Unit, 1> kUnits{Unit{"%/m", 0.01}};
  return kUnits;
}

std::string why_no_pose(const text::YamlNode& node) {
  constexpr std::string_view kForm = "write [x, y, heading] in m and rad, or \"90 deg\"";
  if (!node.is_sequence() || node.items.size() < 2 || node.items.size() > 3)
    return fmt::format("{} is no pose; {}", shown(node), kForm);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto number = number_with_unit(node.items[i], {});
    if (!number) return fmt::format("{} is no coordinate in m", shown(node.items[i]));
    if (!(std::abs(*number) <= kCoordinateMax_m)) return shown(node.items[i]) + " is too far away for a coordinate";
  }
  const text::YamlNode& heading = node.items.back();
  // The number alone, where what stands behind it is another unit, or none.
  const std::string number = heading.is_scalar() ? heading.scalar.substr(0, heading.scalar.find(' ')) : "";
  text::YamlNode bare = heading;
  bare.scalar = number;
  if (!bare.is_scalar() || !bare.number()) return fmt::format("{} is no heading; {}", shown(heading), kForm);
  const auto written = number_with_unit(heading, angle_units());
  return written && std::abs(*written) <= kAngleMax_rad
             ? fmt::format("{} is no heading in rad; write {} deg", number, number)
             : fmt::format("{} is no heading; write {} deg", shown(heading), number);
}

std::optional<Pose2> read_pose(const text::YamlNode& node) {
  if (!node.is_sequence() || node.items.size() < 2 || node.items.size() > 3) return std::nullopt;
  const auto x = number_with_unit(node.items[0], {});
  const auto y = number_with_unit(node.items[1], {});
  const auto theta = node.items.size() == 3 ? number_with_unit(node.items[2], angle_units()) : 0.0;
  if (!x || !y || !theta) return std::nullopt;
  // Negated, so that NaN is refused too.
  if (!(std::abs(*x) <= kCoordinateMax_m && std::abs(*y) <= kCoordinateMax_m && std::abs(*theta) <= kAngleMax_rad)) {
    return std::nullopt;
  }
  // So many radians are degrees whose unit was forgotten.
  const bool is_bare = node.items.size() == 3 && node.items[2].number();
  if (is_bare && std::abs(*theta) > 2 * std::numbers::pi) return std::nullopt;
  return Pose2{*x, *y, wrap_angle(*theta)};
}

YamlFields::YamlFields(const text::YamlNode& node, std::string codes, std::string what, Diagnostics& found)
    : node_(node), codes_(std::move(codes)), what_(std::move(what)), found_(found) {
  if (!node.is_mapping() && !node.is_null()) {
    error("bad-value", fmt::format("{} is {}; a mapping is expected", what_, shown(node)), node.span);
  }
}

void YamlFields::error(std::string_view code, std::string message, const SourceSpan& span) {
  found_.push_back({Severity::kError, fmt::format("{}.{}", codes_, code), std::move(message), span});
}

const text::YamlNode* YamlFields::node(std::string_view key) {
  asked_.emplace_back(key);
  return node_.is_mapping() ? node_.find(key) : nullptr;
}

const text::YamlNode* YamlFields::required(std::string_view key) {
  const text::YamlNode* value = node(key);
  if (value == nullptr && (node_.is_mapping() || node_.is_null())) {
    error("missing-key", fmt::format("{} needs \"{}\"", what_, key), node_.span);
  }
  return value;
}

void YamlFields::number(std::string_view key, double& out, Range range, std::span<const Unit> units) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  const auto number = number_with_unit(*value, units);
  if (!number || std::isnan(*number)) {
    error("bad-value",
          fmt::format("{} of {} is {}; a number is expected{}", key, what_, shown(*value), unit_names(units)),
          value->span);
    return;
  }
  if (*number < range.low || *number > range.high || (range.low_excluded && *number == range.low)) {
    const std::string low = (range.low_excluded ? "above " : "at least ") + shortest_decimal(range.low);
    const std::string high = std::isfinite(range.high) ? " and at most " + shortest_decimal(range.high) : std::string();
    error("bad-value",
          fmt::format("{} of {} is {}; it must be {}{}{}", key, what_, shortest_decimal(*number), low, high,
                      with_unit(*value, range.high, units)),
          value->span);
    return;
  }
  out = *number;
}

void YamlFields::integer(std::string_view key, int& out, int low, int high) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  const auto number = value->is_scalar() ? value->integer() : std::nullopt;
  if (!number || *number < low || *number > high) {
    error("bad-value",
          fmt::format("{} of {} is {}; a whole number from {} to {} is expected", key, what_, shown(*value), low, high),
          value->span);
    return;
  }
  out = static_cast<int>(*number);
}

void YamlFields::boolean(std::string_view key, bool& out) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  const auto truth = value->is_scalar() ? value->boolean() : std::nullopt;
  if (truth)
    out = *truth;
  else
    error("bad-value", fmt::format("{} of {} is {}; true or false is expected", key, what_, shown(*value)),
          value->span);
}

void YamlFields::text(std::string_view key, std::string& out) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  if (value->is_scalar() && !value->scalar.empty())
    out = value->scalar;
  else
    error("bad-value", fmt::format("{} of {} is {}; a text is expected", key, what_, shown(*value)), value->span);
}

void YamlFields::duration(std::string_view key, Duration& out, Range seconds_range) {
  double s = seconds(out);
  number(key, s, seconds_range, time_units());
  out = from_seconds(s);
}

void YamlFields::pose(std::string_view key, Pose2& out) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  if (const auto pose = read_pose(*value))
    out = *pose;
  else
    error("bad-value", fmt::format("{} of {}: {}", key, what_, why_no_pose(*value)), value->span);
}

void YamlFields::point(std::string_view key, Vec2& out) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return;
  const auto pose = read_pose(*value);
  if (pose && value->items.size() == 2)
    out = pose->position();
  else
    error("bad-value", fmt::format("{} of {} is no point; write [x, y] in m", key, what_), value->span);
}

std::optional<std::size_t> YamlFields::choice(std::string_view key, std::span<const std::string> names) {
  const text::YamlNode* value = node(key);
  if (value == nullptr) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), value->is_scalar() ? value->scalar : std::string());
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  error("bad-value",
        fmt::format("{} of {} is {}; one of {} is expected{}", key, what_, shown(*value), all,
                    did_you_mean(value->scalar, names)),
        value->span);
  return std::nullopt;
}

void YamlFields::finish() {
  for (const auto& [key, value] : node_.entries) {
    if (std::find(asked_.begin(), asked_.end(), key.scalar) != asked_.end()) continue;
    error("unknown-key", fmt::format("{} has no \"{}\"{}", what_, key.scalar, did_you_mean(key.scalar, asked_)),
          key.span);
  }
}

}  // namespace sentree::sim
