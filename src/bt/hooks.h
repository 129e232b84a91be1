#pragma once

#include <functional>
#include <optional>
#include <unordered_map>

#include "sentree/base/time.h"
#include "sentree/bt/status.h"

namespace sentree::bt {

/// What is done around the ticks of one node.
struct NodeHooks {
  /// Instead of the tick: SUCCESS or FAILURE is the result, and the node is not ticked. Anything else: it is ticked.
  std::function<Status(NodeId)> before;
  /// After a tick that completed: SUCCESS or FAILURE replaces its result.
  std::function<Status(NodeId, Status)> after;
  /// After each tick that was not replaced, with the time from its begin to its end, waiting for answers included.
  std::function<void(NodeId, Status, Duration)> monitor;
};

/// Hooks into single nodes' ticks, for tests, debuggers and profilers (BehaviorTree.CPP's setPreTickFunction,
/// setPostTickFunction, setTickMonitorCallback). Give it to `Effects::hooks`.
///
/// They run between the node's pre- and post-conditions, and not for a node that a pre-condition keeps from being
/// ticked; only `after` sees a result given by a pre-condition. What they do is no part of the state.
class TickHooks {
 public:
  /// @param clock  Measures for `monitor`; null: the run's time, in which only waiting takes any. Borrowed.
  explicit TickHooks(const Clock* clock = nullptr) : clock_(clock) {}

  /// The hooks of a node, to be filled in.
  [[nodiscard]] NodeHooks& at(NodeId node) { return nodes_[node]; }

  // --- For the machine ----------------------------------------------------------------------------------------------
  [[nodiscard]] Status begin(NodeId node, Status kept, TimePoint now);
  [[nodiscard]] Status end(NodeId node, Status status, TimePoint now);

 private:
  const Clock* clock_;
  std::unordered_map<NodeId, NodeHooks> nodes_;
  std::unordered_map<NodeId, TimePoint> begun_;
};

}  // namespace sentree::bt
