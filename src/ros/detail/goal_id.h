#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Parts of the messages of actions that are the same for all types. Private to the library.
namespace sentree::ros {

inline constexpr std::size_t kGoalIdSize = 16;

/// 16 random octets, as 32 digits.
[[nodiscard]] std::string new_goal_id();
[[nodiscard]] std::optional<std::array<std::uint8_t, kGoalIdSize>> read_goal_id(std::string_view text);
[[nodiscard]] std::string goal_id_at(const std::vector<std::uint8_t>& message, std::size_t at);
/// Zeros for what is no id.
void put_goal_id(std::vector<std::uint8_t>& out, std::string_view text);

/// A uint32, aligned.
void put_number(std::vector<std::uint8_t>& out, std::uint32_t number);
[[nodiscard]] std::uint32_t number_at(const std::vector<std::uint8_t>& message, std::size_t at);

}  // namespace sentree::ros
