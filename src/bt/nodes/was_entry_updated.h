#pragma once

#include <array>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// SUCCESS if the entry was written since this node last looked.
struct WasEntryUpdated : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kAlways}, Word{Word::Lives::kAlways}};
  static constexpr bool kWaitsForWrites = true;
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess | may::kFailure; }
  static Manifests manifests() {
    return {format4(leaf("WasEntryUpdated", Category::kAction, {input<Value>("entry")}))};
  }

  static Next enter(Machine& m, const Node& n, NodeId /*id*/) {
    const Blackboard::Entry* entry = m.blackboard().find(n.data);
    if (entry == nullptr) return Next::done(Status::kFailure);
    std::int32_t* seen = m.memory(n);
    const bool updated = seen_of(seen) != entry->sequence;
    set_seen(seen, entry->sequence);
    return Next::done(updated ? Status::kSuccess : Status::kFailure);
  }
};

}  // namespace sentree::bt::nodes
