#include "sentree/bt/machine.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/nodes/branch.h"
#include "sentree/bt/nodes/decorator.h"
#include "sentree/bt/nodes/leaf.h"
#include "sentree/bt/nodes/loop.h"
#include "sentree/bt/nodes/parallel.h"
#include "sentree/bt/nodes/reactive.h"
#include "sentree/bt/nodes/sequence.h"
#include "sentree/bt/nodes/timing.h"

namespace sentree::bt {

// The loop that walks a tree holds only what most trees are made of; everything else is behind a call, which leaves the
// loop its registers.

[[gnu::always_inline]] inline Next Machine::enter(const Node& n, NodeId id) {
  switch (n.kind) {
    case Kind::kSequence: return nodes::Sequence::enter(*this, n, id);
    case Kind::kFallback: return nodes::Fallback::enter(*this, n, id);
    case Kind::kAsyncSequence: return nodes::AsyncSequence::enter(*this, n, id);
    case Kind::kAsyncFallback: return nodes::AsyncFallback::enter(*this, n, id);
    case Kind::kSequenceWithMemory: return nodes::SequenceWithMemory::enter(*this, n, id);
    case Kind::kReactiveSequence: return nodes::ReactiveSequence::enter(*this, n, id);
    case Kind::kReactiveFallback: return nodes::ReactiveFallback::enter(*this, n, id);
    case Kind::kParallel: return nodes::Parallel::enter(*this, n, id);
    case Kind::kParallelAll: return nodes::ParallelAll::enter(*this, n, id);
    case Kind::kIfThenElse: return nodes::IfThenElse::enter(*this, n, id);
    case Kind::kWhileDoElse: return nodes::WhileDoElse::enter(*this, n, id);
    case Kind::kSwitch: return nodes::Switch::enter(*this, n, id);
    case Kind::kTryCatch: return nodes::TryCatch::enter(*this, n, id);
    case Kind::kManualSelector: return nodes::ManualSelector::enter(*this, n, id);
    case Kind::kInverter: return nodes::Inverter::enter(*this, n, id);
    case Kind::kForceSuccess: return nodes::ForceSuccess::enter(*this, n, id);
    case Kind::kForceFailure: return nodes::ForceFailure::enter(*this, n, id);
    case Kind::kSubTree: return nodes::SubTree::enter(*this, n, id);
    case Kind::kRepeat: return nodes::Repeat::enter(*this, n, id);
    case Kind::kRetry: return nodes::Retry::enter(*this, n, id);
    case Kind::kKeepRunningUntilFailure: return nodes::KeepRunningUntilFailure::enter(*this, n, id);
    case Kind::kDelay: return nodes::Delay::enter(*this, n, id);
    case Kind::kTimeout: return nodes::Timeout::enter(*this, n, id);
    case Kind::kRunOnce: return nodes::RunOnce::enter(*this, n, id);
    case Kind::kPrecondition: return nodes::Precondition::enter(*this, n, id);
    case Kind::kSkipUnlessUpdated: return nodes::SkipUnlessUpdated::enter(*this, n, id);
    case Kind::kWaitValueUpdate: return nodes::WaitValueUpdate::enter(*this, n, id);
    case Kind::kLoop: return nodes::Loop::enter(*this, n, id);
    case Kind::kBlackboardCheck: return nodes::BlackboardCheck::enter(*this, n, id);
    case Kind::kAlwaysSuccess: return Next::done(Status::kSuccess);
    case Kind::kAlwaysFailure: return Next::done(Status::kFailure);
    case Kind::kScript: return nodes::Script::enter(*this, n, id);
    case Kind::kScriptCondition: return nodes::ScriptCondition::enter(*this, n, id);
    case Kind::kSetBlackboard: return nodes::SetBlackboard::enter(*this, n, id);
    case Kind::kUnsetBlackboard: return nodes::UnsetBlackboard::enter(*this, n, id);
    case Kind::kSleep: return nodes::Sleep::enter(*this, n, id);
    case Kind::kWasEntryUpdated: return nodes::WasEntryUpdated::enter(*this, n, id);
    case Kind::kTestNode: return nodes::TestNode::enter(*this, n, id);
    case Kind::kExternalAction:
    case Kind::kExternalCondition: return enter_external(n, id);
    case Kind::kUser: return nodes::User::enter(*this, n, id);
    case Kind::kUnknown: return fail(id, "bt.unknown-node", "is known by name only and cannot run");
  }
  return Next::done(Status::kFailure);
}

[[gnu::always_inline]] inline Next Machine::child_done(const Node& n, NodeId id, NodeId child, Status status) {
  switch (n.kind) {
    case Kind::kSequence: return nodes::Sequence::child_done(*this, n, id, status);
    case Kind::kFallback: return nodes::Fallback::child_done(*this, n, id, status);
    case Kind::kAsyncSequence: return nodes::AsyncSequence::child_done(*this, n, id, status);
    case Kind::kAsyncFallback: return nodes::AsyncFallback::child_done(*this, n, id, status);
    case Kind::kSequenceWithMemory: return nodes::SequenceWithMemory::child_done(*this, n, id, status);
    case Kind::kReactiveSequence: return nodes::ReactiveSequence::child_done(*this, n, id, status);
    case Kind::kReactiveFallback: return nodes::ReactiveFallback::child_done(*this, n, id, status);
    case Kind::kParallel: return nodes::Parallel::child_done(*this, n, id, status);
    case Kind::kParallelAll: return nodes::ParallelAll::child_done(*this, n, id, status);
    case Kind::kIfThenElse: return nodes::IfThenElse::child_done(*this, n, id, status);
    case Kind::kWhileDoElse: return nodes::WhileDoElse::child_done(*this, n, id, status);
    case Kind::kSwitch: return nodes::Switch::child_done(*this, n, id, status);
    case Kind::kTryCatch: return nodes::TryCatch::child_done(*this, n, id, status);
    case Kind::kManualSelector: return nodes::ManualSelector::child_done(*this, n, id, status);
    case Kind::kInverter: return nodes::Inverter::child_done(*this, n, id, status);
    case Kind::kForceSuccess: return nodes::ForceSuccess::child_done(*this, n, id, status);
    case Kind::kForceFailure: return nodes::ForceFailure::child_done(*this, n, id, status);
    case Kind::kSubTree: return nodes::SubTree::child_done(*this, n, id, status);
    case Kind::kRepeat: return nodes::Repeat::child_done(*this, n, id, status);
    case Kind::kRetry: return nodes::Retry::child_done(*this, n, id, status);
    case Kind::kKeepRunningUntilFailure: return nodes::KeepRunningUntilFailure::child_done(*this, n, id, status);
    case Kind::kDelay: return nodes::Delay::child_done(*this, n, id, status);
    case Kind::kTimeout: return nodes::Timeout::child_done(*this, n, id, status);
    case Kind::kRunOnce: return nodes::RunOnce::child_done(*this, n, id, status);
    case Kind::kPrecondition: return nodes::Precondition::child_done(*this, n, id, status);
    case Kind::kSkipUnlessUpdated: return nodes::SkipUnlessUpdated::child_done(*this, n, id, status);
    case Kind::kWaitValueUpdate: return nodes::WaitValueUpdate::child_done(*this, n, id, status);
    case Kind::kLoop: return nodes::Loop::child_done(*this, n, id, status);
    case Kind::kBlackboardCheck: return nodes::BlackboardCheck::child_done(*this, n, id, status);
    case Kind::kUser: return nodes::User::child_done(*this, n, id, child, status);
    default: break;
  }
  SENTREE_ASSERT(false && "a leaf has no children");
  return Next::done(status);
}

void Machine::halt_kind(const Node& n, NodeId id) {
  switch (n.kind) {
    case Kind::kSequence:
    case Kind::kFallback:
    case Kind::kAsyncSequence:
    case Kind::kAsyncFallback: return nodes::Sequence::halt(*this, n);
    case Kind::kSequenceWithMemory: return nodes::SequenceWithMemory::halt(*this, n);
    case Kind::kReactiveSequence:
    case Kind::kReactiveFallback: return nodes::ReactiveSequence::halt(*this, n);
    case Kind::kParallel:
    case Kind::kParallelAll: return nodes::Parallel::halt(*this, n);
    case Kind::kIfThenElse: return nodes::IfThenElse::halt(*this, n);
    case Kind::kWhileDoElse: return nodes::WhileDoElse::halt(*this, n);
    case Kind::kSwitch: return nodes::Switch::halt(*this, n);
    case Kind::kTryCatch: return nodes::TryCatch::halt(*this, n, id);
    case Kind::kManualSelector: return nodes::ManualSelector::halt(*this, n);
    case Kind::kRepeat:
    case Kind::kRetry: return nodes::Repeat::halt(*this, n);
    case Kind::kDelay: return nodes::Delay::halt(*this, n, id);
    case Kind::kTimeout: return nodes::Timeout::halt(*this, n, id);
    case Kind::kSkipUnlessUpdated:
    case Kind::kWaitValueUpdate: return nodes::SkipUnlessUpdated::halt(*this, n);
    case Kind::kLoop: return nodes::Loop::halt(*this, n);
    case Kind::kSleep:
    case Kind::kTestNode: return stop_timer(id);
    case Kind::kExternalAction:
    case Kind::kExternalCondition: return halt_external(n, id);
    case Kind::kUser: return nodes::User::halt(*this, n, id);
    default: return reset_children(n);
  }
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
