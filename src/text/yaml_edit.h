#pragma once

#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::text {

/// The document with one entry more at the end of its top-level section `section`, in the indentation of the entries
/// that are there; all else stays as it is, comments too. A section that is missing, or empty, is made.
/// @param entry  One line: "- item" of a sequence, "key: value" of a mapping.
/// Errors: those of `parse_yaml` (`file` is for them); yaml.flow: the section is written in braces or brackets.
[[nodiscard]] Result<std::string> with_entry(std::string_view source, std::string_view section, std::string_view entry,
                                             const std::string& file = {});

}  // namespace sentree::text
