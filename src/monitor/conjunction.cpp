#include "sentree/monitor/detail/conjunction.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string_view>

namespace sentree::monitor {

namespace {

// Where nothing encloses what follows: neither a parenthesis nor a text.
template <class Each>
void outside(std::string_view text, Each&& each) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\') {
      ++i;
    } else if (c == '\'') {
      quoted = !quoted;
    } else if (!quoted) {
      depth += c == '(' ? 1 : c == ')' ? -1 : 0;
      if (depth == 0) each(i);
    }
  }
}

std::string_view without_parentheses(std::string_view text) {
  if (!text.starts_with('(')) return text;
  std::size_t closed = 0;
  outside(text, [&](std::size_t i) { closed = closed == 0 && i > 0 ? i : closed; });
  return closed + 1 == text.size() ? text.substr(1, text.size() - 2) : text;
}

// What a `!` negates, if all of the text is that.
std::optional<std::string_view> negated(std::string_view text) {
  if (!text.starts_with('!')) return std::nullopt;
  bool is_one = true;
  outside(text, [&](std::size_t at) { is_one = is_one && text[at] != ' '; });
  if (!is_one) return std::nullopt;
  return without_parentheses(text.substr(1));
}

// A value against a literal. False wherever the value is no number, where that is one, but for `!==`.
struct Comparison {
  std::string_view value;
  std::string_view operation;
  std::string_view literal;
  std::optional<double> number;
};

std::optional<Comparison> comparison(std::string_view text) {
  std::optional<Comparison> found;
  int operators = 0;
  outside(text, [&](std::size_t at) {
    constexpr std::array<std::string_view, 8> kOperators{" < ", " <= ", " > ", " >= ", " === ", " !== ", " || ", " ? "};
    for (const std::string_view operation : kOperators) {
      if (!text.substr(at).starts_with(operation)) continue;
      ++operators;
      found = {text.substr(0, at), operation.substr(1, operation.size() - 2), text.substr(at + operation.size()), {}};
    }
  });
  if (operators != 1 || found->operation == "||" || found->operation == "?") return std::nullopt;
  double number = 0.0;
  const char* const end = found->literal.data() + found->literal.size();
  const auto [read, error] = std::from_chars(found->literal.data(), end, number);
  if (error == std::errc() && read == end)
    found->number = number;
  else if (found->literal != "true" && found->literal != "false" &&
           (!found->literal.starts_with('\'') || found->literal.find('\'', 1) + 1 != found->literal.size()))
    return std::nullopt;
  return found;
}

bool holds(double x, const Comparison& c) {
  if (c.operation == "<") return x < *c.number;
  if (c.operation == "<=") return x <= *c.number;
  if (c.operation == ">") return x > *c.number;
  if (c.operation == ">=") return x >= *c.number;
  return (x == *c.number) == (c.operation == "===");
}

bool is_lower_bound(const Comparison& c) { return c.operation.starts_with('>'); }
bool is_upper_bound(const Comparison& c) { return c.operation.starts_with('<'); }

bool exclude(const Comparison& a, const Comparison& b) {
  if (a.value != b.value || a.number.has_value() != b.number.has_value()) return false;
  if (!a.number)
    return a.operation == "===" &&
           (b.operation == "===" ? a.literal != b.literal : b.operation == "!==" && a.literal == b.literal);
  if (a.operation == "===") return !holds(*a.number, b);
  if (b.operation == "===") return !holds(*b.number, a);
  if (is_lower_bound(a) && is_upper_bound(b))
    return *a.number > *b.number || (*a.number == *b.number && !(holds(*a.number, a) && holds(*a.number, b)));
  return is_upper_bound(a) && is_lower_bound(b) && exclude(b, a);
}

}  // namespace

std::vector<Js> conjuncts(const Js& js) {
  std::vector<Js> parts;
  std::size_t begin = 0;
  bool splits = true;
  const std::string_view text = js.text;
  std::vector<std::size_t> ends;
  outside(text, [&](std::size_t at) {
    if (text.substr(at).starts_with(" || ") || text.substr(at).starts_with(" ? ")) splits = false;
    if (text.substr(at).starts_with(" && ")) ends.push_back(at);
  });
  if (!splits) return {js};
  for (const std::size_t end : ends) {
    parts.push_back({std::string(text.substr(begin, end - begin)), js.binding});
    begin = end + 4;
  }
  parts.push_back({std::string(text.substr(begin)), js.binding});
  return parts;
}

bool excludes(const Js& known, const Js& other) {
  const std::string_view a = without_parentheses(known.text);
  const std::string_view b = without_parentheses(other.text);
  if (negated(a) == b || negated(b) == a) return true;
  const auto left = comparison(a);
  const auto right = comparison(b);
  return left && right && (exclude(*left, *right) || exclude(*right, *left));
}

bool implies(const Js& known, const Js& other) {
  const std::string_view text = without_parentheses(other.text);
  if (const auto inner = negated(text)) return excludes(known, {std::string(*inner), other.binding});
  const auto unequal = comparison(text);
  if (!unequal || unequal->operation != "!==") return false;
  return excludes(known, {std::string(unequal->value) + " === " + std::string(unequal->literal), other.binding});
}

bool are_among(const std::vector<Js>& parts, const std::vector<Js>& all) {
  return std::all_of(parts.begin(), parts.end(), [&](const Js& part) {
    return std::any_of(all.begin(), all.end(), [&](const Js& one) { return one.text == part.text; });
  });
}

bool rules_out(const Js& taken, const std::vector<Js>& refused, const std::vector<Js>& needed) {
  std::vector<Js> known = conjuncts(taken);
  for (const Js& part : needed) {
    if (std::any_of(known.begin(), known.end(), [&](const Js& one) { return excludes(one, part); })) return true;
  }
  known.insert(known.end(), needed.begin(), needed.end());
  return std::any_of(refused.begin(), refused.end(),
                     [&](const Js& condition) { return are_among(conjuncts(condition), known); });
}

Js without_repetition(const Js& js) {
  std::vector<Js> parts = conjuncts(js);
  // One after the other: two that say the same do not both go.
  for (auto part = parts.begin(); part != parts.end();) {
    const bool is_known = std::any_of(parts.begin(), parts.end(), [&](const Js& known) {
      return &known != &*part && (implies(known, *part) || (known.text == part->text && &known < &*part));
    });
    part = is_known ? parts.erase(part) : part + 1;
  }
  Js left = js_true();
  for (const Js& part : parts) left = js_and(left, part);
  return left;
}

bool is_false_of_undefined(const Js& js, std::string_view name) {
  const auto read = comparison(without_parentheses(js.text));
  return read && read->operation != "!==" && read->value == name;
}

}  // namespace sentree::monitor
