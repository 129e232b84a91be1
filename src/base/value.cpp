#include "sentree/base/value.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "sentree/base/json.h"

namespace sentree {

Map::Map() = default;
Map::Map(std::initializer_list<Entry> entries) {
  for (const Entry& entry : entries) (*this)[entry.first] = entry.second;
}
Map::Map(const Map&) = default;
Map::Map(Map&&) noexcept = default;
Map& Map::operator=(const Map&) = default;
Map& Map::operator=(Map&&) noexcept = default;
Map::~Map() = default;

bool Map::empty() const { return entries_.empty(); }
std::size_t Map::size() const { return entries_.size(); }
void Map::append(std::string key, Value value) { entries_.emplace_back(std::move(key), std::move(value)); }
void Map::reserve(std::size_t entries) { entries_.reserve(entries); }

const Value* Map::find(std::string_view key) const {
  for (const Entry& entry : entries_) {
    if (entry.first == key) return &entry.second;
  }
  return nullptr;
}

Value* Map::find(std::string_view key) {
  for (Entry& entry : entries_) {
    if (entry.first == key) return &entry.second;
  }
  return nullptr;
}

Value& Map::operator[](std::string_view key) {
  if (Value* found = find(key)) return *found;
  return entries_.emplace_back(std::string(key), Value()).second;
}

bool Map::erase(std::string_view key) {
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->first != key) continue;
    entries_.erase(entry);
    return true;
  }
  return false;
}

bool operator==(const Map& a, const Map& b) { return a.entries_ == b.entries_; }

double Value::number(double otherwise) const {
  if (const auto* i = as_int()) return static_cast<double>(*i);
  if (const auto* d = as_double()) return *d;
  return otherwise;
}

std::string_view Value::text() const {
  const std::string* s = as_string();
  return s ? std::string_view(*s) : std::string_view();
}

const Value* Value::find(std::string_view key) const {
  const Map* map = as_map();
  return map ? map->find(key) : nullptr;
}

const Value* Value::at(std::initializer_list<std::string_view> path) const {
  const Value* value = this;
  for (const std::string_view key : path) {
    value = value->find(key);
    if (value == nullptr) return nullptr;
  }
  return value;
}

bool operator==(const Value& a, const Value& b) {
  if (a.data_.index() != b.data_.index()) return false;
  if (const double* x = a.as_double())
    return std::bit_cast<std::uint64_t>(*x) == std::bit_cast<std::uint64_t>(*b.as_double());
  return a.data_ == b.data_;
}

std::uint64_t hash_combine(std::uint64_t seed, std::uint64_t value) {
  std::uint64_t x = (seed ^ 0xcbf29ce484222325ULL) + value + 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

std::uint64_t hash_bytes(std::string_view bytes) {
  std::uint64_t x = 0xcbf29ce484222325ULL;
  for (const char c : bytes) x = (x ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash_combine(x, bytes.size());
}

std::uint64_t Value::hash() const {
  std::uint64_t h = hash_combine(0, data_.index());
  switch (type()) {
    case Type::kNull: return h;
    case Type::kBool: return hash_combine(h, *as_bool() ? 1 : 0);
    case Type::kInt: return hash_combine(h, static_cast<std::uint64_t>(*as_int()));
    case Type::kDouble: return hash_combine(h, std::bit_cast<std::uint64_t>(*as_double()));
    case Type::kString: return hash_combine(h, hash_bytes(*as_string()));
    case Type::kBytes: {
      const auto& octets = as_bytes()->octets;
      return hash_combine(h, hash_bytes({reinterpret_cast<const char*>(octets.data()), octets.size()}));
    }
    case Type::kList:
      for (const Value& item : *as_list()) h = hash_combine(h, item.hash());
      return hash_combine(h, as_list()->size());
    case Type::kMap:
      for (const auto& [key, item] : *as_map()) h = hash_combine(hash_combine(h, hash_bytes(key)), item.hash());
      return hash_combine(h, as_map()->size());
  }
  return h;
}

std::string_view to_string(Value::Type type) {
  constexpr std::array<std::string_view, 8> kNames{"null", "bool", "int", "double", "string", "bytes", "list", "map"};
  return kNames[static_cast<std::size_t>(type)];
}

std::string shortest_decimal(double number) {
  if (std::isnan(number)) return "NaN";
  if (std::isinf(number)) return number > 0 ? "Infinity" : "-Infinity";
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr;
  std::string text(buffer.data(), end);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string plain_decimal(double number) {
  std::string text = shortest_decimal(number);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

namespace {

// Length of the valid UTF-8 sequence at the start of `text`, or 0. Rejects overlong forms and surrogates.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto follows = [&](std::size_t i) { return i < text.size() && (byte(i) & 0xC0) == 0x80; };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    if (!follows(1) || !follows(2)) return 0;
    if (first == 0xE0 && byte(1) < 0xA0) return 0;
    if (first == 0xED && byte(1) > 0x9F) return 0;
    return 3;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    if (!follows(1) || !follows(2) || !follows(3)) return 0;
    if (first == 0xF0 && byte(1) < 0x90) return 0;
    if (first == 0xF4 && byte(1) > 0x8F) return 0;
    return 4;
  }
  return 0;
}

template <class Number>
void append_number(std::string& out, Number number) {
  std::array<char, 32> buffer;
  out.append(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr);
}

// Whether text of at least eight characters stands for itself in a JSON string: looked at eight at a time, the last
// eight once more where they do not come out even. The high bit of an octet of `found` says that it does not.
bool is_plain(std::string_view text) {
  constexpr std::uint64_t kOnes = 0x0101010101010101ULL;
  constexpr std::uint64_t kHighBits = 0x8080808080808080ULL;
  const auto zero_octets = [](std::uint64_t v) { return (v - kOnes) & ~v; };
  std::uint64_t found = 0;
  for (std::size_t at = 0; at < text.size(); at += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, text.data() + std::min(at, text.size() - 8), 8);
    found |= eight | (eight - kOnes * 0x20) | zero_octets(eight ^ kOnes * '"') | zero_octets(eight ^ kOnes * '\\');
  }
  return (found & kHighBits) == 0;
}

}  // namespace

void append_json_string(std::string& out, std::string_view text) {
  std::array<char, 64> buffer;
  if (text.size() >= 8 && text.size() <= buffer.size() - 2 && is_plain(text)) {
    buffer[0] = '"';
    std::memcpy(buffer.data() + 1, text.data(), text.size());
    buffer[text.size() + 1] = '"';
    out.append(buffer.data(), text.size() + 2);
    return;
  }
  out += '"';
  while (!text.empty()) {
    // Most text needs no escape: it is copied in one piece.
    const auto special = std::find_if(text.begin(), text.end(), [](char c) {
      const auto byte = static_cast<unsigned char>(c);
      return byte < 0x20 || byte >= 0x80 || byte == '"' || byte == '\\';
    });
    out.append(text.begin(), special);
    text.remove_prefix(static_cast<std::size_t>(special - text.begin()));
    if (text.empty()) break;
    const auto c = static_cast<unsigned char>(text.front());
    const std::size_t length = utf8_length(text);
    if (length == 0) {
      out += "\xEF\xBF\xBD";
      text.remove_prefix(1);
      continue;
    }
    switch (c) {
      case '"': out += "\\\""; break;
      case '\\': out += "\\\\"; break;
      case '\n': out += "\\n"; break;
      case '\r': out += "\\r"; break;
      case '\t': out += "\\t"; break;
      default:
        if (c < 0x20) {
          constexpr std::string_view kHex = "0123456789abcdef";
          out += "\\u00";
          out += kHex[c >> 4];
          out += kHex[c & 15];
        } else {
          out += text.substr(0, length);
        }
    }
    text.remove_prefix(length);
  }
  out += '"';
}

void append_json(std::string& out, const Value& value) {
  switch (value.type()) {
    case Value::Type::kNull: out += "null"; return;
    case Value::Type::kBool: out += *value.as_bool() ? "true" : "false"; return;
    case Value::Type::kInt: append_number(out, *value.as_int()); return;
    case Value::Type::kDouble: {
      const double number = *value.as_double();
      if (!std::isfinite(number)) {
        append_json_string(out, shortest_decimal(number));
        return;
      }
      const std::size_t begin = out.size();
      append_number(out, number);
      if (std::string_view(out).substr(begin).find_first_of(".e") == std::string_view::npos) out += ".0";
      return;
    }
    case Value::Type::kString: append_json_string(out, *value.as_string()); return;
    case Value::Type::kBytes:
      out += "{\"$bytes\":\"";
      append_base64(out, value.as_bytes()->octets);
      out += "\"}";
      return;
    case Value::Type::kList: {
      char separator = '[';
      for (const Value& item : *value.as_list()) {
        out += separator;
        append_json(out, item);
        separator = ',';
      }
      out += separator == '[' ? "[]" : "]";
      return;
    }
    case Value::Type::kMap: {
      char separator = '{';
      for (const auto& [key, item] : *value.as_map()) {
        out += separator;
        append_json_string(out, key);
        out += ':';
        append_json(out, item);
        separator = ',';
      }
      out += separator == '{' ? "{}" : "}";
      return;
    }
  }
}

std::string to_json(const Value& value) {
  std::string out;
  append_json(out, value);
  return out;
}

}  // namespace sentree
