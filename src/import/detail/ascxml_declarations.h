#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/import/detail/ascxml_chart.h"

namespace sentree::import {

/// What a top-level element of a chart makes known by a name.
struct Declaration {
  enum class Group : std::uint8_t { kTopic, kService, kAction, kRate };

  Group group = Group::kTopic;
  bool serves = false;  ///< Publisher or server.
  std::string name;     ///< By which the chart's elements mean it.
  std::string ros_name;
  std::string type;
  std::string key;  ///< Port that gives the ROS name; empty: it is written.
  double rate_hz = 0;
  SourceSpan span;
};

/// Nothing: the element declares nothing.
/// @param ports  Values of those that name topics, services and actions.
[[nodiscard]] std::optional<Declaration> declaration_of(const text::XmlElement& element,
                                                        const std::map<std::string, std::string>& ports);
[[nodiscard]] std::vector<Declaration> declarations_of(const AscxmlChart& chart);
[[nodiscard]] const Declaration* find(const std::vector<Declaration>& declarations, Declaration::Group group,
                                      std::string_view name, std::optional<bool> serves = std::nullopt);

/// Names and expressions of an element's <field>s or <param>s.
using FieldValues = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] FieldValues fields_of(const text::XmlElement& element);
/// The attribute, or what its child of that name says: text, or the input that <bt_get_input> names.
[[nodiscard]] std::string value_of(const text::XmlElement& element, std::string_view name);
[[nodiscard]] std::string trimmed(std::string_view text);
/// Whether a character may stand in a name.
[[nodiscard]] bool is_word(char c);

/// An event that one chart sends and another one handles.
[[nodiscard]] bool is_cross(const RosWorld& world, const std::string& event);

}  // namespace sentree::import
