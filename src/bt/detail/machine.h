#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/call_watch.h"
#include "sentree/bt/context.h"
#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/detail/script_numbers.h"
#include "sentree/bt/detail/script_run.h"
#include "sentree/bt/model.h"
#include "sentree/bt/state.h"
#include "sentree/bt/step.h"

namespace sentree::bt {

/// Repetitions of Repeat, Retry and C++ controls in one step; a tree that never comes to an end is stopped there.
inline constexpr std::uint32_t kCyclesMax = 1'000'000;

/// Runs one step. Lives for the length of it; for the files of this library.
///
/// A tick walks the tree without recursion: a node is entered and says "tick that child" or "done"; when a child is
/// done its parent is asked again. What a node must know to go on is in the state's memory, so a tick can stop at an
/// external leaf and go on in a later step. Nodes below which none can stop are called by their parent instead, if
/// they are not too high (`Node::Tick`), unless somebody has hooked into ticks.
class Machine {
 public:
  Machine(const Tree& tree, State& state, TimePoint now, Effects& effects)
      : tree_(tree),
        model_(tree.model()),
        nodes_(model_.nodes.data()),
        children_(model_.children.data()),
        status_(state.status_.data()),
        memory_(state.memory_.data()),
        observer_(effects.observer),
        users_(model_.users.data()),
        bindings_(model_.bindings.data()),
        objects_(state.objects_.data()),
        blackboard_(model_, state, now),
        state_(state),
        effects_(effects),
        watch_(WatchCalls::present()),
        called_(effects.hooks == nullptr),
        unusual_(effects.observer != nullptr) {}

  StepResult step(const Input& input);

  // --- What nodes use -----------------------------------------------------------------------------------

  [[nodiscard]] const Node& node(NodeId id) const { return nodes_[id]; }
  [[nodiscard]] std::int32_t* memory(const Node& n) { return memory_ + n.memory; }
  [[nodiscard]] Status status(NodeId id) const { return status_[id]; }
  [[gnu::always_inline]] void set_status(NodeId id, Status status) {
    if (observer_ != nullptr) [[unlikely]]
      notify(id, status);
    status_[id] = status;
  }
  [[nodiscard]] NodeId child(const Node& n, std::uint32_t index) const { return children_[n.first_child + index]; }
  [[nodiscard]] const NodeId* children(const Node& n) const { return children_ + n.first_child; }
  [[nodiscard]] bool format3() const { return model_.format == 3; }
  [[nodiscard]] TimePoint now() const { return blackboard_.now(); }
  [[nodiscard]] Blackboard& blackboard() { return blackboard_; }
  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const Tree& tree() const { return tree_; }
  [[nodiscard]] Effects& effects() { return effects_; }
  /// Who sees which node is called; null: nobody.
  [[nodiscard]] CallWatch* watch() const { return watch_; }
  [[nodiscard]] const UserNode& user(const Node& n) const { return users_[n.data]; }
  [[nodiscard]] NodeMemory* object(std::uint32_t index) { return objects_[index].get(); }
  [[nodiscard]] bool failed() const { return failed_; }

  /// Somebody has hooked into the ticks of nodes.
  [[nodiscard]] bool hooked() const { return !called_; }
  /// A node that its parent may tick by `nodes::tick_child`; none where somebody has hooked into ticks.
  [[nodiscard]] bool answers_at_once(NodeId id) const { return called_ && nodes_[id].tick != Node::kWalked; }
  /// The tick is given up, or somebody observes each change of a status.
  [[nodiscard]] bool unusual() const { return unusual_; }
  /// The whole tick of a node that answers at once. IDLE: see `nodes::tick_child`, which is quicker for most leaves.
  [[gnu::always_inline]] Status tick_at_once(const Node& n, NodeId id) { return kTicks[n.tick](*this, n, id); }
  /// `set_status` where nothing is unusual.
  void keep_unseen(NodeId id, Status status) { status_[id] = status; }
  /// What the node said is what it keeps, unless it was skipped.
  [[gnu::always_inline]] void keep(NodeId id, Status status) {
    if (status != Status::kSkipped) [[likely]] {
      set_status(id, status);
    } else if (observer_ != nullptr) {
      observer_->skipped(id, now());
    }
  }

  /// Halts the child if it is RUNNING, and makes it IDLE.
  void reset(NodeId id) {
    if (status_[id] == Status::kRunning) halt_node(id);
    set_status(id, Status::kIdle);
  }
  void reset_children(const Node& n) { reset_children(n, 0, n.child_count); }
  [[gnu::always_inline]] void reset_children(const Node& n, std::uint32_t from, std::uint32_t to) {
    constexpr std::uint32_t kFew = 3;  // Not worth a call, unless one of them is RUNNING.
    if (to - from <= kFew && !unusual_) [[likely]] {
      const NodeId* child = children(n) + from;
      const NodeId* const end = children(n) + to;
      for (;; ++child) {
        if (child == end) return;
        if (status_[*child] == Status::kRunning) break;
        status_[*child] = Status::kIdle;
      }
    }
    reset_many(n, from, to);
  }
  /// Halts whatever its status, and runs its `_onHalted`.
  void halt_node(NodeId id);
  /// Ticks a subtree to its end within this step, external leaves counting as RUNNING. For cleaning up while halting.
  Status tick_now(NodeId id);

  /// Gives the tick up. Returns what a node then answers.
  Next fail(NodeId id, std::string_view code, std::string message);
  /// Counts repetitions within one step; false, and the tick is given up, beyond `kCyclesMax`.
  [[nodiscard]] bool count_cycle(NodeId id) {
    if (++cycles_ <= kCyclesMax) [[likely]]
      return true;
    fail(id, "bt.endless-tick", "repeats without end within one tick");
    return false;
  }
  /// Ask for another tick at once.
  void wake() { effects_.wake = true; }

  /// The node's struct says `kStartsTimers`.
  void start_timer(NodeId id, TimePoint due);
  void stop_timer(NodeId id);
  /// Due or not, a timer of that node exists.
  [[nodiscard]] bool has_timer(NodeId id) const;

  /// A port by its place in the manifest; null where the file does not give it and there is no default.
  [[nodiscard]] const Binding* binding(const Node& n, std::uint32_t port) const {
    const Binding& b = bindings_[n.ports + port];
    return b.kind == Binding::Kind::kAbsent ? nullptr : &b;
  }
  [[nodiscard]] const Binding* binding(const Node& n, const PortName& port) const {
    return port.is_short() ? binding_by_key(n, port.key) : binding_by_name(n, port);
  }
  [[nodiscard, gnu::noinline]] const Binding* binding_by_name(const Node& n, const PortName& port) const;
  /// Of a name that is short.
  [[nodiscard]] const Binding* binding_by_key(const Node& n, std::uint64_t key) const {
    const Binding* b = bindings_ + n.ports;
    for (const Binding* const end = b + n.port_count; b != end; ++b) {
      if (b->key == key) return b->kind == Binding::Kind::kAbsent ? nullptr : b;
    }
    return nullptr;
  }
  /// The present value of a port, converted to `wanted` in `scratch` where it is of another type. Null if there is
  /// none.
  const Datum* read(const Binding& binding, const PortType* wanted, Datum& scratch);
  /// What there is to read, unconverted; null if there is nothing.
  [[gnu::always_inline]] const Datum* held(const Binding* binding) {
    if (binding == nullptr) return nullptr;
    if (binding->kind == Binding::Kind::kLiteral) return &model_.literals[binding->target];
    const Blackboard::Entry* entry = blackboard_.find_linked(binding->target);
    if (entry == nullptr) [[unlikely]]
      entry = blackboard_.find(binding->target);
    return entry != nullptr ? &entry->datum : nullptr;
  }
  /// The value to overwrite, counted and stamped, if the entry is of that very type and holds one; else null.
  [[gnu::always_inline]] Value* writable(const Binding* binding, const PortType& type, Value::Type held) {
    if (binding == nullptr || binding->kind != Binding::Kind::kEntry) return nullptr;
    Blackboard::Entry* const entry = blackboard_.find_linked(binding->target);
    if (entry == nullptr || entry->type != &type || entry->datum.value.type() != held) return nullptr;
    blackboard_.written(*entry);
    return &entry->datum.value;
  }
  /// Why `read` gave null: bt.no-entry, bt.empty-entry, bt.conversion.
  [[nodiscard]] Diagnostic read_error(const Binding& binding, const PortType* wanted);
  /// Numbers and text of built-in nodes; nothing if the port is absent or its value does not fit.
  std::optional<std::int64_t> read_integer(const Node& n, std::uint32_t port);
  /// Valid as long as the entry and `scratch` are.
  std::optional<std::string_view> read_view(const Node& n, std::uint32_t port, Datum& scratch);
  /// The text that a port holds as it is; null where it is to be converted, or there is none.
  const std::string* held_text(const Node& n, std::uint32_t port);
  std::optional<std::string> read_text(const Node& n, std::uint32_t port);
  bool read_bool(const Node& n, std::uint32_t port, bool otherwise);
  std::optional<Status> read_status(const Node& n, std::uint32_t port);
  /// Writes what a port gives, converted to the type that the port declares. Null `type`: the datum's is not known.
  bool write(const Binding& binding, Datum&& datum, const PortType* type, std::string& error);

  /// Runs a script of the node. False: it failed, and the tick is given up.
  [[gnu::always_inline]] bool run(NodeId id, std::uint32_t use, ScriptValue& result) {
    const ScriptUse& u = model_.uses[use];
    double number = 0;
    if (u.steps == 0 || !run_numbers(model_.steps.data() + u.first_step, u.steps, blackboard_, number))
      return run_long(id, u, result);
    result = ScriptValue::of(number);
    return true;
  }
  /// The same where nobody asks what it gives.
  [[gnu::always_inline]] bool run(NodeId id, std::uint32_t use) {
    const ScriptUse& u = model_.uses[use];
    double ignored = 0;
    return (u.steps != 0 && run_numbers(model_.steps.data() + u.first_step, u.steps, blackboard_, ignored)) ||
           run_long(id, u);
  }
  [[gnu::always_inline]] bool run_condition(NodeId id, std::uint32_t use, bool& result) {
    const ScriptUse& u = model_.uses[use];
    double number = 0;
    if (u.steps == 0 || !run_numbers(model_.steps.data() + u.first_step, u.steps, blackboard_, number))
      return run_long_condition(id, u, result);
    result = number != 0.0;
    return true;
  }
  /// The same for a text that is known only now.
  bool run_text(NodeId id, const std::string& text, ScriptValue& result);

  /// A leaf that a skill runs.
  Next enter_external(const Node& n, NodeId id);
  void halt_external(const Node& n, NodeId id);

  static constexpr std::uint32_t kSuspend = kNoNode - 1;  ///< `Next::child`: wait for the leaf's answer.

 private:
  using TickFunction = Status (*)(Machine&, const Node&, NodeId);
  /// By `Node::tick`.
  static const std::array<TickFunction, Node::kByKind + kKinds> kTicks;
  static Status tick_walked(Machine& /*m*/, const Node& /*n*/, NodeId /*id*/) { return Status::kIdle; }
  static Status tick_plain(Machine& m, const Node& n, NodeId id);
  static Status tick_conditional(Machine& m, const Node& n, NodeId id);

  struct Outcome {
    bool suspended;
    Status status;
  };
  /// Goes on from `id`: enters it, or, with `entered`, takes `status` as what it returned. Ends when `top` has
  /// returned.
  Outcome walk(NodeId id, bool entered, Status status, NodeId top);
  template <bool kHooked>
  Outcome walk_as(NodeId id, bool entered, Status status, NodeId top);
  Next enter(const Node& n, NodeId id);
  Next child_done(const Node& n, NodeId id, NodeId child, Status status);
  /// The whole tick of a node of the kind T that answers at once, without its pre-conditions.
  template <class T>
  static Status tick_as(Machine& m, const Node& n, NodeId id);
  /// The node has said `status`: its post-conditions run, and it is kept. IDLE: the tick is given up.
  Status leave(const Node& n, NodeId id, Status status);
  [[gnu::noinline]] Status leave_observed(const Node& n, NodeId id, Status status);
  /// The same of a node that a pre-condition has kept from being ticked.
  [[gnu::noinline]] Status leave_unticked(const Node& n, NodeId id, Status verdict);
  /// A decorator's completed child.
  void reset_decorated(const Node& n);
  [[gnu::noinline]] Status tick_conditional_long(const Node& n, NodeId id);
  /// The same without its pre-conditions.
  Status tick_kind(const Node& n, NodeId id) {
    return kTicks[Node::kByKind + static_cast<std::size_t>(n.kind)](*this, n, id);
  }
  /// Whether `verdict` of its conditions holds for an IDLE node; false: that takes longer.
  bool quick_precondition(const Conditions& conditions, NodeId id, bool& holds);
  void halt_kind(const Node& n, NodeId id);
  void fire_kind(const Node& n, NodeId id);
  /// What the pre-conditions decide instead of the node; IDLE: nothing.
  [[gnu::noinline]] Status precondition(const Node& n, NodeId id);
  [[gnu::noinline]] Status preconditions(const Node& n, NodeId id);
  [[gnu::noinline]] void postcondition(const Node& n, NodeId id, Status status);

  [[gnu::noinline]] bool run_long(NodeId id, const ScriptUse& use);
  [[gnu::noinline]] bool run_long(NodeId id, const ScriptUse& use, ScriptValue& result);
  [[gnu::noinline]] bool run_long_condition(NodeId id, const ScriptUse& use, bool& result);
  [[gnu::noinline]] void reset_many(const Node& n, std::uint32_t from, std::uint32_t to);
  void reset_each(const Node& n, std::uint32_t from, std::uint32_t to);

  StepResult tick();
  [[gnu::noinline]] StepResult step_otherwise(const Input& input);
  StepResult answer(const Input& input);
  StepResult leaf_halted(NodeId leaf);
  StepResult halt_tree();
  bool fire_timers();
  StepResult finish(Outcome outcome);
  StepResult finish(StepResult result);
  [[gnu::noinline]] void notify(NodeId id, Status status);
  void append_inputs(const Node& n, NodeId id, Map& inputs);

  const Tree& tree_;
  const Model& model_;
  const Node* nodes_;
  const NodeId* children_;
  Status* status_;
  std::int32_t* memory_;
  Observer* observer_;
  const UserNode* users_;
  const Binding* bindings_;
  const ObjectSlot* objects_;
  Blackboard blackboard_;
  State& state_;
  Effects& effects_;
  CallWatch* const watch_;
  bool called_;  ///< Nodes that answer at once are called: nobody has hooked into ticks.
  bool failed_ = false;
  bool unusual_;
  bool halting_tree_ = false;
  std::uint32_t cycles_ = 0;
  int nested_ = 0;  ///< Inside tick_now.
};

}  // namespace sentree::bt
