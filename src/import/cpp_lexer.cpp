#include "sentree/import/detail/cpp_lexer.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace sentree::import {

namespace {

bool is_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

constexpr std::array<std::string_view, 3> kThree{"<<=", ">>=", "..."};
constexpr std::array<std::string_view, 20> kTwo{"::", "->", "==", "!=", "<=", ">=", "&&", "||", "++", "--",
                                                "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<", ">>"};

std::size_t punctuation(std::string_view rest) {
  for (const std::string_view sign : kThree) {
    if (rest.starts_with(sign)) return 3;
  }
  for (const std::string_view sign : kTwo) {
    if (rest.starts_with(sign)) return 2;
  }
  return 1;
}

std::size_t end_of_quoted(std::string_view source, std::size_t at) {
  const char quote = source[at];
  for (++at; at < source.size() && source[at] != quote; ++at) {
    if (source[at] == '\\') ++at;
  }
  return std::min(at + 1, source.size());
}

int depth_change(const Token& token) {
  if (token.kind != TokenKind::kPunctuation) return 0;
  if (token.is("(") || token.is("[") || token.is("{")) return 1;
  if (token.is(")") || token.is("]") || token.is("}")) return -1;
  return 0;
}

}  // namespace

std::vector<Token> tokens_of(std::string_view source) {
  std::vector<Token> tokens;
  const auto add = [&](TokenKind kind, std::size_t begin, std::size_t end) {
    tokens.push_back({kind, std::string(source.substr(begin, end - begin)), begin, end});
    return end;
  };
  bool line_begins = true;
  for (std::size_t at = 0; at < source.size();) {
    const char c = source[at];
    const std::string_view rest = source.substr(at);
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      line_begins = line_begins || c == '\n';
      ++at;
      continue;
    }
    if (rest.starts_with("//") || (c == '#' && line_begins)) {
      at = add(TokenKind::kComment, at, std::min(source.find('\n', at), source.size()));
    } else if (rest.starts_with("/*")) {
      const std::size_t close = source.find("*/", at + 2);
      at = add(TokenKind::kComment, at, close == std::string_view::npos ? source.size() : close + 2);
    } else if (std::isdigit(static_cast<unsigned char>(c)) != 0) {
      std::size_t end = at;
      while (end < source.size() && (is_name(source[end]) || source[end] == '.')) ++end;
      at = add(TokenKind::kNumber, at, end);
    } else if (is_name(c)) {
      std::size_t end = at;
      while (end < source.size() && is_name(source[end])) ++end;
      at = add(TokenKind::kName, at, end);
    } else if (c == '"' || c == '\'') {
      const std::size_t end = end_of_quoted(source, at);
      add(TokenKind::kText, at, end);
      std::string& text = tokens.back().text;
      text = text.substr(1, text.size() < 2 ? 0 : text.size() - 2);
      at = end;
    } else {
      at = add(TokenKind::kPunctuation, at, at + punctuation(rest));
    }
    line_begins = false;
  }
  return tokens;
}

std::size_t closing(Tokens tokens, std::size_t open) {
  int depth = 0;
  for (std::size_t at = open; at < tokens.size(); ++at) {
    depth += depth_change(tokens[at]);
    if (depth == 0) return at;
  }
  return tokens.size();
}

std::vector<Tokens> split(Tokens tokens, std::string_view separator) {
  std::vector<Tokens> parts;
  if (tokens.empty()) return parts;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t at = 0; at < tokens.size(); ++at) {
    depth += depth_change(tokens[at]);
    if (depth != 0 || !tokens[at].is(separator)) continue;
    parts.push_back(tokens.subspan(begin, at - begin));
    begin = at + 1;
  }
  parts.push_back(tokens.subspan(begin));
  return parts;
}

}  // namespace sentree::import
