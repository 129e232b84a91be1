#include "sentree/text/encoding.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace sentree::text {

namespace {

using namespace std::string_view_literals;

// The characters of Windows-1252 from 0x80 on that are others than in ISO-8859-1.
constexpr std::array<std::uint32_t, 32> kWindows1252 = {0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                                        0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0x8D,   0x017D, 0x8F,
                                                        0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                                        0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};

void append(std::string& out, std::uint32_t character) {
  const auto byte = [&](std::uint32_t bits) { out += static_cast<char>(bits); };
  if (character < 0x80) return byte(character);
  if (character < 0x800) {
    byte(0xC0 | (character >> 6));
  } else {
    if (character < 0x10000) {
      byte(0xE0 | (character >> 12));
    } else {
      byte(0xF0 | (character >> 18));
      byte(0x80 | ((character >> 12) & 0x3F));
    }
    byte(0x80 | ((character >> 6) & 0x3F));
  }
  byte(0x80 | (character & 0x3F));
}

// Half a pair comes out as what is no UTF-8, which the reader of XML refuses with its place.
std::string from_utf16(std::string_view source, bool is_big) {
  std::string out;
  out.reserve(source.size() / 2);
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(source[i]), second = static_cast<unsigned char>(source[i + 1]);
    return static_cast<std::uint32_t>(is_big ? first << 8 | second : second << 8 | first);
  };
  for (std::size_t i = 0; i + 1 < source.size(); i += 2) {
    std::uint32_t character = unit(i);
    const bool is_high = character >= 0xD800 && character < 0xDC00;
    if (is_high && i + 3 < source.size() && unit(i + 2) >= 0xDC00 && unit(i + 2) < 0xE000) {
      character = 0x10000 + ((character - 0xD800) << 10) + (unit(i + 2) - 0xDC00);
      i += 2;
    }
    append(out, character);
  }
  return out;
}

std::string from_single_bytes(std::string_view source, bool is_windows) {
  std::string out;
  out.reserve(source.size());
  for (const char c : source) {
    const auto byte = static_cast<unsigned char>(c);
    append(out, is_windows && byte >= 0x80 && byte < 0xA0 ? kWindows1252[byte - 0x80] : byte);
  }
  return out;
}

// The value of `encoding` in the XML declaration, if there is one.
std::optional<std::string_view> declared(std::string_view source) {
  const std::size_t begin = source.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos || !source.substr(begin).starts_with("<?xml")) return std::nullopt;
  const std::string_view declaration = source.substr(begin, source.substr(begin).find("?>"));
  const std::size_t name = declaration.find("encoding");
  if (name == std::string_view::npos) return std::nullopt;
  const std::size_t quote = declaration.find_first_of("\"'", name);
  if (quote == std::string_view::npos) return std::nullopt;
  const std::size_t end = declaration.find(declaration[quote], quote + 1);
  if (end == std::string_view::npos) return std::nullopt;
  return declaration.substr(quote + 1, end - quote - 1);
}

std::string declared_as_utf8(std::string source) {
  if (const auto name = declared(source))
    source.replace(static_cast<std::size_t>(name->data() - source.data()), name->size(), "UTF-8");
  return source;
}

}  // namespace

std::optional<std::string> xml_as_utf8(std::string_view source) {
  // UTF-32 begins with the same octets, and two more zeros.
  if (source.starts_with("\xFF\xFE\0\0"sv)) return std::nullopt;
  if (source.starts_with("\xFF\xFE")) return declared_as_utf8(from_utf16(source.substr(2), false));
  if (source.starts_with("\xFE\xFF")) return declared_as_utf8(from_utf16(source.substr(2), true));
  if (source.starts_with("<\0?\0"sv)) return declared_as_utf8(from_utf16(source, false));
  if (source.starts_with("\0<\0?"sv)) return declared_as_utf8(from_utf16(source, true));
  const auto name = declared(source.substr(0, 1024));
  if (!name) return std::nullopt;
  std::string lower(*name);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  if (lower == "utf-16") return declared_as_utf8(std::string(source));
  const bool is_windows = lower == "windows-1252" || lower == "cp1252";
  if (is_windows || lower == "iso-8859-1" || lower == "latin1" || lower == "latin-1")
    return declared_as_utf8(from_single_bytes(source, is_windows));
  return std::nullopt;
}

}  // namespace sentree::text
