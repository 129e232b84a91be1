#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace sentree {

class Value;

/// Octets that are not text.
struct Bytes {
  std::vector<std::byte> octets;
  friend auto operator<=>(const Bytes&, const Bytes&) = default;
};

using List = std::vector<Value>;

/// String keys in the order of insertion, which is part of the value: two maps with the same
/// entries in another order are different (scripts can see the order). Look-up is linear; the maps
/// of messages have a handful of entries.
class Map {
 public:
  using Entry = std::pair<std::string, Value>;

  Map();
  Map(std::initializer_list<Entry> entries);
  Map(const Map&);
  Map(Map&&) noexcept;
  Map& operator=(const Map&);
  Map& operator=(Map&&) noexcept;
  ~Map();

  [[nodiscard]] bool empty() const;
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] const Value* find(std::string_view key) const;
  [[nodiscard]] Value* find(std::string_view key);
  /// The entry of that key, made null at the end if there is none.
  Value& operator[](std::string_view key);
  /// True if there was one.
  bool erase(std::string_view key);
  void reserve(std::size_t entries);
  /// Adds an entry at the end without looking for the key, which must not be there yet.
  void append(std::string key, Value value);

  [[nodiscard]] auto begin() const { return entries_.begin(); }
  [[nodiscard]] auto end() const { return entries_.end(); }
  [[nodiscard]] auto begin() { return entries_.begin(); }
  [[nodiscard]] auto end() { return entries_.end(); }

  friend bool operator==(const Map& a, const Map& b);

 private:
  std::vector<Entry> entries_;
};

/// The one data type that passes between layers: null, bool, int64, double, string, bytes, list, map.
///
/// Integers and doubles are different types (1 != 1.0), as Thrift and BehaviorTree.CPP have them;
/// `number()` reads either. Equality of doubles is of bits, so that NaN equals itself and a saved state compares
/// equal to the original; -0.0 differs from 0.0.
class Value {
 public:
  enum class Type { kNull, kBool, kInt, kDouble, kString, kBytes, kList, kMap };

  Value() = default;
  Value(std::nullptr_t) {}
  Value(bool v) : data_(v) {}
  Value(int v) : data_(static_cast<std::int64_t>(v)) {}
  Value(std::int64_t v) : data_(v) {}
  Value(double v) : data_(v) {}
  Value(const char* v) : data_(std::string(v)) {}
  Value(std::string_view v) : data_(std::string(v)) {}
  Value(std::string v) : data_(std::move(v)) {}
  Value(Bytes v) : data_(std::move(v)) {}
  Value(List v) : data_(std::move(v)) {}
  Value(Map v) : data_(std::move(v)) {}

  [[nodiscard]] Type type() const { return static_cast<Type>(data_.index()); }
  [[nodiscard]] bool is_null() const { return type() == Type::kNull; }

  /// The content if it is of that type, else null.
  [[nodiscard]] const bool* as_bool() const { return std::get_if<bool>(&data_); }
  [[nodiscard]] const std::int64_t* as_int() const { return std::get_if<std::int64_t>(&data_); }
  [[nodiscard]] const double* as_double() const { return std::get_if<double>(&data_); }
  [[nodiscard]] const std::string* as_string() const { return std::get_if<std::string>(&data_); }
  [[nodiscard]] const Bytes* as_bytes() const { return std::get_if<Bytes>(&data_); }
  [[nodiscard]] const List* as_list() const { return std::get_if<List>(&data_); }
  [[nodiscard]] const Map* as_map() const { return std::get_if<Map>(&data_); }
  [[nodiscard]] List* as_list() { return std::get_if<List>(&data_); }
  [[nodiscard]] Map* as_map() { return std::get_if<Map>(&data_); }

  [[nodiscard]] bool is_number() const { return type() == Type::kInt || type() == Type::kDouble; }
  /// An integer or a double as double; `otherwise` for any other type.
  [[nodiscard]] double number(double otherwise = 0.0) const;
  /// The string, or empty for any other type.
  [[nodiscard]] std::string_view text() const;
  /// The member of a map; null if this is no map or has no such member.
  [[nodiscard]] const Value* find(std::string_view key) const;
  /// Follows members: `at({"result", "percentage"})`. Null where the path ends early.
  [[nodiscard]] const Value* at(std::initializer_list<std::string_view> path) const;

  friend bool operator==(const Value& a, const Value& b);

  /// 64-bit hash over type and content; equal values hash alike, on every machine.
  [[nodiscard]] std::uint64_t hash() const;

 private:
  std::variant<std::monostate, bool, std::int64_t, double, std::string, Bytes, List, Map> data_;
};

[[nodiscard]] std::string_view to_string(Value::Type type);

/// Compact JSON: keys in map order, shortest doubles that read back the same (1.0 keeps its point), bytes as
/// {"$bytes": base64}, non-finite doubles as the strings "NaN", "Infinity", "-Infinity".
/// Deterministic: one value, one text.
[[nodiscard]] std::string to_json(const Value& value);

/// Appends `text` as a JSON string with quotes; invalid UTF-8 becomes U+FFFD.
void append_json_string(std::string& out, std::string_view text);

/// The shortest decimal that reads back as `number`, always with a point or an exponent.
[[nodiscard]] std::string shortest_decimal(double number);
/// The same for people: whole numbers without ".0".
[[nodiscard]] std::string plain_decimal(double number);

/// Mixes `value` into a running hash (Fowler-Noll-Vo offset, SplitMix64 finisher).
[[nodiscard]] std::uint64_t hash_combine(std::uint64_t seed, std::uint64_t value);
[[nodiscard]] std::uint64_t hash_bytes(std::string_view bytes);

}  // namespace sentree
