#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/bt/script.h"

namespace sentree::bt {

/// What those who use a value take it for. Nothing is asked of what is only passed on, or printed. `kPositive` is a
/// count or a rate, of which nothing comes when it is 0.
enum class Wanted : std::uint8_t { kText, kTruth, kNumber, kPositive, kStatus, kList };
inline constexpr std::size_t kWantedKinds = 6;

/// What a script asks of the values that its names hold, so that none of its operators fails.
struct ScriptNeeds {
  std::vector<std::pair<std::uint32_t, Wanted>> needs;         ///< Indices into `Script::names`.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> alike;  ///< Names whose values meet: of one type, or it fails.
};

/// `is_condition`: what the script results in counts as true or false. `is_number` says whether a text stands for a
/// number (an enum, or digits): it is compared with both. Cost: O(instructions).
[[nodiscard]] ScriptNeeds needs_of(const Script& script, bool is_condition,
                                   const std::function<bool(std::string_view)>& is_number);

}  // namespace sentree::bt
