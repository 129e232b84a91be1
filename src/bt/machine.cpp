#include "sentree/bt/detail/machine.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/nodes/of_kind.h"

namespace sentree::bt {

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

namespace {

/// Makes four to eight leaves IDLE, unless one of them is RUNNING.
bool clear_few(Status* leaves, std::uint32_t count) {
  constexpr std::uint64_t kOnes = 0x0101'0101'0101'0101;
  static_assert(sizeof(Status) == 1 && static_cast<int>(Status::kIdle) == 0 && static_cast<int>(Status::kRunning) == 1);
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  std::memcpy(&first, leaves, 4);
  std::memcpy(&last, leaves + count - 4, 4);
  // A byte that is 1 is 0 here, and borrows.
  const std::uint64_t others = (first | std::uint64_t{last} << 32U) ^ kOnes;
  if (((others - kOnes) & ~others & kOnes << 7U) != 0) return false;
  std::memset(leaves, 0, 4);
  std::memset(leaves + count - 4, 0, 4);
  return true;
}

}  // namespace

void Machine::reset_children(const Node& n, std::uint32_t from, std::uint32_t to) {
  constexpr std::uint32_t kFew = 8;  // More are worth being cleared at once, if they are leaves.
  if (observer_ == nullptr && to - from <= kFew) [[likely]] {
    if (to - from >= 4 && (n.flags & Node::kLeafChildren) != 0 &&
        clear_few(status_ + children_[n.first_child + from], to - from)) {
      return;
    }
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

Status Machine::precondition(const Node& n, NodeId id) {
  const Conditions& conditions = model_.conditions[n.conditions];
  if (conditions.step != kNone && status_[id] == Status::kIdle) [[likely]] {
    double number = 0;
    if (run_numbers(model_.steps.data() + conditions.step, 1, blackboard_, number)) [[likely]]
      return (number != 0.0) == conditions.when ? conditions.verdict : Status::kIdle;
  }
  return preconditions(n, id);
}

Status Machine::preconditions(const Node& n, NodeId id) {
  const Conditions& conditions = model_.conditions[n.conditions];
  const Status kept = status_[id];
  if (is_completed(kept)) return Status::kIdle;
  static constexpr Status kVerdicts[] = {Status::kFailure, Status::kSuccess, Status::kSkipped, Status::kSkipped};
  constexpr unsigned kOfRunning = 1U << Conditions::kWhile;
  bool holds = false;
  for (unsigned left = kept == Status::kIdle ? conditions.before : conditions.before & kOfRunning; left != 0;
       left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    // Where a script failed the tick is given up, whatever is said here.
    if (!run_condition(id, conditions.use[i], holds)) return kVerdicts[i];
    if (holds == (i == Conditions::kWhile)) continue;
    if (kept == Status::kRunning) halt_node(id);
    return kVerdicts[i];
  }
  return Status::kIdle;
}

void Machine::postcondition(const Node& n, NodeId id, Status status) {
  const Conditions& conditions = model_.conditions[n.conditions];
  const auto own = status == Status::kSuccess ? Conditions::kOnSuccess : Conditions::kOnFailure;
  ScriptValue ignored;
  for (const std::size_t i : {own, Conditions::kPost}) {
    if (conditions.use[i] != kNone && !run(id, conditions.use[i], ignored)) return;
  }
}

Next Machine::enter_any(const Node& n, NodeId id) { return enter(n, id); }

Status Machine::tick_other_leaf(const Node& n, NodeId id, Status status) {
  if (status == Status::kIdle) {
    switch (n.kind) {
      case Kind::kUser: status = nodes::User::checked(*this, n, id, nodes::User::ask_leaf(*this, n, id)); break;
      case Kind::kScript: status = nodes::Script::enter(*this, n, id).status; break;
      case Kind::kScriptCondition: status = nodes::ScriptCondition::enter(*this, n, id).status; break;
      case Kind::kAlwaysSuccess: status = Status::kSuccess; break;
      case Kind::kAlwaysFailure: status = Status::kFailure; break;
      default: status = enter_any(n, id).status; break;
    }
  }
  if ((n.flags & Node::kHasPost) != 0 && is_completed(status) && !failed_) postcondition(n, id, status);
  if (failed_) [[unlikely]]
    return Status::kIdle;
  keep(id, status);
  return status;
}

Status Machine::tick_any_leaf(NodeId id) { return nodes::tick_leaf<Status::kSuccess>(*this, id); }

Machine::Outcome Machine::walk(NodeId id, bool entered, Status status, NodeId top) {
  return hooks_ == nullptr ? walk_as<false>(id, entered, status, top) : walk_as<true>(id, entered, status, top);
}

template <bool kHooked>
Machine::Outcome Machine::walk_as(NodeId id, bool entered, Status status, NodeId top) {
  const Node* const nodes = nodes_;
  const NodeId* const children = children_;
  const Node* n = nodes + id;
  Next next = Next::done(status);  // What node `id` wants.
  for (;;) {
    if (!entered) {
      Status instead = (n->flags & Node::kHasPre) != 0 ? precondition(*n, id) : Status::kIdle;
      if constexpr (kHooked) {
        if (instead == Status::kIdle) instead = hooks_->begin(id, status_[id], now_);
      }
      next = instead == Status::kIdle ? enter(*n, id) : Next::done(instead);
    }
    NodeId child = id;
    if (next.child < kSuspend) {
      // Down. What answers at once need not be entered.
      child = children[n->first_child + next.child];
      if (failed_) [[unlikely]]
        return {false, Status::kIdle};
      if (!answers_at_once(child)) {
        id = child;
        n = nodes + child;
        entered = false;
        continue;
      }
      status = tick_any_leaf(child);
      if (status == Status::kIdle) return {false, Status::kIdle};
    } else {
      // Up: the node is done.
      if (next.child == kSuspend) return {true, Status::kRunning};
      status = next.status;
      if constexpr (kHooked) {
        if (!failed_) status = hooks_->end(id, status, now_);
      }
      if ((n->flags & Node::kHasPost) != 0 && is_completed(status) && !failed_) postcondition(*n, id, status);
      if (failed_) [[unlikely]]
        return {false, Status::kIdle};
      keep(id, status);
      if ((n->flags & Node::kDecorator) != 0) {
        const NodeId of = children[n->first_child];
        if (is_completed(status_[of])) set_status(of, Status::kIdle);
      }
      if (id == top) return {false, status};
      id = n->parent;
      n = nodes + id;
    }
    next = child_done(*n, id, child, status);
    entered = true;
  }
}

Status Machine::tick_now(NodeId id) {
  ++nested_;
  const Outcome outcome = walk(id, false, Status::kIdle, id);
  --nested_;
  return outcome.status;
}

}  // namespace sentree::bt
