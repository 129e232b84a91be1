#include "sentree/idl/detail/lexer.h"
#include "sentree/base/ascii.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace sentree::idl::syntax {
namespace {

bool is_hex_digit(char c) { return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); }
bool is_word_start(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word_part(char c) { return is_word_start(c) || is_digit(c); }

std::string shown_character(char c) {
  if (c >= 0x20 && c < 0x7f) return fmt::format("\"{}\"", c);
  const char* digits = "0123456789abcdef";
  const auto octet = static_cast<unsigned char>(c);
  return std::string("byte 0x") + digits[octet >> 4U] + digits[octet & 15U];
}

}  // namespace

Lexer::Lexer(std::string_view source) : source_(source) {
  if (source_.starts_with("\xEF\xBB\xBF")) at_ = 3;
}

bool Lexer::fail(std::size_t offset, std::string message) {
  error_offset_ = offset;
  error_ = std::move(message);
  return false;
}

bool Lexer::skip_blanks() {
  while (at_ < source_.size()) {
    const char c = source_[at_];
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
      ++at_;
    } else if (c == '#' || source_.substr(at_, 2) == "//") {
      at_ = std::min(source_.find('\n', at_), source_.size());
    } else if (source_.substr(at_, 2) == "/*") {
      const std::size_t end = source_.find("*/", at_ + 2);
      if (end == std::string_view::npos) return fail(at_, "this comment has no end; close it with \"*/\"");
      at_ = end + 2;
    } else {
      break;
    }
  }
  return true;
}

bool Lexer::literal(Token& token) {
  const char mark = source_[at_++];
  token.form = Token::Form::kText;
  token.text.clear();
  while (true) {
    if (at_ >= source_.size() || source_[at_] == '\n') {
      return fail(token.offset, "this string has no end on its line; close it with the quote that began it");
    }
    const char c = source_[at_++];
    if (c == mark) return true;
    if (c != '\\') {
      token.text.push_back(c);
      continue;
    }
    const char escaped = at_ < source_.size() ? source_[at_] : '\0';
    switch (escaped) {
      case 'r': token.text.push_back('\r'); break;
      case 'n': token.text.push_back('\n'); break;
      case 't': token.text.push_back('\t'); break;
      case '"':
      case '\'':
      case '\\': token.text.push_back(escaped); break;
      default: return fail(at_ - 1, R"(unknown escape in string; there are \r \n \t \" \' \\)");
    }
    ++at_;
  }
}

bool Lexer::number(Token& token) {
  const auto peek = [&](std::size_t i) { return i < source_.size() ? source_[i] : '\0'; };
  std::size_t i = at_;
  const bool negative = peek(i) == '-';
  if (peek(i) == '-' || peek(i) == '+') ++i;

  const auto integer = [&](std::size_t from, std::size_t to, int base) {
    std::uint64_t magnitude = 0;
    const auto parsed = std::from_chars(source_.data() + from, source_.data() + to, magnitude, base);
    const std::uint64_t most = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    // The compiler reads the digits of a hexadecimal number without its sign, so the least i64 has no such form.
    if (parsed.ec != std::errc() || magnitude > most + (negative && base == 10 ? 1 : 0)) {
      return fail(at_, fmt::format("the number {} does not fit into an i64", source_.substr(at_, to - at_)));
    }
    token.form = Token::Form::kInt;
    token.integer = static_cast<std::int64_t>(negative ? 0 - magnitude : magnitude);
    at_ = to;
    return true;
  };

  if (peek(i) == '0' && peek(i + 1) == 'x' && is_hex_digit(peek(i + 2))) {
    std::size_t end = i + 2;
    while (is_hex_digit(peek(end))) ++end;
    return integer(i + 2, end, 16);
  }
  std::size_t end = i;
  while (is_digit(peek(end))) ++end;
  const std::size_t digits_end = end;
  if (peek(end) == '.' && is_digit(peek(end + 1))) {
    for (++end; is_digit(peek(end));) ++end;
  }
  if (peek(end) == 'e' || peek(end) == 'E') {
    std::size_t exponent = end + 1;
    if (peek(exponent) == '-' || peek(exponent) == '+') ++exponent;
    if (is_digit(peek(exponent))) {
      for (end = exponent; is_digit(peek(end));) ++end;
    }
  }
  if (end == digits_end && digits_end > i) return integer(i, end, 10);
  if (end == i && i == at_) return fail(at_, "unexpected " + shown_character(source_[at_]));
  token.form = Token::Form::kDouble;
  // from_chars knows no leading plus and wants a digit before the point; a lone sign is zero to the compiler.
  const std::string digits = fmt::format("0{}", source_.substr(i, end - i));
  token.real = 0;
  const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), token.real);
  if (parsed.ec == std::errc::result_out_of_range) token.real = std::strtod(digits.c_str(), nullptr);
  if (negative) token.real = -token.real;
  at_ = end;
  return true;
}

bool Lexer::next(Token& token) {
  if (!skip_blanks()) return false;
  token.offset = at_;
  token.form = Token::Form::kEnd;
  token.length = 0;
  if (at_ >= source_.size()) return true;
  const char c = source_[at_];
  bool good = true;
  if (is_word_start(c)) {
    std::size_t end = at_ + 1;
    while (end < source_.size() && (is_word_part(source_[end]) || (source_[end] == '.' && end + 1 < source_.size() &&
                                                                   is_word_part(source_[end + 1])))) {
      ++end;
    }
    token.form = Token::Form::kWord;
    token.word = source_.substr(at_, end - at_);
    at_ = end;
  } else if (c == '"' || c == '\'') {
    good = literal(token);
  } else if (std::string_view(":;,{}()=<>[]*&").find(c) != std::string_view::npos) {
    token.form = Token::Form::kSymbol;
    token.symbol = c;
    ++at_;
  } else if (is_digit(c) || c == '+' || c == '-' || c == '.') {
    good = number(token);
  } else {
    good = fail(at_, "unexpected " + shown_character(c));
  }
  token.length = at_ - token.offset;
  return good;
}

}  // namespace sentree::idl::syntax
