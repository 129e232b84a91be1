#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/base/value.h"

namespace sentree {

/// Appends numbers, text and values to a string so that what was appended can be told from the bytes (given which kinds
/// come when): for canonical forms of states, which are compared and hashed.
class Encoder {
 public:
  explicit Encoder(std::string& out) : out_(out) {}

  void byte(std::uint8_t v) { out_.push_back(static_cast<char>(v)); }
  /// Seven bits a byte, the lowest first.
  void number(std::uint64_t v) {
    for (; v >= 0x80; v >>= 7) byte(static_cast<std::uint8_t>(v | 0x80));
    byte(static_cast<std::uint8_t>(v));
  }
  /// Small numbers of either sign are short.
  void integer(std::int64_t v) { number(static_cast<std::uint64_t>(v) << 1 ^ static_cast<std::uint64_t>(v >> 63)); }
  void word(std::uint64_t v) {
    for (int i = 0; i < 8; ++i) byte(static_cast<std::uint8_t>(v >> (8 * i)));
  }
  void text(std::string_view v) {
    number(v.size());
    out_.append(v);
  }

  /// First bytes of values; from kSmallInt on, an integer itself. Others are free for the user.
  enum Tag : std::uint8_t { kNull, kFalse, kTrue, kInt, kDouble, kString, kBytes, kList, kMap, kFree, kSmallInt = 16 };

  /// `write_text(text)` writes each string and each key.
  template <class WriteText>
  void value(const Value& v, WriteText&& write_text) {
    switch (v.type()) {
      case Value::Type::kNull: return byte(kNull);
      case Value::Type::kBool: return byte(*v.as_bool() ? kTrue : kFalse);
      case Value::Type::kInt: {
        const std::int64_t i = *v.as_int();
        if (i >= 0 && i <= 0xFF - kSmallInt) return byte(static_cast<std::uint8_t>(kSmallInt + i));
        byte(kInt);
        return integer(i);
      }
      case Value::Type::kDouble: byte(kDouble); return word(std::bit_cast<std::uint64_t>(*v.as_double()));
      case Value::Type::kString: return write_text(std::string_view(*v.as_string()));
      case Value::Type::kBytes: {
        byte(kBytes);
        const auto& octets = v.as_bytes()->octets;
        return text({reinterpret_cast<const char*>(octets.data()), octets.size()});
      }
      case Value::Type::kList:
        byte(kList);
        number(v.as_list()->size());
        for (const Value& item : *v.as_list()) value(item, write_text);
        return;
      case Value::Type::kMap: byte(kMap); return map(*v.as_map(), write_text);
    }
  }
  template <class WriteText>
  void map(const Map& v, WriteText&& write_text) {
    number(v.size());
    for (const auto& [key, item] : v) {
      write_text(std::string_view(key));
      value(item, write_text);
    }
  }
  void value(const Value& v) {
    value(v, [this](std::string_view s) {
      byte(kString);
      text(s);
    });
  }

 private:
  std::string& out_;
};

}  // namespace sentree
