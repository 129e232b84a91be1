#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/detail/machine.h"

// One step from the outside: inputs, timers, external leaves.

namespace sentree::bt {

namespace {

/// State::memory_ of an external leaf.
enum ExternalFlags : std::int32_t { kRunStarted = 1, kHalting = 2 };

}  // namespace

Next Machine::fail(NodeId id, std::string_view code, std::string message) {
  if (!failed_) {
    failed_ = unusual_ = true;
    effects_.error =
        Diagnostic{Severity::kError, std::string(code),
                   fmt::format("{} \"{}\": {}", tree_.registration(id), tree_.path(id), message), tree_.span(id)};
  }
  return Next::done(Status::kIdle);
}

void Machine::notify(NodeId id, Status status) {
  if (status_[id] != status) observer_->status_changed(id, status_[id], status, now());
}

void Machine::start_timer(NodeId id, TimePoint due) {
  SENTREE_ASSERT(starts_timers(nodes_[id].kind));  // otherwise the state could be saved, but not restored
  state_.timers_.push_back({due, id});
}

void Machine::stop_timer(NodeId id) {
  std::erase_if(state_.timers_, [id](const State::Timer& timer) { return timer.node == id; });
}

bool Machine::has_timer(NodeId id) const {
  return std::any_of(state_.timers_.begin(), state_.timers_.end(),
                     [id](const State::Timer& timer) { return timer.node == id; });
}

bool Machine::fire_timers() {
  bool fired = false;
  for (;;) {
    // The earliest first; of equal ones, the one set first. Halting may remove others.
    const auto next = std::min_element(state_.timers_.begin(), state_.timers_.end(),
                                       [](const State::Timer& a, const State::Timer& b) { return a.due < b.due; });
    if (next == state_.timers_.end() || next->due > now() || failed_) return fired;
    fired = true;
    const NodeId id = next->node;
    const Node& n = nodes_[id];
    fire_kind(n, id);
  }
}

Next Machine::enter_external(const Node& n, NodeId id) {
  std::int32_t& flags = *memory(n);
  // Halting may take its time; nobody waits, and no tick reaches the leaf meanwhile.
  if ((flags & kHalting) != 0) return Next::done(Status::kRunning);
  const Status kept = status_[id];
  const bool condition = n.kind == Kind::kExternalCondition;
  if (!condition && is_completed(kept)) return Next::done(kept);
  Effect effect{Effect::Kind::kTickLeaf, id, (flags & kRunStarted) == 0, {}};
  append_inputs(n, id, effect.inputs);
  if (failed_) return Next::done(Status::kIdle);
  flags |= kRunStarted;
  effects_.list.push_back(std::move(effect));
  if (nested_ != 0) return Next::done(Status::kRunning);
  state_.waiting_ = id;
  return {kSuspend, Status::kRunning};
}

void Machine::halt_external(const Node& n, NodeId id) {
  std::int32_t& flags = *memory(n);
  const bool waits = state_.waiting_ == id;
  const bool runs = (waits || status_[id] == Status::kRunning) && (flags & kRunStarted) != 0;
  if (waits) {
    // In the middle of its tick: nobody waits for the answer any more.
    state_.waiting_ = kNoNode;
    if (n.kind == Kind::kExternalCondition) {
      flags &= ~kRunStarted;
      effects_.list.push_back({Effect::Kind::kCancelLeaf, id, false, {}});
      return;
    }
  }
  flags &= ~kRunStarted;
  if (!runs || (flags & kHalting) != 0) return;
  flags |= kHalting;
  state_.halting_.push_back(id);
  effects_.list.push_back({Effect::Kind::kHaltLeaf, id, false, {}});
}

void Machine::append_inputs(const Node& n, NodeId id, Map& inputs) {
  const Manifest& manifest = model_.manifest(id);
  for (std::uint32_t i = 0; i < n.port_count; ++i) {
    const Binding& b = model_.bindings[n.ports + i];
    if (b.kind == Binding::Kind::kAbsent) continue;
    if (b.declared != 0xFFFF && manifest.ports[b.declared].direction == PortDirection::kOutput) continue;
    Datum scratch;
    if (const Datum* datum = read(b, b.type, scratch)) {
      inputs[model_.strings[b.name]] = datum->value;
      continue;
    }
    // An entry that is not there leaves the port out; one that does not fit its type is a mistake of the mission.
    Diagnostic error = read_error(b, b.type);
    if (error.code != "bt.conversion") continue;
    fail(id, error.code, std::move(error.message));
    return;
  }
}

[[gnu::always_inline]] inline StepResult Machine::finish(StepResult result) {
  effects_.next_timer = state_.timers_.empty() ? kNever : state_.next_timer();
  return result;
}

[[gnu::always_inline]] inline StepResult Machine::finish(Outcome outcome) {
  if (failed_) return finish({StepResult::Kind::kFailed, Status::kIdle, kNoNode});
  if (outcome.suspended) return finish({StepResult::Kind::kWaiting, Status::kRunning, state_.waiting_});
  if (is_completed(outcome.status)) set_status(0, Status::kIdle);
  return finish({StepResult::Kind::kDone, outcome.status, kNoNode});
}

StepResult Machine::answer(const Input& input) {
  const NodeId leaf = input.leaf;
  if (leaf == kNoNode || leaf != state_.waiting_ || input.status == Status::kIdle) return {};
  state_.waiting_ = kNoNode;
  const Node& n = nodes_[leaf];
  std::string error;
  for (const auto& [name, value] : input.outputs) {
    const Binding* b = binding(n, name);
    if (b == nullptr || b->kind != Binding::Kind::kEntry) continue;
    if (!write(*b, Datum{value, nullptr}, nullptr, error)) {
      fail(leaf, "bt.entry-type", fmt::format("output \"{}\": {}", name, error));
      return finish(Outcome{false, Status::kIdle});
    }
  }
  if (is_completed(input.status)) *memory(n) &= ~kRunStarted;
  return finish(walk(leaf, true, input.status, 0));
}

StepResult Machine::leaf_halted(NodeId leaf) {
  const auto place = std::find(state_.halting_.begin(), state_.halting_.end(), leaf);
  if (place == state_.halting_.end()) return {};
  state_.halting_.erase(place);
  *memory(nodes_[leaf]) &= ~kHalting;
  // Ticked while it was halting: the new run can start.
  if (status_[leaf] == Status::kRunning) wake();
  return finish({StepResult::Kind::kApplied, status_[0], kNoNode});
}

[[gnu::always_inline]] inline StepResult Machine::tick() {
  if (state_.waiting_ != kNoNode) return {};
  if (!state_.timers_.empty()) fire_timers();
  if (failed_) return finish(Outcome{false, Status::kIdle});
  if (answers_at_once(0)) return finish(Outcome{false, tick_at_once(nodes_[0], 0)});
  return finish(walk(0, false, Status::kIdle, 0));
}

StepResult Machine::halt_tree() {
  if (state_.waiting_ != kNoNode) {
    const NodeId leaf = state_.waiting_;
    halt_external(nodes_[leaf], leaf);
    set_status(leaf, Status::kIdle);
  }
  // As BehaviorTree.CPP does: the root, which halts what runs, then every node once more. A script that fails does not
  // keep the rest from being halted.
  halting_tree_ = true;
  halt_node(0);
  for (NodeId id = 0; id < model_.nodes.size(); ++id) halt_node(id);
  set_status(0, Status::kIdle);
  return finish({failed_ ? StepResult::Kind::kFailed : StepResult::Kind::kApplied, Status::kIdle, kNoNode});
}

[[gnu::always_inline]] inline StepResult Machine::step(const Input& input) {
  effects_.list.clear();
  effects_.wake = false;
  effects_.error.reset();
  if (input.kind == Input::Kind::kTick) [[likely]]
    return tick();
  return step_otherwise(input);
}

StepResult Machine::step_otherwise(const Input& input) {
  switch (input.kind) {
    case Input::Kind::kTick: break;
    case Input::Kind::kAnswer: return answer(input);
    case Input::Kind::kLeafHalted: return leaf_halted(input.leaf);
    case Input::Kind::kHalt: return halt_tree();
    case Input::Kind::kTimer:
      if (state_.waiting_ != kNoNode) return finish(StepResult{});
      if (fire_timers()) wake();
      return finish({failed_ ? StepResult::Kind::kFailed : StepResult::Kind::kApplied, status_[0], kNoNode});
  }
  return {};
}

StepResult step(const Tree& tree, State& state, const Input& input, TimePoint now, Effects& effects) {
  SENTREE_ASSERT(state.statuses().size() == tree.model().nodes.size());
  return Machine(tree, state, now, effects).step(input);
}

}  // namespace sentree::bt
