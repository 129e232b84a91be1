#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

#include "sentree/base/time.h"

namespace sentree::record::detail {

template <class Integer>
void append_integer(std::string& out, Integer number) {
  std::array<char, 24> buffer;
  out.append(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr);
}

/// Nanoseconds as seconds with as many decimals as are needed, at least one.
inline void append_seconds(std::string& out, TimePoint time) {
  std::int64_t ns = time.time_since_epoch().count();
  if (ns < 0) {
    out += '-';
    ns = -ns;
  }
  append_integer(out, ns / 1'000'000'000);
  out += '.';
  std::array<char, 9> digits;
  std::int64_t rest = ns % 1'000'000'000;
  for (std::size_t i = digits.size(); i-- > 0; rest /= 10) digits[i] = static_cast<char>('0' + rest % 10);
  std::size_t length = digits.size();
  while (length > 1 && digits[length - 1] == '0') --length;
  out.append(digits.data(), length);
}

/// The number that `append_rounded` writes.
inline double rounded(double number, int decimals) {
  const double scale = decimals == 6 ? 1e6 : 1e3;
  return std::abs(number) < 1e9 ? static_cast<double>(std::llround(number * scale)) / scale : 0.0;
}

/// With three or six decimals at most. Written as an integer, which is several times as fast as the shortest exact
/// form.
inline void append_rounded(std::string& out, double number, int decimals) {
  const double scale = decimals == 6 ? 1e6 : 1e3;
  if (!(std::abs(number) < 1e9)) {
    out += '0';
    return;
  }
  auto scaled = static_cast<std::int64_t>(std::llround(number * scale));
  if (scaled < 0) {
    out += '-';
    scaled = -scaled;
  }
  const auto unit = static_cast<std::int64_t>(scale);
  append_integer(out, scaled / unit);
  std::int64_t rest = scaled % unit;
  if (rest == 0) return;
  std::array<char, 8> digits;
  const auto count = static_cast<std::size_t>(decimals);
  for (std::size_t i = count; i-- > 0; rest /= 10) digits[i] = static_cast<char>('0' + rest % 10);
  std::size_t length = count;
  while (digits[length - 1] == '0') --length;
  out += '.';
  out.append(digits.data(), length);
}

}  // namespace sentree::record::detail
