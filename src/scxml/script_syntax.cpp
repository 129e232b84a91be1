#include "sentree/scxml/script_syntax.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "sentree/base/ascii.h"

namespace sentree::scxml {

bool is_reserved_word(std::string_view name) {
  constexpr std::array<std::string_view, 45> kWords{
      "break",   "case",       "catch",     "class",  "const",      "continue",  "debugger", "default", "delete",
      "do",      "else",       "enum",      "export", "extends",    "false",     "finally",  "for",     "function",
      "if",      "implements", "import",    "in",     "instanceof", "interface", "let",      "new",     "null",
      "package", "private",    "protected", "public", "return",     "static",    "super",    "switch",  "this",
      "throw",   "true",       "try",       "typeof", "var",        "void",      "while",    "with",    "yield"};
  return name.size() >= 2 && std::find(kWords.begin(), kWords.end(), name) != kWords.end();
}

namespace {

using Kind = ScriptNode::Kind;

bool is_name_start(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool is_name_part(char c) { return is_name_start(c) || is_digit(c); }

struct Token {
  enum class Kind : std::uint8_t { kEnd, kName, kNumber, kText, kSign, kRegex, kBad };
  Kind kind = Kind::kEnd;
  std::string_view raw;
  std::string text;  // of a text: what it says
  double number = 0;
};

// Longer ones first.
constexpr std::array<std::string_view, 48> kSigns{
    ">>>=", "===", "!==", ">>>", "<<=", ">>=", "<=", ">=", "==", "!=", "&&", "||", "++", "--", "<<", ">>",
    "+=",   "-=",  "*=",  "/=",  "%=",  "&=",  "|=", "^=", "{",  "}",  "(",  ")",  "[",  "]",  ".",  ";",
    ",",    "<",   ">",   "+",   "-",   "*",   "/",  "%",  "&",  "|",  "^",  "!",  "~",  "?",  ":",  "="};

class Lexer {
 public:
  explicit Lexer(std::string_view source) : source_(source) {}

  /// `divides`: a slash here is a division, not a regular expression.
  Token next(bool divides) {
    if (!skip()) return {Token::Kind::kBad, {}, {}, 0};
    if (at_ == source_.size()) return {};
    const std::size_t begin = at_;
    const char c = source_[at_];
    if (is_name_start(c)) {
      while (at_ < source_.size() && is_name_part(source_[at_])) ++at_;
      return {Token::Kind::kName, source_.substr(begin, at_ - begin), {}, 0};
    }
    if (is_digit(c) || (c == '.' && at_ + 1 < source_.size() && is_digit(source_[at_ + 1]))) return number();
    if (c == '"' || c == '\'') return quoted(c);
    if (c == '/' && !divides) return regex();
    for (const std::string_view sign : kSigns) {
      if (!source_.substr(at_).starts_with(sign)) continue;
      at_ += sign.size();
      return {Token::Kind::kSign, source_.substr(begin, sign.size()), {}, 0};
    }
    return {Token::Kind::kBad, {}, {}, 0};
  }

  void step() { at_ = std::min(at_ + 1, source_.size()); }

 private:
  bool skip() {
    while (at_ < source_.size()) {
      const std::string_view rest = source_.substr(at_);
      if (rest[0] == ' ' || rest[0] == '\t' || rest[0] == '\n' || rest[0] == '\r') {
        ++at_;
      } else if (rest.starts_with("//")) {
        const std::size_t end = rest.find('\n');
        at_ = end == std::string_view::npos ? source_.size() : at_ + end;
      } else if (rest.starts_with("/*")) {
        const std::size_t end = rest.find("*/", 2);
        if (end == std::string_view::npos) return false;
        at_ += end + 2;
      } else {
        break;
      }
    }
    return true;
  }

  Token number() {
    const std::size_t begin = at_;
    Token token{Token::Kind::kNumber, {}, {}, 0};
    const char second = at_ + 1 < source_.size() ? source_[at_ + 1] : '\0';
    if (source_[at_] == '0' && (second == 'x' || second == 'X')) {
      at_ += 2;
      std::uint64_t whole = 0;
      const auto [end, error] = std::from_chars(source_.data() + at_, source_.data() + source_.size(), whole, 16);
      if (error != std::errc()) return {Token::Kind::kBad, {}, {}, 0};
      token.number = static_cast<double>(whole);
      at_ = static_cast<std::size_t>(end - source_.data());
    } else {
      const auto [end, error] = std::from_chars(source_.data() + at_, source_.data() + source_.size(), token.number);
      if (error != std::errc()) return {Token::Kind::kBad, {}, {}, 0};
      at_ = static_cast<std::size_t>(end - source_.data());
    }
    if (at_ < source_.size() && is_name_part(source_[at_])) return {Token::Kind::kBad, {}, {}, 0};
    token.raw = source_.substr(begin, at_ - begin);
    return token;
  }

  Token quoted(char quote) {
    const std::size_t begin = at_;
    Token token{Token::Kind::kText, {}, {}, 0};
    for (++at_; at_ < source_.size() && source_[at_] != quote; ++at_) {
      char c = source_[at_];
      if (c == '\n') return {Token::Kind::kBad, {}, {}, 0};
      if (c == '\\') {
        if (++at_ == source_.size()) break;
        c = source_[at_];
        constexpr std::string_view kFrom = "ntrbfv0";
        constexpr std::string_view kTo("\n\t\r\b\f\v\0", 7);
        if (const auto which = kFrom.find(c); which != std::string_view::npos) c = kTo[which];
        // What a code stands for is not looked up; the text is only compared, and then it is none that is known.
      }
      token.text += c;
    }
    if (at_ == source_.size()) return {Token::Kind::kBad, {}, {}, 0};
    ++at_;
    token.raw = source_.substr(begin, at_ - begin);
    return token;
  }

  Token regex() {
    const std::size_t begin = at_;
    bool in_class = false;
    for (++at_; at_ < source_.size() && (source_[at_] != '/' || in_class); ++at_) {
      if (source_[at_] == '\n') return {Token::Kind::kBad, {}, {}, 0};
      if (source_[at_] == '\\')
        ++at_;
      else if (source_[at_] == '[' || source_[at_] == ']')
        in_class = source_[at_] == '[';
    }
    if (at_ >= source_.size()) return {Token::Kind::kBad, {}, {}, 0};
    for (++at_; at_ < source_.size() && is_name_part(source_[at_]);) ++at_;
    return {Token::Kind::kRegex, source_.substr(begin, at_ - begin), {}, 0};
  }

  std::string_view source_;
  std::size_t at_ = 0;
};

int precedence_of(std::string_view sign) {
  constexpr std::array<std::pair<std::string_view, int>, 23> kBinary{
      {{"||", 1},  {"&&", 2},  {"|", 3}, {"^", 4},  {"&", 5},  {"==", 6},         {"!=", 6}, {"===", 6},
       {"!==", 6}, {"<", 7},   {">", 7}, {"<=", 7}, {">=", 7}, {"instanceof", 7}, {"in", 7}, {"<<", 8},
       {">>", 8},  {">>>", 8}, {"+", 9}, {"-", 9},  {"*", 10}, {"/", 10},         {"%", 10}}};
  for (const auto& [text, precedence] : kBinary) {
    if (text == sign) return precedence;
  }
  return 0;
}

bool is_assignment(std::string_view sign) {
  return sign == "=" || (sign.size() > 1 && sign.back() == '=' && precedence_of(sign) == 0);
}

class Parser {
 public:
  explicit Parser(std::string_view source) : lexer_(source) { advance(false); }

  std::optional<ScriptTree> run() {
    comma(0);
    if (!ok_ || token_.kind != Token::Kind::kEnd) return std::nullopt;
    return std::move(tree_);
  }

 private:
  using Id = std::uint32_t;

  void advance(bool divides) { token_ = lexer_.next(divides); }
  [[nodiscard]] bool is(std::string_view sign) const {
    return (token_.kind == Token::Kind::kSign || token_.kind == Token::Kind::kName) && token_.raw == sign;
  }
  // Behind what has been accepted an operand follows, unless said otherwise.
  bool accept(std::string_view sign, bool divides = false) {
    if (!is(sign)) return false;
    advance(divides);
    return true;
  }
  Id give_up() {
    ok_ = false;
    return 0;
  }
  Id add(ScriptNode node) {
    tree_.nodes.push_back(std::move(node));
    return tree_.root();
  }
  Id add(Kind kind, std::string_view text, std::vector<Id> operands) {
    return add({kind, std::string(text), 0, std::move(operands), {}});
  }

  Id comma(int depth) {
    Id left = assignment(depth);
    while (ok_ && accept(",")) {
      const Id right = assignment(depth + 1);
      left = add(Kind::kBinary, ",", {left, right});
    }
    return left;
  }

  Id assignment(int depth) {
    if (depth > kScriptNestingMax) return give_up();
    const Id left = binary(1, depth);
    if (!ok_) return 0;
    if (accept("?")) {
      const Id yes = assignment(depth + 1);
      if (!ok_ || !accept(":")) return give_up();
      const Id no = assignment(depth + 1);
      return ok_ ? add(Kind::kConditional, "?", {left, yes, no}) : 0;
    }
    if (token_.kind != Token::Kind::kSign || !is_assignment(token_.raw)) return left;
    const std::string sign(token_.raw);
    advance(false);
    const Id right = assignment(depth + 1);
    return ok_ ? add(Kind::kAssignment, sign, {left, right}) : 0;
  }

  Id binary(int least, int depth) {
    if (depth > kScriptNestingMax) return give_up();
    Id left = unary(depth + 1);
    while (ok_ && (token_.kind == Token::Kind::kSign || token_.kind == Token::Kind::kName)) {
      const int precedence = precedence_of(token_.raw);
      if (precedence == 0 || precedence < least) break;
      const std::string sign(token_.raw);
      advance(false);
      const Id right = binary(precedence + 1, depth + 1);
      if (ok_) left = add(Kind::kBinary, sign, {left, right});
    }
    return left;
  }

  Id unary(int depth) {
    if (depth > kScriptNestingMax) return give_up();
    for (const std::string_view sign : {"!", "-", "+", "~", "typeof", "void", "delete", "++", "--"}) {
      if (!accept(sign)) continue;
      const Id operand = unary(depth + 1);
      return ok_ ? add(Kind::kUnary, sign, {operand}) : 0;
    }
    const Id operand = postfix(primary(depth), depth);
    for (const std::string_view sign : {"++", "--"}) {
      if (ok_ && accept(sign, true)) return add(Kind::kUnary, sign, {operand});
    }
    return operand;
  }

  Id postfix(Id object, int depth) {
    while (ok_) {
      if (accept(".")) {
        if (token_.kind != Token::Kind::kName) return give_up();
        const std::string_view name = token_.raw;
        advance(true);
        object = add(Kind::kMember, name, {object});
      } else if (accept("[")) {
        const Id index = comma(depth + 1);
        if (!ok_ || !accept("]", true)) return give_up();
        object = add(Kind::kIndex, "[", {object, index});
      } else if (is("(")) {
        std::vector<Id> operands{object};
        if (!arguments(operands, depth)) return give_up();
        object = add(Kind::kCall, "(", std::move(operands));
      } else {
        return object;
      }
    }
    return 0;
  }

  bool arguments(std::vector<Id>& operands, int depth) {
    advance(false);
    if (accept(")", true)) return true;
    do {
      operands.push_back(assignment(depth + 1));
    } while (ok_ && accept(","));
    return ok_ && accept(")", true);
  }

  Id primary(int depth) {
    const Token token = token_;
    switch (token.kind) {
      case Token::Kind::kNumber:
        advance(true);
        return add({Kind::kNumber, std::string(token.raw), token.number, {}, {}});
      case Token::Kind::kText: advance(true); return add(Kind::kText, token.text, {});
      case Token::Kind::kRegex: advance(true); return add(Kind::kOpaque, "regex", {});
      case Token::Kind::kName: return word(token.raw, depth);
      case Token::Kind::kSign: break;
      default: return give_up();
    }
    if (accept("(")) {
      const Id inner = comma(depth + 1);
      return ok_ && accept(")", true) ? inner : give_up();
    }
    if (accept("[")) return list(depth);
    if (accept("{")) return record(depth);
    return give_up();
  }

  Id word(std::string_view name, int depth) {
    if (name == "function") return function();
    if (name == "new") {
      advance(false);
      const Id made = postfix(primary(depth + 1), depth + 1);
      return ok_ ? add(Kind::kOpaque, "new", {made}) : 0;
    }
    advance(true);
    if (name == "true" || name == "false")
      return add({Kind::kTruth, std::string(name), name == "true" ? 1.0 : 0.0, {}, {}});
    if (name == "null" || name == "undefined") return add(Kind::kNothing, name, {});
    constexpr std::array<std::string_view, 22> kStatements{
        "break", "case", "catch",  "class", "const",  "continue", "debugger", "default", "do",  "else",  "finally",
        "for",   "if",   "import", "let",   "return", "switch",   "throw",    "try",     "var", "while", "with"};
    if (std::find(kStatements.begin(), kStatements.end(), name) != kStatements.end()) return give_up();
    return add(Kind::kName, name, {});
  }

  // Its body is not looked into.
  Id function() {
    int open = 0;
    bool any = false;
    for (bool divides = false; token_.kind != Token::Kind::kEnd; advance(divides)) {
      if (token_.kind == Token::Kind::kBad) return give_up();
      if (is("{")) ++open, any = true;
      if (is("}") && --open == 0 && any) {
        advance(true);
        return add(Kind::kOpaque, "function", {});
      }
      divides = token_.kind != Token::Kind::kSign || is(")") || is("]") || is("}");
    }
    return give_up();
  }

  Id list(int depth) {
    std::vector<Id> items;
    while (ok_ && !is("]")) {
      // Nothing between two commas is undefined.
      items.push_back(is(",") ? add(Kind::kNothing, "hole", {}) : assignment(depth + 1));
      if (!ok_ || (!is("]") && !accept(","))) return give_up();
    }
    if (!ok_ || !accept("]", true)) return give_up();
    return add(Kind::kList, "[", std::move(items));
  }

  Id record(int depth) {
    ScriptNode node{Kind::kRecord, "{", 0, {}, {}};
    if (!accept("}", true)) {
      do {
        const bool named = token_.kind == Token::Kind::kName || token_.kind == Token::Kind::kText ||
                           token_.kind == Token::Kind::kNumber;
        if (!named) return give_up();
        node.names.push_back(token_.kind == Token::Kind::kText ? token_.text : std::string(token_.raw));
        advance(true);
        if (!accept(":")) return give_up();
        node.operands.push_back(assignment(depth + 1));
      } while (ok_ && accept(","));
      if (!ok_ || !accept("}", true)) return give_up();
    }
    return add(std::move(node));
  }

  Lexer lexer_;
  Token token_;
  ScriptTree tree_;
  bool ok_ = true;
};

}  // namespace

std::string ScriptTree::path(std::uint32_t node) const {
  const ScriptNode& n = at(node);
  if (n.kind == Kind::kName) return n.text;
  if (n.kind != Kind::kMember) return {};
  const std::string object = path(n.operands[0]);
  return object.empty() ? std::string() : fmt::format("{}.{}", object, n.text);
}

std::optional<ScriptTree> parse_script_expression(std::string_view source) { return Parser(source).run(); }

namespace {

// Whether a slash behind it is a division.
bool divides_behind(const Token& token) {
  return token.kind == Token::Kind::kName   ? token.raw != "return" && token.raw != "typeof" && token.raw != "case"
         : token.kind == Token::Kind::kSign ? token.raw == ")" || token.raw == "]" || token.raw == "}"
                                            : token.kind != Token::Kind::kBad;
}

}  // namespace

std::set<std::string> names_in_script(std::string_view source) {
  std::set<std::string> names;
  Lexer lexer(source);
  bool divides = false;
  for (Token token = lexer.next(divides); token.kind != Token::Kind::kEnd; token = lexer.next(divides)) {
    if (token.kind == Token::Kind::kBad) lexer.step();
    if (token.kind == Token::Kind::kName) names.emplace(token.raw);
    divides = divides_behind(token);
  }
  return names;
}

std::optional<std::vector<ScriptToken>> script_tokens(std::string_view source) {
  std::vector<ScriptToken> tokens;
  Lexer lexer(source);
  bool divides = false;
  for (Token token = lexer.next(divides); token.kind != Token::Kind::kEnd; token = lexer.next(divides)) {
    if (token.kind == Token::Kind::kBad) return std::nullopt;
    tokens.push_back({token.kind == Token::Kind::kName   ? ScriptToken::Kind::kName
                      : token.kind == Token::Kind::kSign ? ScriptToken::Kind::kSign
                                                         : ScriptToken::Kind::kLiteral,
                      token.raw});
    divides = divides_behind(token);
  }
  return tokens;
}

namespace {

// Where something is no token, what stands before and behind it is still found.
std::vector<Token> tokens_as_far_as_there_are(std::string_view source) {
  std::vector<Token> tokens;
  Lexer lexer(source);
  bool divides = false;
  for (Token token = lexer.next(divides); token.kind != Token::Kind::kEnd; token = lexer.next(divides)) {
    if (token.kind == Token::Kind::kBad) lexer.step();
    divides = divides_behind(token);
    tokens.push_back(std::move(token));
  }
  return tokens;
}

bool asks_for_state(const std::vector<Token>& tokens, std::size_t i) {
  const bool calls = tokens[i].kind == Token::Kind::kName && tokens[i].raw == "In" && i + 3 < tokens.size() &&
                     tokens[i + 1].raw == "(";
  return calls && (i == 0 || (tokens[i - 1].raw != "." && tokens[i - 1].raw != "function"));
}

std::string_view inside_of(const Token& text) { return text.raw.substr(1, text.raw.size() - 2); }

// By a call at `i`: the id, as written; empty: what that is, is computed.
std::string_view state_asked_for(std::string_view source, const std::vector<Token>& tokens, std::size_t i, bool bare) {
  const Token& id = tokens[i + 2];
  if (id.kind == Token::Kind::kText && tokens[i + 3].raw == ")") {
    const std::string_view inside = inside_of(id);
    return inside.find('\\') == std::string_view::npos ? inside : std::string_view();
  }
  if (!bare || id.kind != Token::Kind::kName) return {};
  const auto from = static_cast<std::size_t>(id.raw.data() - source.data());
  const std::size_t end = source.find_first_of("'\"() \t\r\n", from);
  const std::size_t close = source.find_first_not_of(" \t\r\n", end);
  return close != std::string_view::npos && source[close] == ')' ? source.substr(from, end - from) : std::string_view();
}

}  // namespace

std::vector<std::string_view> states_asked_for(std::string_view source, bool bare) {
  std::vector<std::string_view> found;
  if (source.find("In") == std::string_view::npos) return found;
  const std::vector<Token> tokens = tokens_as_far_as_there_are(source);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (!asks_for_state(tokens, i)) continue;
    if (const std::string_view id = state_asked_for(source, tokens, i, bare); !id.empty()) found.push_back(id);
  }
  return found;
}

std::vector<ScriptMention> texts_in_script(std::string_view source, bool bare) {
  std::vector<ScriptMention> found;
  const std::vector<Token> tokens = tokens_as_far_as_there_are(source);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].kind == Token::Kind::kText)
      found.push_back({inside_of(tokens[i]), false});
    else if (asks_for_state(tokens, i) && state_asked_for(source, tokens, i, bare).empty())
      found.push_back({tokens[i].raw, true});
  }
  return found;
}

bool is_script_global(std::string_view name) {
  constexpr std::array<std::string_view, 56> kGlobals{"In",
                                                      "Infinity",
                                                      "NaN",
                                                      "undefined",
                                                      "null",
                                                      "this",
                                                      "arguments",
                                                      "_event",
                                                      "_name",
                                                      "_sessionid",
                                                      "_ioprocessors",
                                                      "_x",
                                                      "Math",
                                                      "JSON",
                                                      "Object",
                                                      "Array",
                                                      "String",
                                                      "Number",
                                                      "Boolean",
                                                      "Date",
                                                      "RegExp",
                                                      "Function",
                                                      "Error",
                                                      "EvalError",
                                                      "RangeError",
                                                      "ReferenceError",
                                                      "SyntaxError",
                                                      "TypeError",
                                                      "URIError",
                                                      "parseInt",
                                                      "parseFloat",
                                                      "isNaN",
                                                      "isFinite",
                                                      "eval",
                                                      "encodeURI",
                                                      "encodeURIComponent",
                                                      "decodeURI",
                                                      "decodeURIComponent",
                                                      "escape",
                                                      "unescape",
                                                      "print",
                                                      "alert",
                                                      "console",
                                                      "performance",
                                                      "Duktape",
                                                      "Proxy",
                                                      "Reflect",
                                                      "Symbol",
                                                      "Buffer",
                                                      "ArrayBuffer",
                                                      "Uint8Array",
                                                      "Float64Array",
                                                      "TextEncoder",
                                                      "TextDecoder",
                                                      "globalThis",
                                                      "CBOR"};
  return std::find(kGlobals.begin(), kGlobals.end(), name) != kGlobals.end();
}

}  // namespace sentree::scxml
