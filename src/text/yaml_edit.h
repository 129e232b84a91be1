#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::text {

/// The document with one entry more at the end of its top-level section `section`, in the indentation of the entries
/// that are there; all else stays as it is, comments too. A section that is missing, or empty, is made.
/// @param entry  One line: "- item" of a sequence, "key: value" of a mapping.
/// Errors: those of `parse_yaml` (`file` is for them); yaml.flow: the section is written in braces or brackets.
[[nodiscard]] Result<std::string> with_entry(std::string_view source, std::string_view section, std::string_view entry,
                                             const std::string& file = {});

/// Where a value stands in a document, from its root: keys of mappings, places in sequences from 0.
using YamlStep = std::variant<std::string, std::size_t>;
using YamlPath = std::vector<YamlStep>;
/// "timeline[1].args.percent".
[[nodiscard]] std::string to_string(const YamlPath& path);

/// A value on one line, in flow style; texts without quotes where YAML takes them for the same text everywhere.
[[nodiscard]] std::string yaml_flow(const Value& value);

/// The document in which `value` stands at `path`: over what is there, in the quotes that it has, else as a new entry
/// at the end of its mapping, which is made if it is missing. `path` has a key at least. All else stays byte for byte.
/// Errors, here and below: those of `parse_yaml`; yaml.no-such-place; yaml.not-editable (written so that it cannot be
/// changed alone: an alias, a text over several lines).
[[nodiscard]] Result<std::string> with_value(std::string_view source, const YamlPath& path, const Value& value,
                                             const std::string& file = {});
/// The document in which `value` stands in the sequence at `path`, before its item `index`, or at the end. A sequence
/// that is missing is made.
[[nodiscard]] Result<std::string> with_item(std::string_view source, const YamlPath& path, std::size_t index,
                                            const Value& value, const std::string& file = {});
/// The document without what stands at `path`. Mappings and sequences in block style that would be empty go with it.
[[nodiscard]] Result<std::string> without(std::string_view source, const YamlPath& path, const std::string& file = {});

}  // namespace sentree::text
