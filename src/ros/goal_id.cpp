#include "sentree/ros/detail/goal_id.h"

#include <random>

namespace sentree::ros {

std::string new_goal_id() {
  std::random_device random;
  std::vector<std::uint8_t> id;
  while (id.size() < kGoalIdSize) put_number(id, random());
  return goal_id_at(id, 0);
}

std::string goal_id_at(const std::vector<std::uint8_t>& message, std::size_t at) {
  static const char* const kDigits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < kGoalIdSize; ++i) {
    out += kDigits[message[at + i] >> 4U];
    out += kDigits[message[at + i] & 15U];
  }
  return out;
}

std::optional<std::array<std::uint8_t, kGoalIdSize>> read_goal_id(std::string_view text) {
  if (text.size() != 2 * kGoalIdSize) return std::nullopt;
  std::array<std::uint8_t, kGoalIdSize> out{};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (digit < 0) return std::nullopt;
    out[i / 2] = static_cast<std::uint8_t>(static_cast<unsigned>(out[i / 2]) << 4U | static_cast<unsigned>(digit));
  }
  return out;
}

void put_goal_id(std::vector<std::uint8_t>& out, std::string_view text) {
  const auto id = read_goal_id(text).value_or(std::array<std::uint8_t, kGoalIdSize>{});
  out.insert(out.end(), id.begin(), id.end());
}

void put_number(std::vector<std::uint8_t>& out, std::uint32_t number) {
  while (out.size() % 4 != 0) out.push_back(0);
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

std::uint32_t number_at(const std::vector<std::uint8_t>& message, std::size_t at) {
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < 4; ++i)
    out |= static_cast<std::uint32_t>(message[at + i]) << (8 * (message[1] == 1 ? i : 3 - i));
  return out;
}

}  // namespace sentree::ros
