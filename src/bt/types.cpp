#include "sentree/bt/types.h"

#include <cxxabi.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace sentree::bt {

namespace detail {

namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t' || text.front() == '\n')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\n')) text.remove_suffix(1);
  return text;
}

}  // namespace

std::optional<std::int64_t> parse_integer(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_real(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<bool> parse_bool(std::string_view text) {
  text = trimmed(text);
  if (text == "1" || text == "true" || text == "TRUE" || text == "True") return true;
  if (text == "0" || text == "false" || text == "FALSE" || text == "False") return false;
  return std::nullopt;
}

std::string_view integer_name(bool is_signed, std::size_t bytes) {
  switch (bytes) {
    case 1: return is_signed ? "int8_t" : "uint8_t";
    case 2: return is_signed ? "int16_t" : "uint16_t";
    case 4: return is_signed ? "int" : "unsigned int";
    default: return is_signed ? "int64_t" : "uint64_t";
  }
}

std::vector<std::string_view> split_list(std::string_view text) {
  std::vector<std::string_view> pieces;
  if (text.empty()) return pieces;
  for (;;) {
    const std::size_t end = text.find(';');
    pieces.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return pieces;
    text.remove_prefix(end + 1);
  }
}

std::optional<std::int64_t> to_integer(const Value& value) {
  if (const auto* i = value.as_int()) return *i;
  if (const auto* b = value.as_bool()) return *b ? 1 : 0;
  const auto* d = value.as_double();
  // 2^63 is the first double beyond int64.
  if (d == nullptr || !(*d >= -0x1p63 && *d < 0x1p63) || std::floor(*d) != *d) return std::nullopt;
  return static_cast<std::int64_t>(*d);
}

std::optional<double> to_real(const Value& value) {
  if (const auto* d = value.as_double()) return *d;
  if (const auto* i = value.as_int()) return static_cast<double>(*i);
  if (const auto* b = value.as_bool()) return *b ? 1.0 : 0.0;
  return std::nullopt;
}

std::optional<std::string> to_text(const Value& value) {
  if (const auto* s = value.as_string()) return *s;
  if (const auto* i = value.as_int()) return std::to_string(*i);
  if (const auto* b = value.as_bool()) return std::string(*b ? "1" : "0");
  if (const auto* d = value.as_double()) {
    std::array<char, 400> buffer{};  // The longest %f of a double has 317 characters.
    const int length = std::snprintf(buffer.data(), buffer.size(), "%f", *d);
    return std::string(buffer.data(), static_cast<std::size_t>(length));
  }
  return std::nullopt;
}

std::string type_name(const char* mangled) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> text(abi::__cxa_demangle(mangled, nullptr, nullptr, &status), std::free);
  return status == 0 ? std::string(text.get()) : std::string(mangled);
}

}  // namespace detail

const PortType* type_named(std::string_view name) {
  static const std::vector<std::pair<std::string_view, const PortType*>> kNames = {
      {"", &type_of<AnyType>()},
      {"BT::Any", &type_of<AnyType>()},
      {"BT::AnyTypeAllowed", &type_of<AnyType>()},
      {"any", &type_of<AnyType>()},
      {"bool", &type_of<bool>()},
      {"boolean", &type_of<bool>()},
      {"char", &type_of<std::int8_t>()},
      {"int8", &type_of<std::int8_t>()},
      {"int8_t", &type_of<std::int8_t>()},
      {"int16", &type_of<std::int16_t>()},
      {"int16_t", &type_of<std::int16_t>()},
      {"short", &type_of<std::int16_t>()},
      {"int", &type_of<std::int32_t>()},
      {"int32", &type_of<std::int32_t>()},
      {"int32_t", &type_of<std::int32_t>()},
      {"int64", &type_of<std::int64_t>()},
      {"int64_t", &type_of<std::int64_t>()},
      {"long", &type_of<std::int64_t>()},
      {"uint8_t", &type_of<std::uint8_t>()},
      {"uint16_t", &type_of<std::uint16_t>()},
      {"unsigned int", &type_of<std::uint32_t>()},
      {"unsigned", &type_of<std::uint32_t>()},
      {"uint32_t", &type_of<std::uint32_t>()},
      {"uint64_t", &type_of<std::uint64_t>()},
      {"float", &type_of<float>()},
      {"double", &type_of<double>()},
      {"real", &type_of<double>()},
      {"string", &type_of<std::string>()},
      {"std::string", &type_of<std::string>()},
      {"NodeStatus", &type_of<Status>()},
      {"BT::NodeStatus", &type_of<Status>()},
      {"std::vector<int>", &type_of<std::vector<std::int32_t>>()},
      {"std::vector<double>", &type_of<std::vector<double>>()},
      {"std::vector<std::string>", &type_of<std::vector<std::string>>()},
  };
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return nullptr;
}

std::string_view to_string(PortDirection direction) {
  switch (direction) {
    case PortDirection::kInput: return "input_port";
    case PortDirection::kOutput: return "output_port";
    case PortDirection::kInOut: return "inout_port";
  }
  return "input_port";
}

}  // namespace sentree::bt
