#pragma once

#include "sentree/bt/nodes/user.h"

namespace sentree::bt::nodes {

/// Ticks a child that is a leaf and answers within the step, where its parent stands: most nodes are leaves, so that
/// they are visited in a loop. `kUsual` is what most of them say there.
/// IDLE: it is no such leaf, which `Next::tick` is for, or the tick is given up.
template <Status kUsual>
[[gnu::always_inline]] inline Status tick_leaf(Machine& m, NodeId id) {
  const Node& n = m.node(id);
  if ((n.flags & Node::kPlain) == 0) {
    if ((n.flags & Node::kAtOnce) == 0) return Status::kIdle;
    const Status verdict = (n.flags & Node::kHasPre) != 0 ? m.precondition(n, id) : Status::kIdle;
    const bool skipped = verdict == Status::kSkipped && !m.unusual();
    return skipped ? verdict : m.tick_other_leaf(n, id, verdict);
  }
  const Status status = User::ask_leaf(m, n, id);
  if (m.unusual()) [[unlikely]]
    return User::said(m, n, id, status);
  if (status == kUsual && kUsual != Status::kRunning) [[likely]] {
    m.keep_unseen(id, status);
  } else if (status == Status::kRunning && (n.flags & Node::kSynchronous) == 0) [[likely]] {
    m.keep_unseen(id, status);
  } else if (is_completed(status)) {
    m.keep_unseen(id, status);
  } else {
    return User::said(m, n, id, status);
  }
  return status;
}

}  // namespace sentree::bt::nodes
