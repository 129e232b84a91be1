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
///     bt::Runner runner(std::move(*tree.value));
///     while (runner.tick() == bt::Status::kRunning) …
///
/// Time: `clock` if given, else the time stands at zero until `tick(now)` says otherwise.
/// External leaves are answered by `on_leaf`; without it they fail.
class Runner {
 public:
  explicit Runner(Tree tree, const Clock* clock = nullptr);

  /// One root tick. A failed tick (see `error`) counts as FAILURE and halts the tree.
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

  Tree tree_;
  State state_;
  Effects effects_;
  const Clock* clock_;
  TimePoint now_{};
};

}  // namespace sentree::bt
