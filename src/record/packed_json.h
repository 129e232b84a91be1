#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/base/value.h"

namespace sentree::record {

/// Text of the program itself, which is always there.
class StaticText {
 public:
  template <std::size_t N>
  consteval StaticText(const char (&literal)[N]) : text_(literal, N - 1) {}
  [[nodiscard]] std::string_view view() const { return text_; }

 private:
  std::string_view text_;
};

/// JSON that is to be printed later and elsewhere: the numbers and texts as they are, in the order in which they come.
///
/// Printing costs most of what recording a message costs; packing is a copy. `unpack` prints exactly what
/// `append_json` would have printed.
class PackedJson {
 public:
  PackedJson() = default;
  PackedJson(PackedJson&& other) noexcept { *this = std::move(other); }
  PackedJson& operator=(PackedJson&& other) noexcept {
    data_ = std::move(other.data_);
    size_ = std::exchange(other.size_, 0);
    capacity_ = std::exchange(other.capacity_, 0);
    return *this;
  }

  /// JSON as it stands. The text is kept by its address.
  void raw(StaticText json) {
    const char* text = json.view().data();
    const auto length = static_cast<std::uint32_t>(json.view().size());
    char* to = room(1 + sizeof text + sizeof length);
    *to = kRaw;
    std::memcpy(to + 1, &text, sizeof text);
    std::memcpy(to + 1 + sizeof text, &length, sizeof length);
  }
  /// JSON as it stands, copied.
  void json(std::string_view written) { copy(kJson, written); }
  /// A bracket, a comma or a colon.
  void mark(char punctuation) { *room(1) = punctuation; }
  /// A JSON string.
  void text(std::string_view text) {
    if (text.size() > 255) return copy(kText, text);
    char* to = room(2 + text.size());
    to[0] = kShortText;
    to[1] = static_cast<char>(text.size());
    copy_few(to + 2, text);
  }
  void integer(std::int64_t number) {
    if (number < 0 || number > 255) return put(kInteger, number);
    char* to = room(2);
    to[0] = kOctet;
    to[1] = static_cast<char>(number);
  }
  void number(double number) { put(kDouble, number); }
  void boolean(bool truth);
  /// With six decimals at most; 0 if it is not finite or beyond 1e9.
  void rounded(double number) { put(kRounded, number); }
  /// With three decimals each, comma between them.
  void rounded_list(std::span<const double> numbers);
  void value(const Value& value);
  /// What `print` makes of `size` bytes, which the caller fills in at once.
  using Print = void (*)(std::string& out, std::string_view bytes);
  char* later(Print print, std::size_t size) {
    const auto length = static_cast<std::uint32_t>(size);
    char* to = room(1 + sizeof print + sizeof length + size);
    *to = kPrint;
    std::memcpy(to + 1, &print, sizeof print);
    std::memcpy(to + 1 + sizeof print, &length, sizeof length);
    return to + 1 + sizeof print + sizeof length;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::string_view bytes() const { return {data_.get(), size_}; }
  void reserve(std::size_t bytes) {
    if (capacity_ - size_ < bytes) grow(bytes);
  }
  /// Forgets the content and keeps the memory.
  void clear() { size_ = 0; }
  /// Room for other things that lie between packed ones, at the end.
  char* room(std::size_t bytes) {
    if (capacity_ - size_ < bytes) grow(bytes);
    char* at = data_.get() + size_;
    size_ += bytes;
    return at;
  }
  [[nodiscard]] char* at(std::size_t offset) { return data_.get() + offset; }

  /// So many bytes are going to be added soon. Memory that another thread has read is slow to write to unless it is
  /// asked for early.
  void expect(std::size_t bytes) const {
    constexpr std::size_t kCacheLine = 64;
    for (std::size_t at = size_; at < std::min(size_ + bytes, capacity_); at += kCacheLine)
      __builtin_prefetch(data_.get() + at, 1);
  }

  /// Prints what was packed into `bytes`.
  static void unpack(std::string& out, std::string_view bytes);

 private:
  // Beyond these, a byte stands for itself: brackets, commas, colons.
  enum Op : char { kRaw, kJson, kText, kShortText, kInteger, kOctet, kDouble, kRounded, kRoundedList, kBytes, kPrint };

  template <class Number>
  void put(Op op, Number number) {
    static_assert(sizeof number == 8);
    char* to = room(9);
    *to = op;
    std::memcpy(to + 1, &number, 8);
  }
  void copy(Op op, std::string_view bytes) {
    char* to = room(5 + bytes.size());
    const auto length = static_cast<std::uint32_t>(bytes.size());
    *to = op;
    std::memcpy(to + 1, &length, 4);
    if (length > 0) std::memcpy(to + 5, bytes.data(), length);
  }
  // Most texts are shorter than what a call of memcpy is worth.
  static void copy_few(char* to, std::string_view text) {
    const std::size_t size = text.size();
    const auto twice = [&](auto part) {
      constexpr std::size_t kPart = sizeof part;
      std::memcpy(to, text.data(), kPart);
      std::memcpy(to + size - kPart, text.data() + size - kPart, kPart);
    };
    if (size > 16) {
      std::memcpy(to, text.data(), size);
    } else if (size >= 8) {
      twice(std::uint64_t{});
    } else if (size >= 4) {
      twice(std::uint32_t{});
    } else {
      for (std::size_t i = 0; i < size; ++i) to[i] = text[i];
    }
  }
  void grow(std::size_t bytes);

  std::unique_ptr<char[]> data_;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

}  // namespace sentree::record
