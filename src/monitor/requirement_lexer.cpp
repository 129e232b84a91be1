#include "sentree/monitor/requirement_lexer.h"

#include <charconv>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/ascii.h"

namespace sentree::monitor {

namespace {

using TokenKind = RequirementToken::Kind;

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || static_cast<unsigned char>(c) >= 0x80;
}

class Lexer {
 public:
  Lexer(std::string_view source, const std::string& file, Diagnostics& diagnostics)
      : source_(source), file_(file), lines_(source), diagnostics_(diagnostics) {}

  std::vector<RequirementToken> run() {
    bool starts_line = true;
    while (at_ < source_.size()) {
      const char c = source_[at_];
      if (is_space(c)) {
        starts_line = starts_line || c == '\n';
        ++at_;
        continue;
      }
      if (c == '#') {
        while (at_ < source_.size() && source_[at_] != '\n') ++at_;
        continue;
      }
      if (next(c)) {
        tokens_.back().starts_line = starts_line;
        starts_line = false;
      }
    }
    add(TokenKind::kEnd, at_, "");
    return std::move(tokens_);
  }

 private:
  [[nodiscard]] char peek(std::size_t ahead) const {
    return at_ + ahead < source_.size() ? source_[at_ + ahead] : '\0';
  }

  bool next(char c) {
    const std::size_t begin = at_;
    if (is_letter(c)) return name(begin);
    if (is_digit(c)) return number(begin);
    if (c == '"') return string(begin);
    if (c == '.') {
      ++at_;
      add(is_letter(peek(0)) ? TokenKind::kSymbol : TokenKind::kStop, begin, ".");
      return true;
    }
    // As programs write it.
    using Spelling = std::pair<std::string_view, std::string_view>;
    for (const auto& [theirs, ours] : {Spelling("==", "="), Spelling("&&", "and"), Spelling("||", "or"),
                                       Spelling("<>", "!="), Spelling("=>", "implies"), Spelling("->", "implies")}) {
      if (!source_.substr(at_).starts_with(theirs)) continue;
      at_ += 2;
      error(begin, 2, fmt::format("\"{}\" has no meaning here; write \"{}\"", theirs, ours));
      return false;
    }
    for (const std::string_view two : {"<=", ">=", "!="}) {
      if (source_.substr(at_).starts_with(two)) return symbol(begin, two);
    }
    constexpr std::string_view kSymbols = "()[],:=<>+-*/%";
    if (kSymbols.find(c) != std::string_view::npos) return symbol(begin, source_.substr(at_, 1));
    ++at_;
    error(begin, 1,
          fmt::format("character \"{}\" has no meaning here{}", std::string(1, c), c == '!' ? "; write \"not\"" : ""));
    return false;
  }

  bool symbol(std::size_t begin, std::string_view text) {
    at_ += text.size();
    add(TokenKind::kSymbol, begin, std::string(text));
    return true;
  }

  void word() {
    while (at_ < source_.size() && (is_letter(source_[at_]) || is_digit(source_[at_]))) ++at_;
  }

  bool name(std::size_t begin) {
    word();
    while (peek(0) == '.' && is_letter(peek(1))) {
      ++at_;
      word();
    }
    if (source_.substr(begin, at_ - begin) == "re" && source_.substr(at_).starts_with("-arming")) at_ += 7;
    add(TokenKind::kName, begin, std::string(source_.substr(begin, at_ - begin)));
    return true;
  }

  bool number(std::size_t begin) {
    const auto digits = [&] {
      while (is_digit(peek(0))) ++at_;
    };
    digits();
    if (peek(0) == '.' && is_digit(peek(1))) {
      ++at_;
      digits();
    }
    if ((peek(0) == 'e' || peek(0) == 'E') && (is_digit(peek(1)) || (peek(1) == '-' && is_digit(peek(2))))) {
      at_ += 2;
      digits();
    }
    add(TokenKind::kNumber, begin, std::string(source_.substr(begin, at_ - begin)));
    const std::string& text = tokens_.back().text;
    if (std::from_chars(text.data(), text.data() + text.size(), tokens_.back().number).ec != std::errc())
      error(begin, at_ - begin, fmt::format("number {} is out of range", text));
    return true;
  }

  bool string(std::size_t begin) {
    const std::size_t end = source_.find_first_of("\"\n", begin + 1);
    if (end == std::string_view::npos || source_[end] == '\n') {
      at_ = end == std::string_view::npos ? source_.size() : end;
      error(begin, 1, "text begins here, but its closing \" is missing on this line");
      return false;
    }
    at_ = end + 1;
    add(TokenKind::kString, begin, std::string(source_.substr(begin + 1, end - begin - 1)));
    return true;
  }

  [[nodiscard]] SourceSpan span(std::size_t begin, std::size_t length) const {
    const auto position = lines_.position(begin);
    return {file_, position.line, position.column, static_cast<int>(length)};
  }

  void add(TokenKind kind, std::size_t begin, std::string text) {
    RequirementToken token;
    token.kind = kind;
    token.text = std::move(text);
    token.adjacent = begin == end_of_last_;
    token.span = span(begin, at_ - begin);
    end_of_last_ = at_;
    tokens_.push_back(std::move(token));
  }

  void error(std::size_t begin, std::size_t length, std::string message) {
    diagnostics_.push_back({Severity::kError, "requirement.syntax", std::move(message), span(begin, length)});
  }

  std::string_view source_;
  const std::string& file_;
  LineIndex lines_;
  Diagnostics& diagnostics_;
  std::size_t at_ = 0;
  std::size_t end_of_last_ = static_cast<std::size_t>(-1);
  std::vector<RequirementToken> tokens_;
};

}  // namespace

std::vector<RequirementToken> lex_requirements(std::string_view source, const std::string& file,
                                               Diagnostics& diagnostics) {
  return Lexer(source, file, diagnostics).run();
}

}  // namespace sentree::monitor
