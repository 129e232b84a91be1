#include "sentree/scxml/expression.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "sentree/base/ascii.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {
namespace {

using Op = NativeCode::Op;
using Node = NativeCode::Node;

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$'; }
bool continues_name(char c) { return starts_name(c) || is_digit(c); }

struct Operator {
  std::string_view text;
  Op op;
  int precedence;
};

// Longer ones first, so that "<=" is not read as "<".
constexpr std::array<Operator, 15> kOperators{{{"===", Op::kStrictEqual, 4},
                                               {"!==", Op::kStrictNotEqual, 4},
                                               {"==", Op::kEqual, 4},
                                               {"!=", Op::kNotEqual, 4},
                                               {"<=", Op::kLessEqual, 5},
                                               {">=", Op::kGreaterEqual, 5},
                                               {"&&", Op::kAnd, 2},
                                               {"||", Op::kOr, 1},
                                               {"<", Op::kLess, 5},
                                               {">", Op::kGreater, 5},
                                               {"+", Op::kAdd, 6},
                                               {"-", Op::kSubtract, 6},
                                               {"*", Op::kMultiply, 7},
                                               {"/", Op::kDivide, 7},
                                               {"%", Op::kModulo, 7}}};

// Recursive descent by operator precedence. Whatever it does not know makes the expression "not native", never an
// error.
class Compiler {
 public:
  Compiler(std::string_view source, const SlotLookup& slots, const IsGlobal& is_global)
      : source_(source), slots_(slots), is_global_(is_global) {}

  NativeCode run() {
    conditional(0);
    skip_space();
    if (!ok_ || at_ != source_.size()) return {};
    return std::move(code_);
  }

 private:
  void skip_space() {
    while (at_ < source_.size() && is_space(source_[at_])) ++at_;
  }
  [[nodiscard]] char peek() {
    skip_space();
    return at_ < source_.size() ? source_[at_] : '\0';
  }
  bool accept(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  std::uint32_t give_up() {
    ok_ = false;
    return 0;
  }
  std::uint32_t add(Op op, std::uint32_t a = 0, std::uint32_t b = 0, std::uint32_t c = 0, double number = 0) {
    code_.nodes.push_back({op, a, b, c, number});
    return static_cast<std::uint32_t>(code_.nodes.size() - 1);
  }
  std::uint32_t intern(std::string text) {
    code_.strings.push_back(std::move(text));
    return static_cast<std::uint32_t>(code_.strings.size() - 1);
  }

  // The operator at the cursor, if it is one of ours and not part of another ("++", "=>", "**", "+=", "//", …).
  const Operator* binary_operator() {
    skip_space();
    const std::string_view rest = source_.substr(at_);
    for (const Operator& o : kOperators) {
      if (!rest.starts_with(o.text)) continue;
      const char next = rest.size() > o.text.size() ? rest[o.text.size()] : '\0';
      const bool one = o.text.size() == 1;
      if (next == '=' ||
          (one && (next == o.text[0] || (o.text == "/" && next == '*') || (o.text == "<" && next == '!')))) {
        ok_ = false;
        return nullptr;
      }
      return &o;
    }
    return nullptr;
  }

  std::uint32_t conditional(int depth) {
    const std::uint32_t condition = binary(1, depth);
    if (!ok_ || !accept('?')) return condition;
    const std::uint32_t yes = conditional(depth + 1);
    if (!ok_ || !accept(':')) return give_up();
    const std::uint32_t no = conditional(depth + 1);
    return ok_ ? add(Op::kConditional, condition, yes, no) : 0;
  }

  std::uint32_t binary(int precedence, int depth) {
    if (depth > kNativeNestingMax) return give_up();
    std::uint32_t left = unary(depth + 1);
    int height = 0;
    while (ok_) {
      const Operator* o = binary_operator();
      if (!ok_ || !o || o->precedence < precedence) break;
      // A chain of operators is as deep to evaluate as it is long.
      if (++height + depth > kNativeNestingMax) return give_up();
      at_ += o->text.size();
      const std::uint32_t right = binary(o->precedence + 1, depth + 1);
      if (ok_) left = add(o->op, left, right);
    }
    return left;
  }

  std::uint32_t unary(int depth) {
    if (depth > kNativeNestingMax) return give_up();
    const char c = peek();
    if (c == '!' || c == '-' || c == '+') {
      ++at_;
      if (c != '!' && at_ < source_.size() && source_[at_] == c) return give_up();
      const std::uint32_t operand = unary(depth + 1);
      return ok_ ? add(c == '!' ? Op::kNot : c == '-' ? Op::kNegate : Op::kPlus, operand) : 0;
    }
    if (source_.substr(at_).starts_with("typeof") && at_ + 6 < source_.size() && !continues_name(source_[at_ + 6])) {
      at_ += 6;
      const std::uint32_t operand = unary(depth + 1);
      return ok_ ? add(Op::kTypeof, operand) : 0;
    }
    return postfix(depth);
  }

  std::uint32_t postfix(int depth) {
    std::uint32_t object = primary(depth);
    int height = 0;
    while (ok_) {
      if (++height + depth > kNativeNestingMax) return give_up();
      if (accept('.')) {
        const std::string_view name = identifier();
        if (!ok_) return 0;
        object = add(Op::kMember, object, intern(std::string(name)));
      } else if (accept('[')) {
        const std::uint32_t index = conditional(depth + 1);
        if (!ok_ || !accept(']')) return give_up();
        object = add(Op::kIndex, object, index);
      } else if (peek() == '(') {
        return give_up();
      } else {
        return object;
      }
    }
    return 0;
  }

  std::string_view identifier() {
    skip_space();
    const std::size_t begin = at_;
    if (at_ == source_.size() || !starts_name(source_[at_])) {
      ok_ = false;
      return {};
    }
    while (at_ < source_.size() && continues_name(source_[at_])) ++at_;
    if (at_ < source_.size() && (source_[at_] == '\\' || static_cast<unsigned char>(source_[at_]) >= 0x80)) ok_ = false;
    return source_.substr(begin, at_ - begin);
  }

  std::uint32_t primary(int depth) {
    const char c = peek();
    if (accept('(')) {
      ++brackets_;
      const std::uint32_t inner = conditional(depth + 1);
      --brackets_;
      return ok_ && accept(')') ? inner : give_up();
    }
    // Elsewhere it may begin a block.
    if (brackets_ > 0 && accept('{')) return object_literal(depth);
    if (c == '"' || c == '\'') return string_literal(c);
    if (is_digit(c) || c == '.') return number_literal();
    if (accept('[')) return index_in_list(depth);
    const std::string_view name = identifier();
    if (!ok_) return 0;
    if (name == "true") return add(Op::kTrue);
    if (name == "false") return add(Op::kFalse);
    if (name == "null") return add(Op::kNull);
    if (is_reserved_word(name)) return give_up();
    if (slots_) {
      if (const auto slot = slots_(name)) return add(Op::kVariable, *slot);
    }
    if (name == "undefined") return add(Op::kUndefined);
    if (name == "_event") return event_field();
    if (name == "_sessionid") return add(Op::kSystem, static_cast<std::uint32_t>(SystemVariable::kSessionId));
    if (name == "_name") return add(Op::kSystem, static_cast<std::uint32_t>(SystemVariable::kName));
    if (name == "In" && accept('(')) {
      const char quote = peek();
      if (quote != '"' && quote != '\'') return give_up();
      const std::uint32_t text = string_literal(quote);
      if (!ok_ || !accept(')')) return give_up();
      return add(Op::kIn, code_.nodes[text].a);
    }
    if (!is_global_ || (name != "Math" && peek() != '(') || !is_global_(name)) return give_up();
    return name == "Math" ? of_math(depth) : call(name, depth);
  }

  // Up to the bracket that closes them.
  std::vector<std::uint32_t> arguments(int depth) {
    std::vector<std::uint32_t> all;
    if (!accept('(')) ok_ = false;
    while (ok_ && !accept(')')) {
      if (!all.empty() && !accept(',')) ok_ = false;
      ++brackets_;
      if (ok_) all.push_back(conditional(depth + 1));
      --brackets_;
    }
    return all;
  }

  std::uint32_t of_math(int depth) {
    constexpr std::array<std::string_view, 8> kNames{"abs", "ceil", "floor", "round", "sign", "sqrt", "min", "max"};
    if (!accept('.')) return give_up();
    const auto* const known = std::find(kNames.begin(), kNames.end(), identifier());
    if (!ok_ || known == kNames.end()) return give_up();
    const auto function = static_cast<std::uint32_t>(known - kNames.begin());
    const auto of = arguments(depth);
    const bool any_number = *known == "min" || *known == "max";
    if (!ok_ || of.empty() || (of.size() > 1 && !any_number)) return give_up();
    if (!any_number) return add(Op::kMath, function, of[0]);
    // Operators of two: as deep to evaluate as they are many.
    if (static_cast<int>(of.size()) + depth > kNativeNestingMax) return give_up();
    std::uint32_t all = add(Op::kPlus, of[0]);
    for (std::size_t i = 1; i < of.size(); ++i) all = add(Op::kMath, function, all, of[i]);
    return all;
  }

  std::uint32_t call(std::string_view name, int depth) {
    const auto of = arguments(depth);
    if (!ok_) return 0;
    const auto first = static_cast<std::uint32_t>(code_.arguments.size());
    code_.arguments.insert(code_.arguments.end(), of.begin(), of.end());
    return add(Op::kCall, intern(std::string(name)), first, static_cast<std::uint32_t>(of.size()));
  }

  // Members by names that are no numbers, each once: so they keep their order.
  std::uint32_t object_literal(int depth) {
    std::uint32_t object = add(Op::kObject);
    std::vector<std::uint32_t> names;
    while (!accept('}')) {
      const char c = peek();
      const bool quoted = c == '"' || c == '\'';
      const std::uint32_t name = quoted ? code_.nodes[string_literal(c)].a : intern(std::string(identifier()));
      const int height = depth + static_cast<int>(names.size());
      if (!ok_ || height >= kNativeNestingMax || !accept(':')) return give_up();
      const auto text = [&](std::uint32_t of) -> const std::string& { return code_.strings[of]; };
      // Dates, XML and the like are kept under names with $.
      const bool special =
          text(name).empty() || is_digit(text(name).front()) || text(name).front() == '$' || text(name) == "__proto__";
      for (const std::uint32_t before : names) {
        if (special || text(before) == text(name)) return give_up();
      }
      if (special) return give_up();
      names.push_back(name);
      const std::uint32_t value = conditional(height + 1);
      if (!ok_) return 0;
      object = add(Op::kWith, object, name, value);
      if (!accept(',') && peek() != '}') return give_up();
    }
    return object;
  }

  // ['a', 'b'].indexOf(x) is a chain of comparisons. Whatever else is done with a list is left to the interpreter.
  std::uint32_t index_in_list(int depth) {
    std::vector<std::uint32_t> items;
    do {
      const char c = peek();
      items.push_back(c == '"' || c == '\'' ? string_literal(c) : number_literal());
      if (!ok_ || depth + static_cast<int>(items.size()) >= kNativeNestingMax) return give_up();
    } while (accept(','));
    if (!accept(']') || !accept('.') || identifier() != "indexOf" || !accept('(')) return give_up();
    const std::size_t begin = code_.nodes.size();
    const std::uint32_t wanted = conditional(depth + static_cast<int>(items.size()));
    if (!ok_ || !accept(')')) return give_up();
    // It is evaluated for each item: what makes texts, or is a chain itself, had better be evaluated once.
    for (std::size_t i = begin; i < code_.nodes.size(); ++i) {
      const Op op = code_.nodes[i].op;
      if (op == Op::kAdd || op == Op::kConditional || op == Op::kCall) return give_up();
    }
    std::uint32_t found = add(Op::kNumber, 0, 0, 0, -1.0);
    for (std::size_t i = items.size(); i-- > 0;) {
      const std::uint32_t here = add(Op::kNumber, 0, 0, 0, static_cast<double>(i));
      found = add(Op::kConditional, add(Op::kStrictEqual, wanted, items[i]), here, found);
    }
    return found;
  }

  std::uint32_t event_field() {
    if (!accept('.')) return give_up();
    const std::string_view name = identifier();
    constexpr std::array<std::string_view, 7> kFields{"name",       "type",     "sendid", "origin",
                                                      "origintype", "invokeid", "data"};
    for (std::uint32_t i = 0; ok_ && i < kFields.size(); ++i) {
      if (name == kFields[i]) return add(Op::kEventField, i);
    }
    return give_up();
  }

  std::uint32_t string_literal(char quote) {
    std::string text;
    for (++at_; at_ < source_.size() && source_[at_] != quote; ++at_) {
      const char c = source_[at_];
      if (c == '\n' || c == '\r' || static_cast<unsigned char>(c) >= 0x80) return give_up();
      if (c != '\\') {
        text += c;
        continue;
      }
      const char escaped = ++at_ < source_.size() ? source_[at_] : '\0';
      constexpr std::string_view kFrom = "nt\\'\"";
      constexpr std::string_view kTo = "\n\t\\'\"";
      const std::size_t which = kFrom.find(escaped);
      if (escaped == '\0' || which == std::string_view::npos) return give_up();
      text += kTo[which];
    }
    if (at_ == source_.size()) return give_up();
    ++at_;
    return add(Op::kString, intern(std::move(text)));
  }

  std::uint32_t number_literal() {
    const std::size_t begin = at_;
    std::size_t end = at_;
    while (end < source_.size() && is_digit(source_[end])) ++end;
    if (end - begin > 1 && source_[begin] == '0') return give_up();  // octal, once upon a time
    if (end < source_.size() && source_[end] == '.') {
      ++end;
      while (end < source_.size() && is_digit(source_[end])) ++end;
    }
    if (end - begin == 1 && source_[begin] == '.') return give_up();
    if (end < source_.size() && (source_[end] == 'e' || source_[end] == 'E')) {
      ++end;
      if (end < source_.size() && (source_[end] == '+' || source_[end] == '-')) ++end;
      if (end == source_.size() || !is_digit(source_[end])) return give_up();
      while (end < source_.size() && is_digit(source_[end])) ++end;
    }
    if (end < source_.size() &&
        (continues_name(source_[end]) || source_[end] == '.' || static_cast<unsigned char>(source_[end]) >= 0x80)) {
      return give_up();
    }
    // The interpreter does not round longer ones as the standard has it.
    if (end - begin > kExactDigitsMax) return give_up();
    double number = 0;
    const auto result = std::from_chars(source_.data() + begin, source_.data() + end, number);
    if (result.ec != std::errc() || result.ptr != source_.data() + end) return give_up();
    at_ = end;
    return add(Op::kNumber, 0, 0, 0, number);
  }

  std::string_view source_;
  const SlotLookup& slots_;
  const IsGlobal& is_global_;
  std::size_t at_ = 0;
  int brackets_ = 0;  // that are open
  bool ok_ = true;
  NativeCode code_;
};

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

class NoScope final : public NativeScope {
 public:
  bool variable(std::uint32_t, ScriptValue&) override { return false; }
  const Event* event() override { return nullptr; }
  std::string_view system(SystemVariable) override { return {}; }
  bool in(std::string_view) override { return false; }
};

}  // namespace

NativeCode compile_native(std::string_view source, const SlotLookup& slots, const IsGlobal& is_global) {
  return Compiler(source, slots, is_global).run();
}

NativeCode compile_null(std::string_view source) {
  std::string_view text = trim(source);
  if (!text.starts_with("In")) return {};
  text = trim(text.substr(2));
  if (text.size() < 3 || text.front() != '(' || text.back() != ')') return {};
  text = trim(text.substr(1, text.size() - 2));
  if (text.size() > 2 && (text.front() == '\'' || text.front() == '"') && text.back() == text.front())
    text = text.substr(1, text.size() - 2);
  if (text.empty() || text.find_first_of("'\"() \t\r\n") != std::string_view::npos) return {};
  NativeCode code;
  code.strings.emplace_back(text);
  code.nodes.push_back({Op::kIn});
  return code;
}

std::optional<std::uint32_t> as_variable(std::string_view source, const SlotLookup& slots) {
  return slots(trim(source));
}

std::optional<Value> constant_value(std::string_view source) {
  static const SlotLookup kNone;
  const NativeCode code = compile_native(source, kNone);
  for (const Node& node : code.nodes) {
    if (node.op == Op::kVariable || node.op == Op::kEventField || node.op == Op::kSystem || node.op == Op::kIn)
      return std::nullopt;
  }
  NoScope scope;
  std::vector<std::string> text;
  ScriptValue value;
  if (code.empty() || !evaluate_native(code, scope, text, value)) return std::nullopt;
  if (value.kind == ScriptValue::Kind::kObject) return std::nullopt;
  return value.to_value();
}

}  // namespace sentree::scxml
