#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/base/result.h"

/// Tokens of the Thrift IDL. Private to the library.
namespace sentree::idl::syntax {

struct Token {
  enum class Form : std::uint8_t { kEnd, kSymbol, kInt, kDouble, kText, kWord };
  Form form = Form::kEnd;
  char symbol = 0;
  std::int64_t integer = 0;
  double real = 0;
  std::string_view word;  ///< kWord: an identifier or a keyword, as written.
  std::string text;       ///< kText: without quotes, escapes replaced.
  std::size_t offset = 0;
  std::size_t length = 0;
};

/// Cuts a source into tokens, skipping white space and comments. Borrows the source.
class Lexer {
 public:
  explicit Lexer(std::string_view source);

  /// The next token, or a message in `error()`, whose place is `error_offset()`.
  [[nodiscard]] bool next(Token& token);
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t error_offset() const { return error_offset_; }

 private:
  bool skip_blanks();
  bool literal(Token& token);
  bool number(Token& token);
  bool fail(std::size_t offset, std::string message);

  std::string_view source_;
  std::size_t at_ = 0;
  std::string error_;
  std::size_t error_offset_ = 0;
};

}  // namespace sentree::idl::syntax
