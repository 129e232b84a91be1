#pragma once

#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::text {

/// Nesting of lists and maps that any reader of ours accepts.
inline constexpr int kNestingMax = 100;

/// Reads JSON (RFC 8259). Integers within int64 become `int`, other numbers `double`; a later duplicate key wins.
/// Errors: json.syntax with line and column, json.too-deep.
[[nodiscard]] Result<Value> parse_json(std::string_view source, const std::string& file = {});

}  // namespace sentree::text
