#include "sentree/import/detail/cpp_expression.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/import/detail/words.h"

namespace sentree::import {

namespace {

constexpr std::array<std::string_view, 3> kKept{"true", "false", "In"};
constexpr std::array<std::string_view, 4> kDroppedMembers{"c_str", "toStdString", "data", "value"};
constexpr std::array<std::string_view, 4> kTextTypes{"string", "QString", "QLatin1String", "QStringLiteral"};
constexpr std::array<std::string_view, 3> kMath{"min", "max", "abs"};

// "1.5f", "10u", "3L" without what ECMAScript does not know; hexadecimal digits are no suffix.
std::string number(std::string text) {
  if (text.starts_with("0x") || text.starts_with("0X")) return text;
  while (!text.empty() && std::string_view("fFuUlL").find(text.back()) != std::string_view::npos) text.pop_back();
  return text.ends_with('.') ? text + "0" : text;
}

class ExpressionTranslator {
 public:
  ExpressionTranslator(Tokens tokens, const Names& names) : tokens_(tokens), names_(names) {}

  Result<Expression> run() {
    if (tokens_.empty()) return cannot("there is no expression");
    for (at_ = 0; at_ < tokens_.size();) {
      if (const auto done = one(); !done) return tl::unexpected(done.error());
    }
    return Expression{std::move(out_), divides_ && !has_fraction_ && has_integer_};
  }

 private:
  Result<void> one() {
    const Token& token = tokens_[at_];
    if (token.kind == TokenKind::kComment) {
      ++at_;
      return {};
    }
    if (token.kind == TokenKind::kNumber) {
      has_fraction_ = has_fraction_ || token.text.find('.') != std::string::npos;
      has_integer_ = has_integer_ || token.text.find('.') == std::string::npos;
      return value(number(token.text));
    }
    if (token.kind == TokenKind::kText) return value(fmt::format("'{}'", text_of(token)));
    if (token.kind == TokenKind::kName) return name();
    return sign();
  }

  static std::string text_of(const Token& token) {
    std::string text;
    for (std::size_t i = 0; i < token.text.size(); ++i) {
      const char c = token.text[i];
      if (c == '\\' && token.text.substr(i, 2) == "\\\"") continue;
      text += c == '\'' && (i == 0 || token.text[i - 1] != '\\') ? "\\'" : std::string(1, c);
    }
    return text;
  }

  Result<void> value(const std::string& text) {
    separate();
    chain_ = out_.size();
    out_ += text;
    ++at_;
    return {};
  }

  // Two words, or a word and a number, need a blank between them.
  void separate() {
    if (!out_.empty() && (std::isalnum(static_cast<unsigned char>(out_.back())) != 0 || out_.back() == '_'))
      out_ += ' ';
  }

  [[nodiscard]] bool next_is(std::string_view text, std::size_t ahead = 1) const {
    return at_ + ahead < tokens_.size() && tokens_[at_ + ahead].is(text);
  }

  Result<void> name() {
    const std::string& first = tokens_[at_].text;
    if (at_ > 0 && (tokens_[at_ - 1].is(".") || tokens_[at_ - 1].is("->"))) return member();
    if (first.ends_with("_cast") && next_is("<")) return cast();
    // `a::b::c`: the last one counts, what is before it only says where it is from.
    std::size_t last = at_;
    while (last + 2 < tokens_.size() && tokens_[last + 1].is("::") && tokens_[last + 2].kind == TokenKind::kName)
      last += 2;
    const bool qualified = last != at_;
    at_ = last;
    const std::string& name = tokens_[at_].text;
    const bool called = next_is("(");
    if (called && contains(kTextTypes, name)) return value(qualified || name != "string" ? "" : "String");
    if (called && qualified && (name == "to_string" || name == "number")) return value("String");
    if (called && qualified && contains(kMath, name)) return value("Math." + name);
    if (!qualified && names_.remotes.contains(name))
      return cannot(
          fmt::format("the call through {} is a part of a larger expression; give its result a name first", name));
    if (names_.data.contains(name) && !called) {
      has_integer_ = has_integer_ || names_.integers.contains(name);
      has_fraction_ = has_fraction_ || !names_.integers.contains(name);
      return value(name);
    }
    if (names_.enumerators.contains(name)) return value(script_text(name));
    if (name == "nullptr") return value("null");
    if (contains(kKept, name)) return value(name);
    return cannot(
        fmt::format("\"{}\" is {}", name, called ? "a C++ function" : "not known: no <data> and no enumerator"));
  }

  Result<void> member() {
    const std::string& name = tokens_[at_].text;
    if (!next_is("(")) {
      out_ += "." + name;
      ++at_;
      return {};
    }
    if (!next_is(")", 2)) return cannot(fmt::format("\"{}\" is a C++ function", name));
    if (name == "size" || name == "length" || name == "count") {
      out_ += ".length";
    } else if (name == "empty" || name == "isEmpty") {
      out_.insert(chain_, "(");
      out_ += ".length === 0)";
    } else if (!contains(kDroppedMembers, name)) {
      return cannot(fmt::format("\"{}()\" is a C++ function", name));
    }
    at_ += 3;
    return {};
  }

  Result<void> cast() {
    std::size_t close = at_ + 1;
    std::string type;
    for (; close < tokens_.size() && !tokens_[close].is(">"); ++close) type += tokens_[close].text;
    if (close + 1 >= tokens_.size() || !tokens_[close + 1].is("(")) return cannot("a cast without a value");
    const bool whole = type.find("int") != std::string::npos || type.find("long") != std::string::npos;
    at_ = close;
    return value(whole ? "~~" : "");
  }

  Result<void> sign() {
    const Token& token = tokens_[at_];
    if (token.is(".") || token.is("->")) {
      ++at_;
      return at_ < tokens_.size() && tokens_[at_].kind == TokenKind::kName ? Result<void>{}
                                                                           : cannot("a '.' at the end");
    }
    static constexpr std::array<std::string_view, 25> kSame{"(", ")", "[",  "]",  "+",  "-",  "*",  "/",  "%",
                                                            "<", ">", "<=", ">=", "==", "!=", "&&", "||", "!",
                                                            "?", ":", "~",  "|",  "^",  ",",  "&"};
    if (!contains(kSame, token.text))
      return cannot(fmt::format("'{}' has no counterpart in an expression", token.text));
    const bool operand_before = at_ > 0 && (tokens_[at_ - 1].kind != TokenKind::kPunctuation ||
                                            tokens_[at_ - 1].is(")") || tokens_[at_ - 1].is("]"));
    if ((token.is("*") || token.is("&")) && !operand_before) return cannot("a pointer");
    if (token.is("[") && !operand_before) return cannot("a lambda");
    divides_ = divides_ || token.is("/");
    const bool tight = token.is("(") || token.is(")") || token.is("[") || token.is("]") || token.is("!") ||
                       token.is("~") || ((token.is("-") || token.is("+")) && !operand_before);
    if (token.is("(") && !operand_before) chain_ = out_.size();
    if (token.is(",")) {
      out_ += ", ";
    } else {
      out_ += tight ? token.text : fmt::format(" {} ", token.text);
    }
    ++at_;
    return {};
  }

  Tokens tokens_;
  const Names& names_;
  std::string out_;
  std::size_t at_ = 0;
  std::size_t chain_ = 0;  // where in `out_` the operand begins whose members are being read
  bool divides_ = false;
  bool has_fraction_ = false;
  bool has_integer_ = false;
};

}  // namespace

std::string script_text(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + "'";
}

Result<Expression> translate_expression(Tokens tokens, const Names& names) {
  return ExpressionTranslator(tokens, names).run();
}

Result<Expression> translate_expression(std::string_view source, const Names& names) {
  const std::vector<Token> tokens = tokens_of(source);
  return translate_expression(Tokens(tokens), names);
}

Result<std::optional<RemoteCall>> translate_call(Tokens tokens, const Names& names) {
  const bool is_call = tokens.size() >= 5 && tokens[0].kind == TokenKind::kName &&
                       (tokens[1].is(".") || tokens[1].is("->")) && tokens[2].kind == TokenKind::kName &&
                       tokens[3].is("(") && closing(tokens, 3) == tokens.size() - 1;
  const auto remote = is_call ? names.remotes.find(tokens[0].text) : names.remotes.end();
  if (remote == names.remotes.end()) return std::nullopt;
  RemoteCall call{remote->first, remote->second.service, tokens[2].text, {}, true};
  if (!remote->second.schema)
    return cannot(fmt::format("no interface file defines the service that {} calls", call.variable));
  const idl::Method* const method = remote->second.schema->find(call.method);
  if (method == nullptr) {
    return cannot(fmt::format("service {} has no method \"{}\"{}", remote->second.schema->name, call.method,
                              did_you_mean(call.method, remote->second.schema->method_names())));
  }
  call.has_result = method->result->kind != idl::Kind::kVoid;
  const std::vector<Tokens> arguments = split(tokens.subspan(4, tokens.size() - 5), ",");
  if (arguments.size() != method->arguments.fields.size()) {
    return cannot(fmt::format("{}.{} takes {} arguments, not {}", call.variable, call.method,
                              method->arguments.fields.size(), arguments.size()));
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    auto expression = translate_expression(arguments[i], names);
    if (!expression) return tl::unexpected(expression.error());
    call.arguments.emplace_back(method->arguments.fields[i].name, std::move(expression->text));
  }
  return call;
}

}  // namespace sentree::import
