#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "sentree/base/time.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/state.h"
#include "sentree/bt/step.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// A tree with its state, ticked by whoever owns it: all that a program without skills needs.
///
///     bt::Registry registry;
///     registry.action("SayHello", [](bt::Context&) { std::puts("Hello"); return bt::Status::kSuccess; });
///     auto tree = bt::load(xml, {.registry = &registry});
///     if (!tree.ok()) …print tree.diagnostics…
///     bt::Runner runner(std::move(*tree.value), &clock);   // some sentree::Clock of yours
///     while (runner.tick() == bt::Status::kRunning) …
///
/// Time: `clock` if given, else what `tick(now)` says. A tree that waits for time (Sleep, Delay, Timeout), and is given
/// none, fails with bt.no-clock. `exec::Executor` has a clock, and waits between ticks.
/// External leaves, which a file declares and nobody registered, are answered by `on_leaf`; without it a tick that
/// comes to one fails with bt.unregistered. From within a tick (a node, an observer, `on_leaf`) `halt` may be called:
/// it takes effect when the tick ends. A tick from there fails the tick. What an observer, a hook or `on_leaf` throws
/// fails the tick, too.
class Runner {
 public:
  explicit Runner(Tree tree, const Clock* clock = nullptr);

  /// One root tick. A failed tick (see `error`) counts as FAILURE and halts the tree. IDLE: it was halted from within.
  Status tick();
  Status tick(TimePoint now);
  /// Ticks again while nodes ask for it (BehaviorTree.CPP's tickOnce), `ticks_max` times at most.
  Status tick_until_waiting(int ticks_max = 10'000);
  /// Halts everything.
  void halt();

  /// Why the last tick failed.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return effects_.error; }
  [[nodiscard]] const Tree& tree() const { return tree_; }
  [[nodiscard]] State& state() { return state_; }
  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] Effects& effects() { return effects_; }

  /// Answers the ticks of external leaves at once: status and outputs.
  std::function<std::pair<Status, Map>(NodeId leaf, const Map& inputs)> on_leaf;

 private:
  Status run(const Input& input, TimePoint now);
  /// Answers what a step has asked for, and gives up a tick that failed.
  Status settle(StepResult result, TimePoint now);

  /// The same, and does what was asked for meanwhile.
  Status end(StepResult result, TimePoint now);
  /// Somebody whom a step calls asks for another one.
  Status asked_within(const Input& input);
  /// Inside a handler: gives the tick up, whatever was thrown through it.
  Status threw(TimePoint now);
  /// Nobody says what time it is, and some node waits for it.
  Status time_stands();
  void give_up(TimePoint now, Observer* observer);
  void fail(NodeId leaf, const char* code, const std::string& message);
  /// False: nobody answers the leaf.
  bool ask(NodeId leaf, std::pair<Status, Map>& answer);

  static constexpr unsigned kHalt = 1;
  static constexpr unsigned kTick = 2;

  Tree tree_;
  State state_;
  Effects effects_;
  const Clock* clock_;
  TimePoint now_{};
  bool timed_ = false;     ///< Somebody said the time.
  bool stepping_ = false;  ///< In a step, or between the steps of one tick.
  unsigned asked_ = 0;     ///< From within: kHalt, kTick.
};

}  // namespace sentree::bt
