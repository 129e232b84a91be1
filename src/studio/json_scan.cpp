#include "sentree/studio/json_scan.h"

#include <charconv>

#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

std::size_t skip_space(std::string_view text, std::size_t at) {
  while (at < text.size() && is_space(text[at])) ++at;
  return at;
}

// One past the closing quote of the string that begins at `at`.
std::size_t skip_string(std::string_view text, std::size_t at) {
  for (++at; at < text.size(); ++at) {
    if (text[at] == '\\')
      ++at;
    else if (text[at] == '"')
      return at + 1;
  }
  return text.size();
}

// One past the value that begins at `at`.
std::size_t skip_value(std::string_view text, std::size_t at) {
  if (at >= text.size()) return at;
  if (text[at] == '"') return skip_string(text, at);
  if (text[at] != '{' && text[at] != '[') {
    while (at < text.size() && text[at] != ',' && text[at] != '}' && text[at] != ']' && !is_space(text[at])) ++at;
    return at;
  }
  std::size_t depth = 0;
  while (at < text.size()) {
    switch (text[at]) {
      case '"': at = skip_string(text, at); continue;
      case '{':
      case '[': ++depth; break;
      case '}':
      case ']':
        if (--depth == 0) return at + 1;
        break;
      default: break;
    }
    ++at;
  }
  return text.size();
}

}  // namespace

JsonWalk::JsonWalk(std::string_view container) : rest_(container) {
  const std::size_t at = skip_space(rest_, 0);
  const char first = at < rest_.size() ? rest_[at] : '\0';
  is_object_ = first == '{';
  rest_.remove_prefix(first == '{' || first == '[' ? at + 1 : rest_.size());
}

bool JsonWalk::next() {
  std::size_t at = skip_space(rest_, 0);
  if (!first_) {
    if (at >= rest_.size() || rest_[at] != ',') return false;
    at = skip_space(rest_, at + 1);
  }
  first_ = false;
  if (is_object_) {
    if (at >= rest_.size() || rest_[at] != '"') return false;
    const std::size_t end = skip_string(rest_, at);
    if (end < at + 2) return false;
    name_ = rest_.substr(at + 1, end - at - 2);
    at = skip_space(rest_, end);
    if (at >= rest_.size() || rest_[at] != ':') return false;
    at = skip_space(rest_, at + 1);
  }
  const std::size_t end = skip_value(rest_, at);
  if (end == at) return false;
  value_ = rest_.substr(at, end - at);
  rest_.remove_prefix(end);
  return true;
}

std::string_view member(std::string_view object, std::string_view name) {
  for (JsonWalk walk(object); walk.next();) {
    if (walk.name() == name) return walk.value();
  }
  return {};
}

std::string_view inside(std::string_view value) {
  return value.size() >= 2 && value.front() == '"' ? value.substr(1, value.size() - 2) : value;
}

std::string unquoted(std::string_view value) {
  const std::string_view text = inside(value);
  if (text.size() == value.size() || text.find('\\') == std::string_view::npos) return std::string(text);
  const auto parsed = text::parse_json(value);
  return parsed ? std::string(parsed->text()) : std::string(text);
}

std::optional<double> as_number(std::string_view value) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

std::optional<std::int64_t> as_integer(std::string_view value) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

}  // namespace sentree::studio
