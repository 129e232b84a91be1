#include "sentree/base/json.h"

#include <array>

namespace sentree {

namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint32_t kNoDigit = 64;

constexpr std::array<std::uint8_t, 256> make_values() {
  std::array<std::uint8_t, 256> values{};
  values.fill(kNoDigit);
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    values[static_cast<unsigned char>(kDigits[i])] = static_cast<std::uint8_t>(i);
  return values;
}
constexpr std::array<std::uint8_t, 256> kValues = make_values();

}  // namespace

void append_base64(std::string& out, std::span<const std::byte> octets) {
  out.reserve(out.size() + (octets.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < octets.size(); i += 3) {
    const std::size_t left = octets.size() - i;
    const auto octet = [&](std::size_t k) { return k < left ? std::to_integer<std::uint32_t>(octets[i + k]) : 0U; };
    const std::uint32_t bits = octet(0) << 16 | octet(1) << 8 | octet(2);
    for (std::size_t k = 0; k < 4; ++k) out += k <= left ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
}

std::optional<std::vector<std::byte>> decode_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  std::vector<std::byte> octets;
  octets.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    const bool last = i + 4 == text.size();
    const std::size_t padding = !last || text[i + 3] != '=' ? 0 : text[i + 2] == '=' ? 2 : 1;
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t digit = k >= 4 - padding ? 0 : kValues[static_cast<unsigned char>(text[i + k])];
      if (digit == kNoDigit) return std::nullopt;
      bits = bits << 6 | digit;
    }
    for (std::size_t k = 0; k < 3 - padding; ++k) octets.push_back(static_cast<std::byte>(bits >> (16 - 8 * k) & 255));
  }
  return octets;
}

Value with_bytes(Value read) {
  if (List* list = read.as_list()) {
    for (Value& item : *list) item = with_bytes(std::move(item));
  } else if (Map* map = read.as_map()) {
    if (const Value* text = map->find("$bytes"); text != nullptr && map->size() == 1 && text->as_string() != nullptr) {
      if (auto octets = decode_base64(text->text())) return Bytes{std::move(*octets)};
    }
    for (auto& [key, item] : *map) item = with_bytes(std::move(item));
  }
  return read;
}

}  // namespace sentree
