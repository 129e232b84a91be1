#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"

namespace sentree {

/// `to_json(value)` at the end of `out`; allocates only to grow it.
void append_json(std::string& out, const Value& value);

/// Base64 with padding (RFC 4648).
void append_base64(std::string& out, std::span<const std::byte> octets);
/// The octets of such a text; nothing if it is not one.
[[nodiscard]] std::optional<std::vector<std::byte>> decode_base64(std::string_view text);

/// The value that JSON text stood for: {"$bytes": base64} are octets again. (Non-finite doubles stay the strings that
/// `to_json` makes of them, since nothing tells them from text.)
[[nodiscard]] Value with_bytes(Value read);

}  // namespace sentree
