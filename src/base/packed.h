#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree {

/// Lists and maps inside each other that packed octets may hold.
inline constexpr int kPackedDepthMax = 200;
/// Memory that one packed value may take when it is unpacked [octets].
inline constexpr std::size_t kUnpackedMax = std::size_t{256} << 20U;

/// A value as few octets: each text once, small integers in one octet, doubles with all their bits. The same value
/// gives the same octets.
[[nodiscard]] std::string pack(const Value& value);

/// What was packed, equal to the last bit. Error: value.bad-octets, of octets that are damaged or beyond a bound.
[[nodiscard]] Result<Value> unpack(std::string_view octets);

}  // namespace sentree
