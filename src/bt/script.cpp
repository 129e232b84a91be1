#include "sentree/bt/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "sentree/base/ascii.h"
#include "sentree/bt/detail/script_numbers.h"

namespace sentree::bt {

namespace {

enum class Token { kEnd, kNumber, kInteger, kString, kName, kOperator, kBad };

struct Lexeme {
  Token token = Token::kEnd;
  std::string_view text;
  std::size_t offset = 0;
};

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '@'; }
bool is_hex(char c) { return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); }

class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  Lexeme next() {
    while (at_ < text_.size() &&
           (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r')) {
      ++at_;
    }
    const std::size_t start = at_;
    if (at_ == text_.size()) return {Token::kEnd, "end of script", start};
    const char c = text_[at_];
    if (is_digit(c)) return number();
    if (starts_name(c)) {
      while (at_ < text_.size() && ((starts_name(text_[at_]) && text_[at_] != '@') || is_digit(text_[at_]) ||
                                    (at_ == start && text_[at_] == '@'))) {
        ++at_;
      }
      return {Token::kName, text_.substr(start, at_ - start), start};
    }
    if (c == '\'') {
      const std::size_t end = text_.find('\'', at_ + 1);
      if (end == std::string_view::npos) {
        at_ = text_.size();
        return {Token::kBad, text_.substr(start), start};
      }
      at_ = end + 1;
      return {Token::kString, text_.substr(start + 1, end - start - 1), start};
    }
    static constexpr std::string_view kOperators[] = {":=", "+=", "-=", "*=", "/=", "==", "!=", "<=", ">=", "&&",
                                                      "||", "..", "=",  "+",  "-",  "*",  "/",  "<",  ">",  "&",
                                                      "|",  "^",  "~",  "!",  "?",  ":",  "(",  ")",  ";"};
    for (const std::string_view op : kOperators) {
      if (text_.substr(at_).starts_with(op)) {
        at_ += op.size();
        return {Token::kOperator, op, start};
      }
    }
    ++at_;
    return {Token::kBad, text_.substr(start, 1), start};
  }

 private:
  Lexeme number() {
    const std::size_t start = at_;
    if (text_[at_] == '0' && at_ + 2 < text_.size() && (text_[at_ + 1] == 'x' || text_[at_ + 1] == 'X') &&
        is_hex(text_[at_ + 2])) {
      at_ += 2;
      while (at_ < text_.size() && is_hex(text_[at_])) ++at_;
      return {Token::kInteger, text_.substr(start, at_ - start), start};
    }
    Token token = Token::kInteger;
    skip_digits();
    if (at_ + 1 < text_.size() && text_[at_] == '.' && is_digit(text_[at_ + 1])) {
      token = Token::kNumber;
      ++at_;
      skip_digits();
    }
    if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
      std::size_t digits = at_ + 1;
      if (digits < text_.size() && (text_[digits] == '+' || text_[digits] == '-')) ++digits;
      if (digits < text_.size() && is_digit(text_[digits])) {
        token = Token::kNumber;
        at_ = digits;
        skip_digits();
      }
    }
    // "3abc" is no number and no name.
    if (at_ < text_.size() && starts_name(text_[at_])) {
      return {Token::kBad, text_.substr(start, at_ + 1 - start), start};
    }
    return {token, text_.substr(start, at_ - start), start};
  }
  void skip_digits() {
    while (at_ < text_.size() && is_digit(text_[at_])) ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

using Op = Instruction::Op;

struct Infix {
  std::string_view text;
  int level;
  Op op;
};
// Lowest first. Comparisons share a level, because they chain.
constexpr int kLevelOr = 1, kLevelCompare = 3, kLevelPrefix = 8;
constexpr Infix kInfix[] = {
    {"||", kLevelOr, Op::kLogicOr},
    {"&&", 2, Op::kLogicAnd},
    {"==", kLevelCompare, Op::kEqual},
    {"!=", kLevelCompare, Op::kNotEqual},
    {"<", kLevelCompare, Op::kLess},
    {"<=", kLevelCompare, Op::kLessEqual},
    {">", kLevelCompare, Op::kGreater},
    {">=", kLevelCompare, Op::kGreaterEqual},
    {"|", 4, Op::kBitOr},
    {"^", 4, Op::kBitXor},
    {"&", 5, Op::kBitAnd},
    {"+", 6, Op::kAdd},
    {"-", 6, Op::kSubtract},
    {"..", 6, Op::kConcat},
    {"*", 7, Op::kMultiply},
    {"/", 7, Op::kDivide},
};
constexpr std::pair<std::string_view, Op> kAssignments[] = {
    {":=", Op::kCreate},         {"=", Op::kAssign},          {"+=", Op::kAddAssign},
    {"-=", Op::kSubtractAssign}, {"*=", Op::kMultiplyAssign}, {"/=", Op::kDivideAssign},
};

/// Recursive descent by operator levels; emits code for a stack machine as it goes.
class Compiler {
 public:
  Compiler(std::string_view text, const EnumLookup& enums) : lexer_(text), enums_(enums) {
    script_.text = std::string(text);
    advance();
  }

  Result<Script> compile() {
    if (script_.text.size() > kScriptBytesMax) {
      return sentree::fail("bt.script-too-large", fmt::format("script of {} bytes; at most {} are accepted",
                                                              script_.text.size(), kScriptBytesMax));
    }
    bool any = false;
    while (ok_) {
      const bool separated = is(";");
      while (is(";")) advance();
      if (look_.token == Token::kEnd) break;
      if (any) emit(Op::kPop, -1);
      if (any && !separated) {
        warn("bt.script-separator", "a statement begins here without a \";\" before it");
      }
      statement();
      any = true;
    }
    if (ok_ && !any) error("the script is empty");
    if (!ok_) {
      return sentree::fail(too_deep_ ? "bt.script-too-large" : "bt.script-syntax", message_,
                           {{}, 0, static_cast<int>(offset_) + 1, 0});
    }
    return std::move(script_);
  }

 private:
  void advance() { look_ = lexer_.next(); }
  [[nodiscard]] bool is(std::string_view op) const { return look_.token == Token::kOperator && look_.text == op; }

  void error(std::string what) {
    if (!ok_) return;
    ok_ = false;
    offset_ = look_.offset;
    message_ = fmt::format("script \"{}\", column {}: {}", shown(), look_.offset + 1, what);
  }
  void warn(std::string code, std::string what) {
    script_.warnings.push_back(
        {look_.offset, std::move(code), fmt::format("script \"{}\", column {}: {}", shown(), look_.offset + 1, what)});
  }
  [[nodiscard]] std::string shown() const {
    std::string text = script_.text.substr(0, 60);
    if (text.size() < script_.text.size()) text += "…";
    return text;
  }
  void unexpected(std::string_view wanted) {
    if (look_.token == Token::kBad && look_.text.starts_with('\'')) return error("the string is not closed; add a '");
    if (look_.token == Token::kEnd) return error(fmt::format("the script ends where {} is expected", wanted));
    error(fmt::format("unexpected \"{}\" where {} is expected", look_.text, wanted));
  }

  /// `effect`: how many values more or fewer are on the stack afterwards.
  std::size_t emit(Op op, int effect, std::uint32_t arg = 0) {
    depth_ += effect;
    script_.stack_max = std::max(script_.stack_max, static_cast<std::uint32_t>(std::max(depth_, 0)));
    script_.code.push_back({op, arg});
    return script_.code.size() - 1;
  }
  [[nodiscard]] std::uint32_t here() const { return static_cast<std::uint32_t>(script_.code.size()); }

  std::uint32_t name_index(std::string_view name) {
    for (std::size_t i = 0; i < script_.names.size(); ++i) {
      if (script_.names[i].name == name) return static_cast<std::uint32_t>(i);
    }
    script_.names.push_back({std::string(name)});
    return static_cast<std::uint32_t>(script_.names.size() - 1);
  }

  [[nodiscard]] bool enter() {
    if (++nesting_ > kScriptNestingMax && ok_) {
      error(fmt::format("nested deeper than {} levels", kScriptNestingMax));
      too_deep_ = true;
    }
    return ok_;
  }

  // assignment := NAME op assignment | conditional
  void statement() {
    if (!enter()) return;
    if (look_.token == Token::kName) {
      const Lexeme name = look_;
      const Lexer before = lexer_;
      advance();
      for (const auto& [text, op] : kAssignments) {
        if (!is(text)) continue;
        advance();
        if (name.text == "true" || name.text == "false") {
          error(fmt::format("\"{}\" cannot be assigned", name.text));
          return;
        }
        const std::uint32_t index = name_index(name.text);
        statement();
        NameUse& use = script_.names[index];
        // The right side is evaluated first: what it reads must exist before.
        (op == Op::kCreate ? use.created : use.assigned) = true;
        emit(op, 0, index);
        --nesting_;
        return;
      }
      lexer_ = before;
      look_ = name;
    }
    conditional();
    --nesting_;
  }

  void conditional() {
    infix(kLevelOr);
    if (!ok_ || !is("?")) return;
    advance();
    const std::size_t to_else = emit(Op::kJumpIfFalse, -1);
    statement();
    if (ok_ && !is(":")) return unexpected("\":\"");
    if (!ok_) return;
    advance();
    const std::size_t to_end = emit(Op::kJump, -1);
    script_.code[to_else].arg = here();
    statement();
    script_.code[to_end].arg = here();
  }

  [[nodiscard]] const Infix* infix_here(int level) const {
    if (look_.token != Token::kOperator) return nullptr;
    for (const Infix& entry : kInfix) {
      if (entry.text == look_.text && entry.level == level) return &entry;
    }
    return nullptr;
  }

  void infix(int level) {
    if (level == kLevelPrefix) return prefix();
    infix(level + 1);
    std::vector<std::size_t> chain;
    while (ok_) {
      const Infix* entry = infix_here(level);
      if (entry == nullptr) break;
      advance();
      infix(level + 1);
      // A comparison that another one follows jumps to the end when it is false.
      if (level == kLevelCompare && infix_here(level) != nullptr) {
        chain.push_back(emit(entry->op, -1));
      } else {
        emit(entry->op, -1);
      }
    }
    for (const std::size_t at : chain) script_.code[at].arg = here();
  }

  void prefix() {
    if (!enter()) return;
    if (is("-") || is("~") || is("!")) {
      const Op op = is("-") ? Op::kNegate : is("~") ? Op::kBitNot : Op::kNot;
      advance();
      prefix();
      emit(op, 0);
    } else {
      primary();
    }
    --nesting_;
  }

  void primary() {
    const Lexeme here = look_;
    switch (here.token) {
      case Token::kInteger: {
        const auto value = integer(here.text);
        if (!value) {
          warn("bt.script-integer", fmt::format("\"{}\" does not fit into 64 bits and counts as 0", here.text));
        }
        advance();
        script_.integers.push_back(value.value_or(0));
        emit(Op::kInteger, 1, static_cast<std::uint32_t>(script_.integers.size() - 1));
        return;
      }
      case Token::kNumber: {
        advance();
        double value = 0;
        std::from_chars(here.text.data(), here.text.data() + here.text.size(), value);
        number(value);
        return;
      }
      case Token::kString:
        advance();
        script_.strings.emplace_back(here.text);
        emit(Op::kString, 1, static_cast<std::uint32_t>(script_.strings.size() - 1));
        return;
      case Token::kName: {
        advance();
        if (here.text == "true") return number(1.0);
        if (here.text == "false") return number(0.0);
        if (enums_) {
          if (const auto value = enums_(here.text)) return number(static_cast<double>(*value));
        }
        if (here.text == "@") return error("\"@\" needs a name behind it");
        const std::uint32_t index = name_index(here.text);
        script_.names[index].read = true;
        emit(Op::kLoad, 1, index);
        return;
      }
      case Token::kOperator:
        if (is("(")) {
          advance();
          statement();
          if (ok_ && !is(")")) return unexpected("\")\"");
          advance();
          return;
        }
        break;
      default: break;
    }
    unexpected("a value");
  }

  void number(double value) {
    script_.numbers.push_back(value);
    emit(Op::kNumber, 1, static_cast<std::uint32_t>(script_.numbers.size() - 1));
  }

  /// Nothing beyond int64; it is 0 then, as in BehaviorTree.CPP.
  static std::optional<std::int64_t> integer(std::string_view text) {
    std::int64_t value = 0;
    const bool hex = text.starts_with("0x") || text.starts_with("0X");
    if (hex) text.remove_prefix(2);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }

  Lexer lexer_;
  const EnumLookup& enums_;
  Lexeme look_;
  Script script_;
  int depth_ = 0;
  int nesting_ = 0;
  bool ok_ = true;
  bool too_deep_ = false;
  std::string message_;
  std::size_t offset_ = 0;  ///< Of what is wrong.
};

}  // namespace

Result<Script> compile_script(std::string_view text, const EnumLookup& enums) {
  auto script = Compiler(text, enums).compile();
  if (script) script->steps = number_steps(*script);
  return script;
}

}  // namespace sentree::bt
