#pragma once

#include <chrono>
#include <span>
#include <vector>

#include "sentree/bt/object.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// A Behaviour whose work goes on in threads of its own between ticks is one of these too.
class ThreadWork {
 public:
  virtual ~ThreadWork() = default;
  /// False: what it does is done within its ticks.
  [[nodiscard]] virtual bool works_in_threads() const = 0;
  /// Waits, at most until then, for what the node has begun. False: that goes on.
  [[nodiscard]] virtual bool wait(const NodeMemory& memory, std::chrono::steady_clock::time_point until) const = 0;
};

/// The C++ nodes of a tree whose work goes on in threads between ticks.
[[nodiscard]] std::vector<NodeId> nodes_in_threads(const Tree& tree);

/// Waits, at most until then, for the threads of those of the nodes that are RUNNING: for simulated time, which would
/// run away from them. Returns the first whose work goes on; kNoNode: all have done. Not within a step.
[[nodiscard]] NodeId wait_for_threads(const Tree& tree, State& state, std::span<const NodeId> nodes,
                                      std::chrono::steady_clock::time_point until);

}  // namespace sentree::bt
