#pragma once

#include <cstddef>
#include <string_view>

/// Sizes [px] that the layout and the SVG writer of trees must agree on.
namespace sentree::draw {

inline constexpr double kTitleSize = 13;
inline constexpr double kTitleHeight = 17;
inline constexpr double kBoldFactor = 1.1;  ///< Bold text against the regular text that text_width() measures.
inline constexpr double kLineSize = 11;
inline constexpr double kLineHeight = 14.5;
inline constexpr double kSymbolSize = 20;
inline constexpr double kSymbolHeight = 24;
inline constexpr double kPaddingX = 11;
inline constexpr double kPaddingY = 7;
inline constexpr double kDoubleSide = 5;  ///< Between the two lines of a subtree's side.
inline constexpr double kPoint = 12;      ///< How far a decorator's left and right corners stick out.
inline constexpr double kNodeWidthMin = 44;
inline constexpr double kNodeHeightMin = 32;
inline constexpr double kTitleBlock = 30;  ///< The drawing's title with the space below it.

/// A sign ("→", "R?") is drawn large, a word ("Inverter") like a name.
[[nodiscard]] inline bool is_sign(std::string_view symbol) {
  std::size_t characters = 0;
  for (const char c : symbol) characters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1U : 0U;
  return characters <= 3;
}
[[nodiscard]] inline double symbol_height(std::string_view symbol) {
  return symbol.empty() ? 0 : is_sign(symbol) ? kSymbolHeight : kTitleHeight;
}

}  // namespace sentree::draw
