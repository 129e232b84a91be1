#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::import {

/// C++ that no chart can say. Error: import.cpp.
[[nodiscard]] inline tl::unexpected<Diagnostic> cannot(std::string message) {
  return fail("import.cpp", std::move(message));
}

enum class TokenKind { kName, kNumber, kText, kPunctuation, kComment };

/// A piece of C++ source. `text` of a kText is what is between the quotes, its escapes as written.
struct Token {
  TokenKind kind = TokenKind::kPunctuation;
  std::string text;
  std::size_t begin = 0;  ///< Byte offsets in the source.
  std::size_t end = 0;

  [[nodiscard]] bool is(std::string_view punctuation_or_name) const {
    return (kind == TokenKind::kPunctuation || kind == TokenKind::kName) && text == punctuation_or_name;
  }
};

using Tokens = std::span<const Token>;

/// The tokens of a snippet; preprocessor lines count as comments. Never fails: what is no token of C++ is punctuation
/// of one byte. Cost: O(size).
[[nodiscard]] std::vector<Token> tokens_of(std::string_view source);

/// Where the bracket that `tokens[open]` opens is closed, or tokens.size().
[[nodiscard]] std::size_t closing(Tokens tokens, std::size_t open);

/// Splits at `separator` outside brackets; an empty range has no parts.
[[nodiscard]] std::vector<Tokens> split(Tokens tokens, std::string_view separator);

}  // namespace sentree::import
