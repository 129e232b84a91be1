#pragma once

#include <array>
#include <string>
#include <string_view>

namespace sentree::cli {

// Escape sequences of terminals (ECMA-48, 8.3.117).
inline constexpr auto kReset = "\x1b[0m";
inline constexpr auto kBold = "\x1b[1m";
inline constexpr auto kDim = "\x1b[2m";
inline constexpr auto kRed = "\x1b[31m";
inline constexpr auto kGreen = "\x1b[32m";
inline constexpr auto kYellow = "\x1b[33m";
inline constexpr auto kBlue = "\x1b[36m";
inline constexpr auto kBrown = "\x1b[33;2m";
inline constexpr auto kBanner = "\x1b[97;41;1m";

/// All of them.
inline constexpr std::array<std::string_view, 9> kColours = {kReset,  kBold, kDim,   kRed,   kGreen,
                                                             kYellow, kBlue, kBrown, kBanner};

inline std::string coloured(const char* colour, const std::string& text) { return colour + text + kReset; }

}  // namespace sentree::cli
