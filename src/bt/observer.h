#pragma once

#include <cstdint>
#include <vector>

#include "sentree/bt/step.h"

namespace sentree::bt {

/// Counts what each node did; last status and time of each. Give it to `Effects::observer`.
class Statistics final : public Observer {
 public:
  struct PerNode {
    std::uint64_t transitions = 0;
    std::uint64_t succeeded = 0;
    std::uint64_t failed = 0;
    std::uint64_t skipped = 0;
    Status last_result = Status::kIdle;  ///< SUCCESS, FAILURE or SKIPPED; IDLE before the first.
    Status status = Status::kIdle;
    TimePoint changed{};  ///< Of the last transition.
  };

  /// @param next  Told of everything too; may be null.
  explicit Statistics(const Tree& tree, Observer* next = nullptr) : nodes_(tree.size()), next_(next) {}

  [[nodiscard]] const PerNode& node(NodeId id) const { return nodes_[id]; }

  void status_changed(NodeId id, Status from, Status to, TimePoint time) override {
    PerNode& n = nodes_[id];
    ++n.transitions;
    n.status = to;
    n.changed = time;
    if (is_completed(to)) {
      ++(to == Status::kSuccess ? n.succeeded : n.failed);
      n.last_result = to;
    }
    if (next_ != nullptr) next_->status_changed(id, from, to, time);
  }
  void skipped(NodeId id, TimePoint time) override {
    ++nodes_[id].skipped;
    nodes_[id].last_result = Status::kSkipped;
    if (next_ != nullptr) next_->skipped(id, time);
  }

 private:
  std::vector<PerNode> nodes_;
  Observer* next_;
};

}  // namespace sentree::bt
