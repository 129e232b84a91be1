#include "sentree/base/shown.h"

#include <cstdio>

namespace sentree {

namespace {

constexpr std::size_t kShownMax = 4'000;
constexpr std::string_view kLeftOut = " … ";

bool continues(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

}  // namespace

std::string shown(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F, of which U+009B begins what escapes begin: C2 80 to C2 9F in UTF-8.
    const bool is_c1 =
        c == 0xC2U && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0U && continues(text[i + 1]);
    if ((c < 0x20U && c != '\n' && c != '\t') || c == 0x7FU || is_c1) {
      char code[5];
      std::snprintf(code, sizeof code, "\\x%02x", is_c1 ? static_cast<unsigned char>(text[++i]) : c);
      out += code;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::string shown_in_short(std::string_view text) {
  if (text.size() <= kShownMax) return shown(text);
  // Whole characters on both sides.
  std::size_t first = kShownMax / 2;
  std::size_t second = text.size() - kShownMax / 2;
  while (first > 0 && continues(text[first])) --first;
  while (second < text.size() && continues(text[second])) ++second;
  return shown(text.substr(0, first)) + std::string(kLeftOut) + shown(text.substr(second));
}

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, ",");
  return text;
}

}  // namespace sentree
