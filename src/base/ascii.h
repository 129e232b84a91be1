#pragma once

namespace sentree {

/// 0 to 9.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
/// What XML calls white space: blank, tab, line feed, carriage return.
constexpr bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
/// A letter, a digit or an underscore.
constexpr bool is_word(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_'; }

}  // namespace sentree
