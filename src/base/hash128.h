#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace sentree {

/// 128 bits that stand for octets: of n different ones, the chance that any two have the same is below n²/2¹²⁹.
struct Hash128 {
  std::uint64_t a = 0;
  std::uint64_t b = 0;
  friend bool operator==(const Hash128&, const Hash128&) = default;
};
struct Hash128Hash {
  std::size_t operator()(const Hash128& hash) const { return static_cast<std::size_t>(hash.a); }
};

namespace detail {
// Two multiplications a word, finished as SplitMix64 does.
inline std::uint64_t hash_with(std::string_view bytes, std::uint64_t seed) {
  std::uint64_t h = seed ^ (bytes.size() * 0x9E3779B97F4A7C15ULL);
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (h ^ word) * 0xBF58476D1CE4E5B9ULL;
    h ^= h >> 29U;
  }
  std::uint64_t rest = 0;
  if (i < bytes.size()) std::memcpy(&rest, bytes.data() + i, bytes.size() - i);
  h = (h ^ rest) * 0x94D049BB133111EBULL;
  h ^= h >> 32U;
  h *= 0xBF58476D1CE4E5B9ULL;
  return h ^ (h >> 31U);
}
}  // namespace detail

/// Cost: a nanosecond or two for each eight octets. Within one process only: not for files.
[[nodiscard]] inline Hash128 hash128(std::string_view bytes) {
  return {detail::hash_with(bytes, 0x243F6A8885A308D3ULL), detail::hash_with(bytes, 0x13198A2E03707344ULL)};
}

}  // namespace sentree
