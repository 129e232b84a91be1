#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "sentree/record/mcap.h"

namespace sentree::record::detail {

/// Little-endian octets.
template <class Integer>
std::array<char, sizeof(Integer)> octets_of(Integer value) {
  std::array<char, sizeof(Integer)> bytes;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(bytes.data(), &value, sizeof value);
  } else {
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      bytes[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 255);
  }
  return bytes;
}

template <class Integer>
void put(std::string& out, Integer value) {
  const auto bytes = octets_of(value);
  out.append(bytes.data(), bytes.size());
}

inline void put_string(std::string& out, std::string_view text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

/// Writes an opcode with room for the length; `end_record` fills it in.
inline std::size_t begin_record(std::string& out, Op op) {
  out += static_cast<char>(op);
  put(out, std::uint64_t{0});
  return out.size();
}

template <class Integer>
void patch(std::string& out, std::size_t at, Integer value) {
  const auto bytes = octets_of(value);
  std::memcpy(out.data() + at, bytes.data(), bytes.size());
}

inline void end_record(std::string& out, std::size_t begin) {
  patch(out, begin - 8, static_cast<std::uint64_t>(out.size() - begin));
}

/// Reads little-endian fields one after the other; once one does not fit, everything after it is 0 and `ok` false.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : rest_(bytes) {}

  template <class Integer>
  Integer get() {
    if (rest_.size() < sizeof(Integer)) {
      fail();
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(rest_[i])) << (8 * i);
    rest_.remove_prefix(sizeof(Integer));
    return static_cast<Integer>(value);
  }
  std::string_view bytes(std::uint64_t size) {
    if (rest_.size() < size) {
      fail();
      return {};
    }
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }
  std::string_view string() { return bytes(get<std::uint32_t>()); }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  void fail() {
    ok_ = false;
    rest_ = {};
  }
  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace sentree::record::detail
