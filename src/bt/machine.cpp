#include "sentree/bt/machine.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/nodes/of_kind.h"

namespace sentree::bt {

// The loop that walks a tree holds only what most trees are made of; everything else is behind a call, which leaves the
// loop its registers.

[[gnu::always_inline]] inline Next Machine::enter(const Node& n, NodeId id) {
  return nodes::of_kind(
      n.kind, [&]<class T>() __attribute__((always_inline)) { return T::enter(*this, n, id); });
}

[[gnu::always_inline]] inline Next Machine::child_done(const Node& n, NodeId id, NodeId child, Status status) {
  return nodes::of_kind(
      n.kind, [&]<class T>() __attribute__((always_inline))->Next {
        if constexpr (requires { T::child_done(*this, n, id, status); }) {
          return T::child_done(*this, n, id, status);
        } else if constexpr (requires { T::child_done(*this, n, id, child, status); }) {
          return T::child_done(*this, n, id, child, status);
        } else {
          SENTREE_ASSERT(false && "a leaf has no children");
          return Next::done(status);
        }
      });
}

void Machine::halt_kind(const Node& n, NodeId id) {
  nodes::of_kind(n.kind, [&]<class T>() { T::halt(*this, n, id); });
}

void Machine::fire_kind(const Node& n, NodeId id) {
  nodes::of_kind(n.kind, [&]<class T>() { T::fire(*this, n, id); });
}

void Machine::reset_children(const Node& n, std::uint32_t from, std::uint32_t to) {
  constexpr std::uint32_t kFew = 8;  // More are worth being cleared at once, if they are leaves.
  if (observer_ == nullptr && to - from <= kFew) [[likely]] {
    const NodeId* const children = children_ + n.first_child;
    while (from < to && status_[children[from]] != Status::kRunning) status_[children[from++]] = Status::kIdle;
    if (from >= to) return;
  }
  reset_some(n, from, to);
}

void Machine::reset_some(const Node& n, std::uint32_t from, std::uint32_t to) {
  const NodeId* const children = children_ + n.first_child;
  static_assert(sizeof(Status) == 1);
  if ((n.flags & Node::kLeafChildren) != 0 && observer_ == nullptr && from < to) {
    Status* const leaves = status_ + children[from];
    if (std::memchr(leaves, static_cast<int>(Status::kRunning), to - from) == nullptr) {
      std::memset(leaves, static_cast<int>(Status::kIdle), to - from);
      return;
    }
  }
  for (; from < to; ++from) {
    if (status_[children[from]] == Status::kIdle) continue;
    reset(children[from]);
    if (failed_ && !halting_tree_) return;
  }
}

void Machine::halt_node(NodeId id) {
  const Node& n = nodes_[id];
  halt_kind(n, id);
  set_status(id, Status::kIdle);
  if (failed_ || n.conditions == kNone) return;
  if (const std::uint32_t use = model_.conditions[n.conditions].use[Conditions::kOnHalted]; use != kNone) {
    ScriptValue ignored;
    run(id, use, ignored);
  }
}

bool Machine::precondition(const Node& n, NodeId id, Status& status) {
  const Conditions& conditions = model_.conditions[n.conditions];
  const Status kept = status_[id];
  if (kept == Status::kIdle) {
    static constexpr Status kVerdicts[] = {Status::kFailure, Status::kSuccess, Status::kSkipped};
    for (const std::size_t i : {Conditions::kFailureIf, Conditions::kSuccessIf, Conditions::kSkipIf}) {
      if (conditions.use[i] == kNone) continue;
      bool holds = false;
      if (!run_condition(id, conditions.use[i], holds)) return true;
      if (holds) {
        status = kVerdicts[i];
        return true;
      }
    }
  }
  const std::uint32_t while_use = conditions.use[Conditions::kWhile];
  if (while_use == kNone || is_completed(kept)) return false;
  bool holds = false;
  if (!run_condition(id, while_use, holds)) return true;
  if (holds) return false;
  if (kept == Status::kRunning) halt_node(id);
  status = Status::kSkipped;
  return true;
}

void Machine::postcondition(const Node& n, NodeId id, Status status) {
  const Conditions& conditions = model_.conditions[n.conditions];
  const auto own = status == Status::kSuccess ? Conditions::kOnSuccess : Conditions::kOnFailure;
  ScriptValue ignored;
  for (const std::size_t i : {own, Conditions::kPost}) {
    if (conditions.use[i] != kNone && !run(id, conditions.use[i], ignored)) return;
  }
}

Machine::Outcome Machine::walk(NodeId id, bool entered, Status status, NodeId top) {
  return hooks_ == nullptr ? walk_as<false>(id, entered, status, top) : walk_as<true>(id, entered, status, top);
}

template <bool kHooked>
Machine::Outcome Machine::walk_as(NodeId id, bool entered, Status status, NodeId top) {
  const Node* const nodes = nodes_;
  const NodeId* const children = children_;
  for (;;) {
    const Node* n = nodes + id;
    if (!entered && !((n->flags & Node::kHasPre) != 0 && precondition(*n, id, status))) {
      Status instead = Status::kIdle;
      if constexpr (kHooked) instead = hooks_->begin(id, status_[id], now_);
      const Next next = instead == Status::kIdle ? enter(*n, id) : Next::done(instead);
      if (next.child < kSuspend) {
        id = children[n->first_child + next.child];
        continue;
      }
      if (next.child == kSuspend) return {true, Status::kRunning};
      status = next.status;
    }
    // Up, as long as parents are done too.
    for (;;) {
      if constexpr (kHooked) {
        if (!failed_) status = hooks_->end(id, status, now_);
      }
      if ((n->flags & Node::kHasPost) != 0 && is_completed(status) && !failed_) postcondition(*n, id, status);
      if (failed_) [[unlikely]]
        return {false, Status::kIdle};
      if (status != Status::kSkipped) {
        set_status(id, status);
      } else if (observer_ != nullptr) {
        observer_->skipped(id, now_);
      }
      if ((n->flags & Node::kDecorator) != 0) {
        const NodeId child = children[n->first_child];
        if (is_completed(status_[child])) set_status(child, Status::kIdle);
      }
      if (id == top) return {false, status};
      const NodeId child = id;
      id = n->parent;
      n = nodes + id;
      const Next next = child_done(*n, id, child, status);
      if (next.child < kSuspend) {
        id = children[n->first_child + next.child];
        entered = false;
        break;
      }
      status = next.status;
    }
  }
}

Status Machine::tick_now(NodeId id) {
  ++nested_;
  const Outcome outcome = walk(id, false, Status::kIdle, id);
  --nested_;
  return outcome.status;
}

}  // namespace sentree::bt
