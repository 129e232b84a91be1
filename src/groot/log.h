#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/bt/tree.h"

namespace sentree::groot {

/// A node came from one status to another.
struct Transition {
  TimePoint time{};
  bt::NodeId node = 0;
  bt::Status from = bt::Status::kIdle;
  bt::Status to = bt::Status::kIdle;
};

/// A `.btlog` file (BehaviorTree.CPP's FileLogger2), which Groot 2 replays.
/// @param began_us  When the log's time 0 was, in microseconds since 1970.
/// Errors: groot.too-many-nodes.
[[nodiscard]] Result<std::string> write_btlog(const bt::Tree& tree, std::span<const Transition> transitions,
                                              std::int64_t began_us = 0);

/// A `.fbl` file (BehaviorTree.CPP 3's FileLogger), which Groot 1 replays. Skipped nodes are idle there. Its slider has
/// a stop for what is a millisecond after 1970 or later, so a run that begins there is moved by one.
/// Errors: groot.too-many-nodes.
[[nodiscard]] Result<std::string> write_fbl(const bt::Tree& tree, std::span<const Transition> transitions,
                                            std::int64_t began_us = 0);

}  // namespace sentree::groot
