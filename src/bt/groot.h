#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// Nodes that Groot's formats can number: 16 bits, from 1.
inline constexpr std::size_t kGrootNodesMax = 65'535;

/// A node came from one status to another.
struct Transition {
  TimePoint time{};
  NodeId node = 0;
  Status from = Status::kIdle;
  Status to = Status::kIdle;
};

/// The tree as BehaviorTree.CPP shows it to Groot 2: every node with its number as `_uid` (node 0 is 1), every instance
/// of a SubTree as a BehaviorTree of its own with its `_fullpath`, and models of all nodes, built-in ones included.
[[nodiscard]] std::string write_groot2_xml(const Tree& tree);

/// A `.btlog` file (BehaviorTree.CPP's FileLogger2), which Groot 2 replays.
/// @param began_us  When the log's time 0 was, in microseconds since 1970.
/// Errors: bt.too-many-nodes.
[[nodiscard]] Result<std::string> write_btlog(const Tree& tree, std::span<const Transition> transitions,
                                              std::int64_t began_us = 0);

/// A `.fbl` file (BehaviorTree.CPP 3's FileLogger), which Groot 1 replays. Skipped nodes are idle there.
/// Errors: bt.too-many-nodes.
[[nodiscard]] Result<std::string> write_fbl(const Tree& tree, std::span<const Transition> transitions,
                                            std::int64_t began_us = 0);

}  // namespace sentree::bt
