#pragma once

#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::groot {

/// Lists and maps inside each other that are written and read; what is deeper is nil, or refused.
inline constexpr int kPackNestingMax = 100;

/// The value as MessagePack (https://github.com/msgpack/msgpack/blob/master/spec.md): the smallest form of each number;
/// reals as float32 where that is exact.
[[nodiscard]] std::string message_pack(const Value& value);

/// The reverse. Integers beyond int64 become reals, keys that are no text their JSON. Extension types become octets.
/// Errors: groot.pack (cut off, a byte that begins nothing, too deep, something behind the value).
/// Cost: O(bytes); no more memory than the bytes are worth, whatever lengths they claim.
[[nodiscard]] Result<Value> parse_message_pack(std::string_view bytes);

}  // namespace sentree::groot
