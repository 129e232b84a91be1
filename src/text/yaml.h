#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::text {

/// A node of a YAML document with its place in the file. A plain value; aliases are expanded.
struct YamlNode {
  enum class Kind { kNull, kScalar, kSequence, kMapping };

  // Out of line: an entry is a pair of nodes, complete only after the node is.
  YamlNode();
  YamlNode(const YamlNode&);
  YamlNode(YamlNode&&) noexcept;
  YamlNode& operator=(const YamlNode&);
  YamlNode& operator=(YamlNode&&) noexcept;
  ~YamlNode();

  Kind kind = Kind::kNull;
  SourceSpan span;
  std::string scalar;                                  ///< kScalar: the text, unquoted.
  bool quoted = false;                                 ///< kScalar: written in quotes, so it is a string.
  std::vector<YamlNode> items;                         ///< kSequence.
  std::vector<std::pair<YamlNode, YamlNode>> entries;  ///< kMapping, in the order of the file; keys are scalars.

  [[nodiscard]] bool is_null() const { return kind == Kind::kNull; }
  [[nodiscard]] bool is_scalar() const { return kind == Kind::kScalar; }
  [[nodiscard]] bool is_sequence() const { return kind == Kind::kSequence; }
  [[nodiscard]] bool is_mapping() const { return kind == Kind::kMapping; }
  /// The entry of a mapping, or null.
  [[nodiscard]] const YamlNode* find(std::string_view key) const;

  /// A scalar as number, whole number or truth value (true/false only); nothing if it is none.
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] std::optional<std::int64_t> integer() const;
  [[nodiscard]] std::optional<bool> boolean() const;
  /// Core schema: null, bool, int, double, string, list, map.
  [[nodiscard]] Value value() const;
};

/// Reads one YAML 1.2 document; an empty file gives a null node.
/// Errors: yaml.syntax, yaml.duplicate-key, yaml.too-deep, yaml.too-large (expanded aliases included).
[[nodiscard]] Result<YamlNode> parse_yaml(std::string_view source, const std::string& file = {});

}  // namespace sentree::text
