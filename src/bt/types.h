#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/bt/status.h"

namespace sentree::bt {

/// How a C++ type travels through ports. Specialise it for types of your own:
///
///     template <> struct sentree::bt::Convert<Pose> {
///       static std::string name() { return "Pose"; }
///       static Value to_value(const Pose&);
///       static std::optional<Pose> from_value(const Value&);
///       static std::optional<Pose> from_text(std::string_view);  // optional: literals in the XML
///     };
///
/// A type without a specialisation passes as an opaque C++ object: it works, but a state that holds one cannot be
/// saved.
template <class T>
struct Convert;

template <class T>
concept Convertible = requires(const T& t, const Value& v) {
  { Convert<T>::name() } -> std::convertible_to<std::string>;
  { Convert<T>::to_value(t) } -> std::convertible_to<Value>;
  { Convert<T>::from_value(v) } -> std::convertible_to<std::optional<T>>;
};

template <class T>
concept TextConvertible = Convertible<T> && requires(std::string_view s) {
  { Convert<T>::from_text(s) } -> std::convertible_to<std::optional<T>>;
};

/// The type of a port or of an entry. Compared by name.
struct PortType {
  enum class Class : std::uint8_t { kAny, kBool, kInteger, kReal, kString, kStatus, kOther, kObject };
  std::string name;  ///< As the TreeNodesModel writes it: "double", "std::string".
  Class kind = Class::kAny;
  std::int64_t min = std::numeric_limits<std::int64_t>::min();  ///< kInteger.
  std::int64_t max = std::numeric_limits<std::int64_t>::max();
  /// Literal text to value; null: text cannot give this type.
  std::optional<Value> (*parse)(std::string_view text) = nullptr;
  /// True if the value is one of this type; null: no check.
  bool (*accepts)(const Value& value) = nullptr;

  [[nodiscard]] bool strong() const { return kind != Class::kAny; }
  friend bool operator==(const PortType& a, const PortType& b) { return &a == &b || a.name == b.name; }
};

/// Marks a port that takes any type (BehaviorTree.CPP's BT::Any, AnyTypeAllowed).
struct AnyType {};

namespace detail {
template <class T>
[[nodiscard]] std::optional<Value> parse_as(std::string_view text) {
  std::optional<T> parsed = Convert<T>::from_text(text);
  if (!parsed) return std::nullopt;
  return Convert<T>::to_value(*parsed);
}
template <class T>
[[nodiscard]] bool accepts_as(const Value& value) {
  return Convert<T>::from_value(value).has_value();
}
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view text);
[[nodiscard]] std::optional<double> parse_real(std::string_view text);
[[nodiscard]] std::optional<bool> parse_bool(std::string_view text);
[[nodiscard]] std::string_view integer_name(bool is_signed, std::size_t bytes);
/// std::in_range of any integral type; that has none for characters.
template <std::integral T>
[[nodiscard]] constexpr bool holds(std::int64_t value) {
  if constexpr (std::is_unsigned_v<T>) {
    return value >= 0 && static_cast<std::uint64_t>(value) <= std::uint64_t{std::numeric_limits<T>::max()};
  } else {
    return value >= std::int64_t{+std::numeric_limits<T>::min()} &&
           value <= std::int64_t{+std::numeric_limits<T>::max()};
  }
}
/// The greatest value of the type, but for what is beyond int64.
template <std::integral T>
[[nodiscard]] constexpr std::int64_t greatest() {
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
  constexpr std::int64_t kHeldMax = std::numeric_limits<std::int64_t>::max();
  return kMax > std::uint64_t{kHeldMax} ? kHeldMax : static_cast<std::int64_t>(kMax);
}
/// Pieces of "a;b;c".
[[nodiscard]] std::vector<std::string_view> split_list(std::string_view text);
/// An integer, a bool, or a double without fraction, within int64.
[[nodiscard]] std::optional<std::int64_t> to_integer(const Value& value);
/// An int, a bool or a double.
[[nodiscard]] std::optional<double> to_real(const Value& value);
/// Numbers as BehaviorTree.CPP prints them: doubles like printf's %f.
[[nodiscard]] std::optional<std::string> to_text(const Value& value);
/// The Demangled name of a C++ type, for opaque objects.
[[nodiscard]] std::string type_name(const char* mangled);
}  // namespace detail

template <>
struct Convert<bool> {
  static std::string name() { return "bool"; }
  static Value to_value(bool v) { return v; }
  static std::optional<bool> from_value(const Value& v) {
    if (const bool* b = v.as_bool()) return *b;
    const auto number = detail::to_real(v);
    if (!number) return std::nullopt;
    return *number != 0.0;
  }
  static std::optional<bool> from_text(std::string_view text) { return detail::parse_bool(text); }
};

/// Values hold whole numbers as int64. A char is a small number, not a letter.
template <std::integral T>
struct Convert<T> {
  static std::string name() { return std::string(detail::integer_name(std::is_signed_v<T>, sizeof(T))); }
  static Value to_value(T v) {
    // Beyond int64, the nearest double: no integer port takes that for another number.
    if constexpr (std::is_unsigned_v<T> && sizeof(T) >= sizeof(std::int64_t)) {
      if (v > static_cast<T>(std::numeric_limits<std::int64_t>::max())) return static_cast<double>(v);
    }
    return static_cast<std::int64_t>(v);
  }
  static std::optional<T> from_value(const Value& v) {
    const auto i = detail::to_integer(v);
    if (!i || !detail::holds<T>(*i)) return std::nullopt;
    return static_cast<T>(*i);
  }
  static std::optional<T> from_text(std::string_view text) {
    const auto i = detail::parse_integer(text);
    if (!i || !detail::holds<T>(*i)) return std::nullopt;
    return static_cast<T>(*i);
  }
};

template <std::floating_point T>
struct Convert<T> {
  static std::string name() { return sizeof(T) == sizeof(double) ? "double" : "float"; }
  static Value to_value(T v) { return static_cast<double>(v); }
  static std::optional<T> from_value(const Value& v) {
    if (const double* d = v.as_double()) return static_cast<T>(*d);
    const auto number = detail::to_real(v);
    if (!number) return std::nullopt;
    return static_cast<T>(*number);
  }
  static std::optional<T> from_text(std::string_view text) {
    const auto number = detail::parse_real(text);
    if (!number) return std::nullopt;
    return static_cast<T>(*number);
  }
};

template <>
struct Convert<std::string> {
  static std::string name() { return "std::string"; }
  static Value to_value(const std::string& v) { return v; }
  static std::optional<std::string> from_value(const Value& v) { return detail::to_text(v); }
  static std::optional<std::string> from_text(std::string_view text) { return std::string(text); }
};

template <>
struct Convert<Status> {
  static std::string name() { return "BT::NodeStatus"; }
  static Value to_value(Status v) { return to_string(v); }
  static std::optional<Status> from_value(const Value& v) { return parse_status(v.text()); }
  static std::optional<Status> from_text(std::string_view text) { return parse_status(text); }
};

template <>
struct Convert<Value> {
  static std::string name() { return "sentree::Value"; }
  static Value to_value(const Value& v) { return v; }
  static std::optional<Value> from_value(const Value& v) { return v; }
};

/// An enum of the user's: its number. Names in the XML and in scripts come from `Registry::enum_value`. A
/// specialisation of one's own goes first.
template <class T>
requires std::is_enum_v<T>
struct Convert<T> {
  using Number = std::underlying_type_t<T>;
  static constexpr bool kIsNumber = true;
  static std::string name() { return detail::type_name(typeid(T).name()); }
  static Value to_value(T v) { return static_cast<std::int64_t>(v); }
  static std::optional<T> from_value(const Value& v) { return from_number(detail::to_integer(v)); }
  static std::optional<T> from_text(std::string_view text) { return from_number(detail::parse_integer(text)); }

 private:
  static std::optional<T> from_number(std::optional<std::int64_t> i) {
    if (!i || !detail::holds<Number>(*i)) return std::nullopt;
    return static_cast<T>(static_cast<Number>(*i));
  }
};

template <Convertible T>
struct Convert<std::vector<T>> {
  static std::string name() { return "std::vector<" + Convert<T>::name() + ">"; }
  static Value to_value(const std::vector<T>& v) {
    List list;
    list.reserve(v.size());
    for (const T& item : v) list.push_back(Convert<T>::to_value(item));
    return list;
  }
  static std::optional<std::vector<T>> from_value(const Value& v) {
    const List* list = v.as_list();
    if (list == nullptr) return std::nullopt;
    std::vector<T> out;
    for (const Value& item : *list) {
      auto converted = Convert<T>::from_value(item);
      if (!converted) return std::nullopt;
      out.push_back(std::move(*converted));
    }
    return out;
  }
  static std::optional<std::vector<T>> from_text(std::string_view text) requires TextConvertible<T> {
    std::vector<T> out;
    for (const std::string_view piece : detail::split_list(text)) {
      auto converted = Convert<T>::from_text(piece);
      if (!converted) return std::nullopt;
      out.push_back(std::move(*converted));
    }
    return out;
  }
};

namespace detail {
template <class T>
[[nodiscard, gnu::noinline]] PortType make_type() {
  PortType t;
  if constexpr (std::is_same_v<T, AnyType> || std::is_same_v<T, Value>) {
    t.kind = PortType::Class::kAny;
  } else if constexpr (!Convertible<T>) {
    t.name = detail::type_name(typeid(T).name());
    t.kind = PortType::Class::kObject;
  } else {
    t.name = Convert<T>::name();
    t.kind = PortType::Class::kOther;
    t.accepts = &detail::accepts_as<T>;
    if constexpr (TextConvertible<T>) t.parse = &detail::parse_as<T>;
    if constexpr (std::is_same_v<T, bool>) {
      t.kind = PortType::Class::kBool;
    } else if constexpr (std::is_integral_v<T>) {
      t.kind = PortType::Class::kInteger;
      t.min = static_cast<std::int64_t>(+std::numeric_limits<T>::min());
      t.max = detail::greatest<T>();
    } else if constexpr (std::is_floating_point_v<T>) {
      t.kind = PortType::Class::kReal;
    } else if constexpr (std::is_same_v<T, std::string>) {
      t.kind = PortType::Class::kString;
    } else if constexpr (std::is_same_v<T, Status>) {
      t.kind = PortType::Class::kStatus;
    } else if constexpr (requires { Convert<T>::kIsNumber; }) {
      t.kind = PortType::Class::kInteger;
      t.min = static_cast<std::int64_t>(std::numeric_limits<std::underlying_type_t<T>>::min());
      t.max = detail::greatest<std::underlying_type_t<T>>();
    }
  }
  return t;
}
}  // namespace detail

/// The one PortType of a C++ type.
template <class T>
[[nodiscard, gnu::always_inline]] inline const PortType& type_of() {
  static const PortType type = detail::make_type<T>();
  return type;
}

/// The type that a TreeNodesModel means by that name ("int", "double", "std::string", "string", "bool", "NodeStatus",
/// "std::vector<double>" …); null if it is none of ours.
[[nodiscard]] const PortType* type_named(std::string_view name);

/// The name of a port as a node asks for it. From a literal, the compiler makes the key.
struct PortName {
  std::string_view text;
  std::uint64_t key;  ///< Length and the first seven bytes: names of up to seven are equal if their keys are.

  constexpr PortName(std::string_view name) : text(name), key(key_of(name)) {}
  constexpr PortName(const char* name) : PortName(std::string_view(name)) {}
  PortName(const std::string& name) : PortName(std::string_view(name)) {}

  /// No other name has its key.
  [[nodiscard]] constexpr bool is_short() const { return text.size() <= 7; }

  static constexpr std::uint64_t key_of(std::string_view name) {
    std::uint64_t key = name.size() << 56U;
    for (std::size_t i = 0; i < 7 && i < name.size(); ++i) {
      key |= std::uint64_t{static_cast<unsigned char>(name[i])} << (8 * i);
    }
    return key;
  }
};

enum class PortDirection : std::uint8_t { kInput, kOutput, kInOut };

/// "input_port", "output_port", "inout_port": as the TreeNodesModel writes them.
[[nodiscard]] std::string_view to_string(PortDirection direction);

/// What a node says about one of its ports.
struct PortInfo {
  std::string name;
  PortDirection direction = PortDirection::kInput;
  const PortType* type = nullptr;           ///< Null: any.
  std::optional<std::string> default_text;  ///< Literal, or "{entry}".
  std::string description;
  std::string declared_type;  ///< The text of the TreeNodesModel where it is none of our types.
};

using Ports = std::vector<PortInfo>;

template <class T = AnyType>
[[nodiscard]] PortInfo input(std::string name, std::string description = {}) {
  return {std::move(name), PortDirection::kInput, &type_of<T>(), std::nullopt, std::move(description), {}};
}
/// With a default, written as in the XML: "5", "{entry}".
template <class T = AnyType>
[[nodiscard]] PortInfo input_default(std::string name, std::string default_text, std::string description = {}) {
  return {std::move(name), PortDirection::kInput, &type_of<T>(), std::move(default_text), std::move(description), {}};
}
template <class T = AnyType>
[[nodiscard]] PortInfo output(std::string name, std::string description = {}) {
  return {std::move(name), PortDirection::kOutput, &type_of<T>(), std::nullopt, std::move(description), {}};
}
template <class T = AnyType>
[[nodiscard]] PortInfo inout(std::string name, std::string description = {}) {
  return {std::move(name), PortDirection::kInOut, &type_of<T>(), std::nullopt, std::move(description), {}};
}

}  // namespace sentree::bt
