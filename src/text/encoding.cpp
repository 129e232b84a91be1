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

std::string lowered(std::string_view name) {
  std::string lower(name);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  return lower;
}

enum class Form { kUtf8, kLittle, kBig, kWindows, kLatin, kNamedWrongly };
struct Encoding {
  Form form = Form::kUtf8;
  std::size_t mark = 0;  // bytes before the text
};

constexpr std::size_t kBegin = 1024;

Encoding encoding_of(std::string_view source) {
  // UTF-32 begins with the same octets, and two more zeros.
  if (source.starts_with("\xFF\xFE\0\0"sv)) return {};
  if (source.starts_with("\xFF\xFE")) return {Form::kLittle, 2};
  if (source.starts_with("\xFE\xFF")) return {Form::kBig, 2};
  if (source.starts_with("<\0?\0"sv)) return {Form::kLittle};
  if (source.starts_with("\0<\0?"sv)) return {Form::kBig};
  const auto name = declared(source.substr(0, kBegin));
  if (!name) return {};
  const std::string lower = lowered(*name);
  if (lower == "utf-16") return {Form::kNamedWrongly};
  if (lower == "windows-1252" || lower == "cp1252") return {Form::kWindows};
  if (lower == "iso-8859-1" || lower == "latin1" || lower == "latin-1") return {Form::kLatin};
  return {};
}

std::string decoded(std::string_view source, const Encoding& encoding) {
  source.remove_prefix(encoding.mark);
  switch (encoding.form) {
    case Form::kLittle:
    case Form::kBig: return from_utf16(source, encoding.form == Form::kBig);
    case Form::kWindows:
    case Form::kLatin: return from_single_bytes(source, encoding.form == Form::kWindows);
    case Form::kUtf8:
    case Form::kNamedWrongly: break;
  }
  return std::string(source);
}

// Of valid UTF-8.
std::uint32_t next_character(std::string_view text, std::size_t& at) {
  const auto first = static_cast<unsigned char>(text[at++]);
  if (first < 0x80) return first;
  const int more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
  std::uint32_t character = first & (0x3FU >> static_cast<unsigned>(more));
  for (int i = 0; i < more && at < text.size(); ++i)
    character = character << 6U | (static_cast<unsigned char>(text[at++]) & 0x3FU);
  return character;
}

void append_unit(std::string& out, std::uint32_t unit, bool is_big) {
  const char high = static_cast<char>(unit >> 8U);
  const char low = static_cast<char>(unit & 0xFFU);
  out += is_big ? high : low;
  out += is_big ? low : high;
}

bool append_as(std::string& out, std::uint32_t character, Form form) {
  if (form == Form::kLittle || form == Form::kBig) {
    if (character < 0x10000) {
      append_unit(out, character, form == Form::kBig);
    } else {
      append_unit(out, 0xD800 + ((character - 0x10000) >> 10U), form == Form::kBig);
      append_unit(out, 0xDC00 + ((character - 0x10000) & 0x3FFU), form == Form::kBig);
    }
    return true;
  }
  if (form == Form::kWindows) {
    const auto* const found = std::find(kWindows1252.begin(), kWindows1252.end(), character);
    if (found != kWindows1252.end()) character = 0x80 + static_cast<std::uint32_t>(found - kWindows1252.begin());
  }
  if (character > 0xFF) return false;
  out += static_cast<char>(character);
  return true;
}

}  // namespace

std::string with_line_ends_of(std::string_view source, std::string text) {
  const std::size_t first = source.find('\n');
  if (first == std::string_view::npos || first == 0 || source[first - 1] != '\r') return text;
  std::string out;
  out.reserve(text.size() + text.size() / 16);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n' && (i == 0 || text[i - 1] != '\r')) out += '\r';
    out += text[i];
  }
  return out;
}

std::optional<std::string> xml_as_utf8(std::string_view source) {
  const Encoding encoding = encoding_of(source);
  if (encoding.form == Form::kUtf8) return std::nullopt;
  return declared_as_utf8(decoded(source, encoding));
}

std::optional<std::string> xml_encoded_as(std::string_view begin, std::string_view text) {
  const Encoding encoding = encoding_of(begin);
  if (encoding.form == Form::kUtf8) return std::nullopt;
  const std::string before = decoded(begin.substr(0, kBegin), encoding);
  std::string named(text);
  if (const auto name = declared(text)) {
    const auto as = declared(before);
    if (!as || *name != "UTF-8") return std::nullopt;
    named.replace(static_cast<std::size_t>(name->data() - text.data()), name->size(), *as);
  }
  std::string out(begin.substr(0, encoding.mark));
  if (encoding.form == Form::kNamedWrongly) {
    out += named;
  } else {
    for (std::size_t at = 0; at < named.size();) {
      if (!append_as(out, next_character(named, at), encoding.form)) return std::nullopt;
    }
  }
  if (xml_as_utf8(out) != text) return std::nullopt;
  return out;
}

std::optional<std::string_view> xml_declared_otherwise(std::string_view text) {
  const auto name = declared(text.substr(0, kBegin));
  return name && lowered(*name) != "utf-8" && lowered(*name) != "utf8" ? name : std::nullopt;
}

std::optional<std::string> xml_as_declared(std::string_view text) {
  return xml_encoded_as(text.substr(0, kBegin), declared_as_utf8(std::string(text)));
}

}  // namespace sentree::text
