#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "sentree/base/present.h"
#include "sentree/base/time.h"
#include "sentree/bt/status.h"

namespace sentree::bt {

class Tree;

/// Sees which C++ node a thread is in that steps a tree, for other threads that wonder why it does not come back.
/// Lock-free; one stepping thread at a time.
class CallWatch {
 public:
  /// Wall time in ms since anything, from any thread; each call of a node asks.
  using Clock = std::uint64_t (*)();
  explicit CallWatch(Clock clock) : clock_(clock) {}

  struct Call {
    NodeId node = kNoNode;
    Duration lasted{0};  ///< Wall time until now, as exact as the clock is.
    std::uint64_t which = 0;
  };

  /// The call of a node's functions that has not come back, the inner one of nested calls; nothing: there is none. From
  /// any thread.
  [[nodiscard]] std::optional<Call> pending() const;
  /// Takes the tree from the thread that is in that call: should it come back all the same, it waits there for ever and
  /// touches nothing more. False: it has come back. From any other thread.
  [[nodiscard]] bool give_up(const Call& call);

  // For the machine, in the thread that steps.

  /// Returns what is to be given back to `leave`.
  [[nodiscard]] std::uint64_t enter(NodeId node);
  void leave(std::uint64_t before);

 private:
  std::uint64_t replace(std::uint64_t next);

  const Clock clock_;
  std::atomic<std::uint64_t> call_{0};  // when it began, and of which node; 0: none
};

/// The C++ nodes of a tree, for who keeps them for a thread that may outlive it.
[[nodiscard]] std::shared_ptr<void> nodes_of(const Tree& tree);

/// While it lives, a watch sees the C++ nodes of all steps of this thread. Null: none does.
using WatchCalls = Present<CallWatch>;

}  // namespace sentree::bt
