#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sentree::bt {

/// What a node says when it is ticked, and what it keeps afterwards (BehaviorTree.CPP's NodeStatus).
///
/// `kSkipped` goes to the parent and is never kept: a skipped node keeps the status it had.
enum class Status : std::uint8_t { kIdle, kRunning, kSuccess, kFailure, kSkipped };

/// "IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED".
[[nodiscard]] std::string_view to_string(Status status);

/// The reverse; exact upper case. Nothing for any other text.
[[nodiscard]] std::optional<Status> parse_status(std::string_view text);

[[nodiscard]] constexpr bool is_completed(Status status) {
  return status == Status::kSuccess || status == Status::kFailure;
}

/// Index of a node in its tree, in document order: the root is 0, a subtree is a contiguous range.
using NodeId = std::uint32_t;
inline constexpr NodeId kNoNode = 0xFFFFFFFFU;

}  // namespace sentree::bt
