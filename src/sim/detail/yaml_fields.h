#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/time.h"
#include "sentree/sim/geometry.h"
#include "sentree/text/yaml.h"

namespace sentree::sim {

/// What a number in a world file may be followed by, and what that multiplies it by.
struct Unit {
  std::string_view name;
  double factor;
};

/// Takes the entries of a YAML mapping one by one; what is wrong goes to the diagnostics and leaves the default.
///
/// `finish` reports the entries that nobody asked for, with a suggestion. A node that is no mapping is reported once.
class YamlFields {
 public:
  /// `codes` is the prefix of the codes ("sim", "map"), `what` names the mapping in messages ("robot", "laser").
  YamlFields(const text::YamlNode& node, std::string codes, std::string what, Diagnostics& found);

  struct Range {
    double low;
    double high;
    bool low_excluded = false;
  };
  void number(std::string_view key, double& out, Range range, std::span<const Unit> units = {});
  void integer(std::string_view key, int& out, int low, int high);
  void boolean(std::string_view key, bool& out);
  void text(std::string_view key, std::string& out);
  /// "20 ms", "5 s", "2 min", or a number of seconds.
  void duration(std::string_view key, Duration& out, Range seconds_range);
  /// "[x, y]" or "[x, y, heading]": metres, and radians or "90 deg".
  void pose(std::string_view key, Pose2& out);
  void point(std::string_view key, Vec2& out);
  /// One of `names`; gives its position.
  [[nodiscard]] std::optional<std::size_t> choice(std::string_view key, std::span<const std::string> names);
  /// The node itself, for what has a form of its own; null if absent.
  [[nodiscard]] const text::YamlNode* node(std::string_view key);
  /// As `node`, and an error if it is absent.
  [[nodiscard]] const text::YamlNode* required(std::string_view key);
  void finish();

  [[nodiscard]] const SourceSpan& span() const { return node_.span; }
  void error(std::string_view code, std::string message, const SourceSpan& span);

 private:
  [[nodiscard]] std::optional<double> quantity(const text::YamlNode& value, std::span<const Unit> units) const;

  const text::YamlNode& node_;
  std::string codes_;
  std::string what_;
  Diagnostics& found_;
  std::vector<std::string> asked_;
};

/// Units of the quantities in world files.
[[nodiscard]] std::span<const Unit> time_units();
[[nodiscard]] std::span<const Unit> angle_units();
[[nodiscard]] std::span<const Unit> ratio_units();
[[nodiscard]] std::span<const Unit> ratio_by_time_units();
[[nodiscard]] std::span<const Unit> ratio_by_length_units();

/// A pose written as a list; nothing if it is none.
[[nodiscard]] std::optional<Pose2> read_pose(const text::YamlNode& node);
/// The reason, and how one is written.
[[nodiscard]] std::string why_no_pose(const text::YamlNode& node);

}  // namespace sentree::sim
