#include "sentree/bt/detail/machine.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/nodes/of_kind.h"

namespace sentree::bt {

namespace {

/// A node's `child_done`, which may ask for the child.
template <class T>
concept TakesStatus = requires(Machine& m, const Node& n, NodeId id, Status status) {
  T::child_done(m, n, id, status);
};
template <class T>
concept TakesChild = requires(Machine& m, const Node& n, NodeId id, Status status) {
  T::child_done(m, n, id, id, status);
};
template <class T>
concept HasChildren = TakesStatus<T> || TakesChild<T>;

template <class T>
[[gnu::always_inline]] inline Next child_done_as(Machine& m, const Node& n, NodeId id, NodeId child, Status status) {
  if constexpr (TakesStatus<T>) {
    return T::child_done(m, n, id, status);
  } else if constexpr (TakesChild<T>) {
    return T::child_done(m, n, id, child, status);
  } else {
    SENTREE_ASSERT(false && "a leaf has no children");
    return Next::done(status);
  }
}

}  // namespace

[[gnu::always_inline]] inline Next Machine::enter(const Node& n, NodeId id) {
  return nodes::of_kind(
      n.kind, [&]<class T>() __attribute__((always_inline)) { return T::enter(*this, n, id); });
}

[[gnu::always_inline]] inline Next Machine::child_done(const Node& n, NodeId id, NodeId child, Status status) {
  return nodes::of_kind(
      n.kind, [&]<class T>() __attribute__((always_inline)) { return child_done_as<T>(*this, n, id, child, status); });
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

void Machine::reset_many(const Node& n, std::uint32_t from, std::uint32_t to) {
  constexpr std::uint32_t kFew = 8;  // More are worth being cleared at once, if they are leaves.
  if (observer_ == nullptr && to - from <= kFew) [[likely]] {
    const NodeId* const children = children_ + n.first_child;
    if (to - from >= 4 && (n.flags & Node::kLeafChildren) != 0 && clear_few(status_ + children[from], to - from)) {
      return;
    }
    while (from < to && status_[children[from]] != Status::kRunning) status_[children[from++]] = Status::kIdle;
    if (from >= to) return;
  }
  reset_each(n, from, to);
}

void Machine::reset_each(const Node& n, std::uint32_t from, std::uint32_t to) {
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
    run(id, use);
  }
}

[[gnu::always_inline]] inline bool Machine::quick_precondition(const Conditions& conditions, NodeId id, bool& holds) {
  if (conditions.test_cell == kNone || status_[id] != Status::kIdle) return false;
  double number = 0;
  Blackboard::Entry* entry = nullptr;
  if (!detail::read_number(blackboard_, conditions.test_cell, entry, number)) return false;
  holds = detail::holds(conditions.test, number, conditions.test_number) == conditions.when;
  return true;
}

Status Machine::precondition(const Node& n, NodeId id) {
  const Conditions& conditions = model_.conditions[n.conditions];
  bool holds = false;
  if (quick_precondition(conditions, id, holds)) return holds ? conditions.verdict : Status::kIdle;
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
  const std::uint32_t own =
      conditions.use[status == Status::kSuccess ? Conditions::kOnSuccess : Conditions::kOnFailure];
  if (own != kNone && !run(id, own)) return;
  if (const std::uint32_t any = conditions.use[Conditions::kPost]; any != kNone) run(id, any);
}

[[gnu::always_inline]] inline void Machine::reset_decorated(const Node& n) {
  if ((n.flags & Node::kDecorator) == 0) return;
  const NodeId child = children_[n.first_child];
  if (is_completed(status_[child])) set_status(child, Status::kIdle);
}

[[gnu::always_inline]] inline Status Machine::leave(const Node& n, NodeId id, Status status) {
  if ((n.flags & Node::kHasPost) != 0 && is_completed(status) && !failed_) postcondition(n, id, status);
  if (unusual_) [[unlikely]]
    return leave_observed(n, id, status);
  if (status != Status::kSkipped) keep_unseen(id, status);
  reset_decorated(n);
  return status;
}

Status Machine::leave_observed(const Node& n, NodeId id, Status status) {
  if (failed_) return Status::kIdle;
  keep(id, status);
  reset_decorated(n);
  return status;
}

template <class T>
Status Machine::tick_as(Machine& m, const Node& n, NodeId id) {
  Next next;
  if constexpr (requires { T::tick(m, n, id); }) {
    next = T::tick(m, n, id);
  } else {
    next = T::enter(m, n, id);
  }
  if constexpr (HasChildren<T>) {
    while (next.child != kNoNode) {
      if (m.failed_) [[unlikely]]
        return Status::kIdle;
      const NodeId child = m.child(n, next.child);
      const Status status = m.tick_at_once(m.nodes_[child], child);
      if (status == Status::kIdle && m.failed_) return status;
      next = child_done_as<T>(m, n, id, child, status);
    }
  }
  return m.leave(n, id, next.status);
}

constexpr std::array<Machine::TickFunction, Node::kByKind + kKinds> Machine::kTicks = {
    &Machine::tick_walked, &Machine::tick_plain, &Machine::tick_conditional,
#define SENTREE_BT_NODE(name) &Machine::tick_as<nodes::name>,
    SENTREE_BT_NODES(SENTREE_BT_NODE)
#undef SENTREE_BT_NODE
};

Status Machine::tick_plain(Machine& m, const Node& n, NodeId id) {
  return nodes::User::tick_plain<Status::kSuccess>(m, n, id);
}

// Whatever it calls ends it: it needs no room of its own.
Status Machine::tick_conditional(Machine& m, const Node& n, NodeId id) {
  const Conditions& conditions = m.model_.conditions[n.conditions];
  bool holds = false;
  if (!m.quick_precondition(conditions, id, holds)) return m.tick_conditional_long(n, id);
  if (!holds) return m.tick_kind(n, id);
  if (m.unusual_ || conditions.verdict != Status::kSkipped) return m.leave_unticked(n, id, conditions.verdict);
  return Status::kSkipped;
}

Status Machine::tick_conditional_long(const Node& n, NodeId id) {
  const Status verdict = preconditions(n, id);
  return verdict == Status::kIdle ? tick_kind(n, id) : leave(n, id, verdict);
}

Status Machine::leave_unticked(const Node& n, NodeId id, Status verdict) { return leave(n, id, verdict); }

Machine::Outcome Machine::walk(NodeId id, bool entered, Status status, NodeId top) {
  if (!entered && answers_at_once(id)) return {false, tick_at_once(nodes_[id], id)};
  return hooked() ? walk_as<true>(id, entered, status, top) : walk_as<false>(id, entered, status, top);
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
        if (instead == Status::kIdle) instead = effects_.hooks->begin(id, status_[id], now());
      }
      next = instead == Status::kIdle ? enter(*n, id) : Next::done(instead);
    }
    NodeId child = id;
    if (next.child < kSuspend) {
      // Down. What answers at once is called.
      child = children[n->first_child + next.child];
      if (failed_) [[unlikely]]
        return {false, Status::kIdle};
      if (!answers_at_once(child)) {
        id = child;
        n = nodes + child;
        entered = false;
        continue;
      }
      status = tick_at_once(nodes_[child], child);
      if (status == Status::kIdle && failed_) return {false, Status::kIdle};
    } else {
      // Up: the node is done.
      if (next.child == kSuspend) return {true, Status::kRunning};
      status = next.status;
      if constexpr (kHooked) {
        if (!failed_) status = effects_.hooks->end(id, status, now());
      }
      if (leave(*n, id, status) == Status::kIdle && failed_) return {false, Status::kIdle};
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
