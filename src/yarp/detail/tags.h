#pragma once

#include <cstdint>

/// What items of a bottle are. Private to the library.
namespace sentree::yarp {

inline constexpr std::uint32_t kInt32 = 1;
inline constexpr std::uint32_t kString = 4;
inline constexpr std::uint32_t kVocab32 = 9;
inline constexpr std::uint32_t kReal10 = 10;  // float64 of YARP 3, float32 of YARP 4
inline constexpr std::uint32_t kBlob = 12;
inline constexpr std::uint32_t kInt64 = 17;
inline constexpr std::uint32_t kVocab64 = 18;  // of YARP 4
inline constexpr std::uint32_t kReal20 = 20;   // float64 of YARP 4
inline constexpr std::uint32_t kInt8 = 32;
inline constexpr std::uint32_t kInt16 = 64;
inline constexpr std::uint32_t kReal128 = 128;  // float32 of YARP 3
inline constexpr std::uint32_t kList = 256;
inline constexpr std::uint32_t kDictionary = 512;

/// The number of a vocab of up to four letters.
constexpr std::int32_t vocab(const char* text) {
  std::uint32_t out = 0;
  for (int i = 0; i < 4 && text[i] != '\0'; ++i)
    out |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])) << (8 * i);
  return static_cast<std::int32_t>(out);
}

}  // namespace sentree::yarp
