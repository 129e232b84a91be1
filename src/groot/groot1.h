#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "sentree/bt/status.h"
#include "sentree/groot/image.h"

// What Groot 1 (BehaviorTree.CPP 3's PublisherZMQ) is told. Pure functions.

namespace sentree::groot {

/// Ports of Groot 1, unless told otherwise.
inline constexpr std::uint16_t kGroot1PublisherPort = 1666;

/// A node's status changed, at a time in microseconds since 1970.
struct Change {
  std::int64_t at_us = 0;
  bt::NodeId node = 0;
  bt::Status from = bt::Status::kIdle;
  bt::Status to = bt::Status::kIdle;
  friend bool operator==(const Change&, const Change&) = default;
};

/// The 12 bytes of a change, also in `.fbl` files. Groot 1 knows no SKIPPED: it is IDLE there.
void append_change(std::string& out, const TreeImage& image, const Change& change);

/// What any request is answered: the tree with the present status of each node.
[[nodiscard]] std::string groot1_tree(const TreeImage& image, std::span<const bt::Status> statuses);

/// What is pushed: the statuses before the changes, and the changes in their order.
[[nodiscard]] std::string groot1_update(const TreeImage& image, std::span<const bt::Status> before,
                                        std::span<const Change> changes);

}  // namespace sentree::groot
