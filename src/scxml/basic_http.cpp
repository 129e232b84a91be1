#include "sentree/scxml/detail/basic_http.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "sentree/scxml/expression.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/model.h"

namespace sentree::scxml {
namespace {

constexpr std::string_view kForm = "application/x-www-form-urlencoded";
constexpr std::string_view kEventName = "_scxmleventname";

// RFC 3986: everything but unreserved characters.
std::string encode(std::string_view text) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                       c == '.' || c == '_' || c == '~';
    if (plain) {
      result += c;
    } else {
      result += '%';
      result += kHex[byte >> 4U];
      result += kHex[byte & 15U];
    }
  }
  return result;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string decode(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0) {
      result += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      result += text[i] == '+' ? ' ' : text[i];
    }
  }
  return result;
}

std::string text_of(const Value& value) {
  if (value.as_string()) return *value.as_string();
  if (const std::string* xml = xml_text(value)) return *xml;
  return value.is_number() ? number_to_string(value.number()) : to_json(value);
}

}  // namespace

HttpPost to_http(const OutgoingSend& send) {
  HttpPost post{std::string(kForm), {}};
  const auto add = [&](std::string_view name, const std::string& value) {
    post.body += fmt::format("{}{}={}", post.body.empty() ? "" : "&", encode(name), encode(value));
  };
  if (!send.event.empty()) add(kEventName, send.event);
  if (!send.data) return post;
  if (send.is_content) {
    post.body = encode(text_of(*send.data));
    return post;
  }
  if (const Map* params = send.data->as_map()) {
    for (const auto& [name, value] : *params) add(name, text_of(value));
  }
  return post;
}

Event from_http(std::string_view method, std::string_view content_type, std::string_view body, std::string raw) {
  Event event;
  event.name = fmt::format("HTTP.{}", method);
  event.origintype = kBasicHttpProcessor;
  event.raw = std::move(raw);
  if (!content_type.starts_with(kForm)) {
    if (!body.empty()) event.data = value_of_text(body);
    return event;
  }
  if (body.find('=') == std::string_view::npos) {
    if (!body.empty()) event.data = Value(decode(body));
    return event;
  }
  Map data;
  while (!body.empty()) {
    const std::string_view pair = body.substr(0, body.find('&'));
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string name = decode(pair.substr(0, equals));
    std::string value = decode(equals < pair.size() ? pair.substr(equals + 1) : std::string_view());
    if (name == kEventName)
      event.name = std::move(value);
    else
      data[name] = std::move(value);
    body.remove_prefix(std::min(pair.size() + 1, body.size()));
  }
  if (!data.empty()) event.data = std::move(data);
  return event;
}

}  // namespace sentree::scxml
