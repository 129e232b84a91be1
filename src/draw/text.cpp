#include "sentree/draw/detail/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

namespace sentree::draw {
namespace {

// Advance widths of the characters from ' ' to '~' in hundredths of the font size, of DejaVu Sans: the widest of
// the sans-serif fonts that browsers fall back to.
constexpr std::array<unsigned char, 95> kWidths = {
    32, 40, 46, 84, 64, 95, 78, 27, 39,  39, 50, 84, 32, 36, 32, 34, 64, 64, 64, 64, 64, 64, 64, 64,
    64, 64, 34, 34, 84, 84, 84, 53, 100, 68, 69, 70, 77, 63, 58, 77, 75, 29, 29, 66, 56, 86, 75, 79,
    60, 79, 69, 63, 61, 73, 68, 99, 69,  61, 69, 39, 34, 39, 84, 50, 50, 61, 63, 55, 63, 62, 35, 63,
    63, 28, 28, 58, 28, 97, 63, 61, 63,  63, 41, 52, 39, 63, 59, 82, 59, 59, 52, 64, 34, 64, 84};
constexpr double kOtherWidth = 0.7;  // Latin with accents, Greek, Cyrillic, arrows
constexpr double kWideWidth = 1.05;  // East Asian, emoji

constexpr char32_t kInvalid = 0xFFFD;

// The code point at the start of `text` and its length in bytes; invalid bytes count one by one.
struct CodePoint {
  char32_t value;
  std::size_t length;
  bool valid;
};

CodePoint decode(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return {first, 1, true};
  std::size_t length = 0;
  char32_t value = 0;
  char32_t least = 0;
  if ((first & 0xE0) == 0xC0) {
    length = 2;
    value = first & 0x1F;
    least = 0x80;
  } else if ((first & 0xF0) == 0xE0) {
    length = 3;
    value = first & 0x0F;
    least = 0x800;
  } else if ((first & 0xF8) == 0xF0) {
    length = 4;
    value = first & 0x07;
    least = 0x10000;
  }
  if (length == 0 || text.size() < length) return {kInvalid, 1, false};
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {kInvalid, 1, false};
    value = (value << 6) | (byte(i) & 0x3F);
  }
  if (value < least || value > 0x10FFFF || (value >= 0xD800 && value < 0xE000)) return {kInvalid, 1, false};
  return {value, length, true};
}

double width_of(char32_t c) {
  if (c >= 32 && c < 127) return kWidths[c - 32] / 100.0;
  if (c < 32 || (c >= 0x300 && c < 0x370) || c == 0x200B || c == 0x200D) return 0;
  if (c >= 0x1100 && (c < 0x1200 || (c >= 0x2E80 && c < 0xFB00) || (c >= 0xFF00 && c < 0xFF61) || c >= 0x1F000))
    return kWideWidth;
  return c == 0x2026 ? 1.0 : kOtherWidth;
}

bool breaks_after(char c) { return std::string_view(",;)/|&:.-=").find(c) != std::string_view::npos; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

// Where to end a line that has room for `end` bytes of `text`: at the last blank or after punctuation, else between the
// words of a compoundName, else right there. Never leaves a line less than a quarter full.
std::size_t break_before(std::string_view text, std::size_t end) {
  for (std::size_t i = end; i > end / 4; --i) {
    if (text[i] == ' ' || (breaks_after(text[i - 1]) && !breaks_after(text[i]))) return i;
  }
  for (std::size_t i = end; i > end / 4; --i) {
    if (is_lower(text[i - 1]) && is_upper(text[i])) return i;
  }
  return end;
}

// The longest prefix of `text` that fits, in bytes, at least one character.
std::size_t fitting_prefix(std::string_view text, double width_em) {
  double width = 0;
  std::size_t end = 0;
  while (end < text.size()) {
    const CodePoint c = decode(text.substr(end));
    width += width_of(c.value);
    if (width > width_em + 1e-9 && end > 0) break;
    end += c.length;
  }
  return end;
}

}  // namespace

double text_width(std::string_view text, double size_px) {
  double width = 0;
  for (std::size_t i = 0; i < text.size();) {
    const CodePoint c = decode(text.substr(i));
    width += width_of(c.value);
    i += c.length;
  }
  return width * size_px;
}

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const CodePoint c = decode(text.substr(i));
    if (!c.valid || c.value == 0xFFFE || c.value == 0xFFFF) {
      out += "\xEF\xBF\xBD";
    } else if (c.value < 32 || (c.value >= 0x7F && c.value < 0xA0)) {
      out += ' ';
    } else {
      out += text.substr(i, c.length);
    }
    i += c.length;
  }
  return out;
}

std::vector<std::string> wrap(std::string_view text, double size_px, double width_max, int lines_max) {
  const std::string clean = printable(text);
  std::string_view rest = clean;
  const auto trim_front = [&] { rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size())); };
  const double width_em = width_max / size_px;
  std::vector<std::string> lines;
  for (trim_front(); !rest.empty(); trim_front()) {
    if (static_cast<int>(lines.size()) == lines_max) {
      if (lines.empty()) break;
      std::string& last = lines.back();
      last.resize(fitting_prefix(last, std::max(width_em - width_of(0x2026), 0.0)));
      last += "…";
      break;
    }
    std::size_t end = fitting_prefix(rest, width_em);
    if (end < rest.size()) end = break_before(rest, end);
    std::string_view line = rest.substr(0, end);
    while (!line.empty() && line.back() == ' ') line.remove_suffix(1);
    lines.emplace_back(line);
    rest.remove_prefix(end);
  }
  return lines;
}

std::string xml_escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : printable(text)) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string coordinate(double value) {
  const double rounded = std::round(value * 100) / 100;
  std::array<char, 64> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), rounded == 0 ? 0.0 : rounded,
                                 std::chars_format::fixed, 2)
                       .ptr;
  std::string text(buffer.data(), end);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace sentree::draw
