#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/state.h"
#include "sentree/bt/status.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// What happens to a tree: one of these at a time.
struct Input {
  enum class Kind { kTick, kAnswer, kLeafHalted, kHalt, kTimer };

  Kind kind = Kind::kTick;
  NodeId leaf = kNoNode;          ///< kAnswer, kLeafHalted.
  Status status = Status::kIdle;  ///< kAnswer: RUNNING, SUCCESS, FAILURE or SKIPPED.
  Map outputs;                    ///< kAnswer: values for the output ports of these names.

  [[nodiscard]] static Input tick() { return {}; }
  [[nodiscard]] static Input answer(NodeId leaf, Status status, Map outputs = {}) {
    return {Kind::kAnswer, leaf, status, std::move(outputs)};
  }
  /// The leaf has finished halting.
  [[nodiscard]] static Input leaf_halted(NodeId leaf) { return {Kind::kLeafHalted, leaf, Status::kIdle, {}}; }
  /// Halt the whole tree. A suspended tick is given up: its leaf is halted, or cancelled if it is a condition.
  [[nodiscard]] static Input halt() { return {Kind::kHalt, kNoNode, Status::kIdle, {}}; }
  /// Timers may be due. During a suspended tick they wait for its end.
  [[nodiscard]] static Input timer() { return {Kind::kTimer, kNoNode, Status::kIdle, {}}; }
};

/// Something to do for an external leaf, in order.
struct Effect {
  enum class Kind {
    kTickLeaf,    ///< Tick it and give its status as the next input.
    kHaltLeaf,    ///< Tell it to halt; `Input::leaf_halted` when it has.
    kCancelLeaf,  ///< A condition: give up what it does now; no answer is expected.
  };
  Kind kind;
  NodeId leaf;
  bool started = false;  ///< kTickLeaf: a new run; the leaf was idle.
  Map inputs;            ///< kTickLeaf: present values of the input ports, typed as declared.

  friend bool operator==(const Effect&, const Effect&) = default;
};

/// Told of every change of a node's status, in order. Cheap when there is none.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void status_changed(NodeId node, Status from, Status to, TimePoint time) = 0;
  /// A node returned SKIPPED, which changes no status.
  virtual void skipped(NodeId /*node*/, TimePoint /*time*/) {}
};

/// What a person chose for a ManualSelector: a child by index, or the status to return; RUNNING: nothing yet.
struct Choice {
  std::uint32_t child = kNoNode;
  Status status = Status::kRunning;
};

class TickHooks;

/// What a step asks for. Reuse one object: `step` clears the list and keeps its memory.
struct Effects {
  std::vector<Effect> list;
  TimePoint next_timer = kNever;    ///< When `Input::timer` is wanted.
  bool wake = false;                ///< Tick again at once: a node yielded, or a timer let one go on.
  std::optional<Diagnostic> error;  ///< StepResult::Kind::kFailed: why.

  Observer* observer = nullptr;  ///< Borrowed; may be null. Not cleared.
  TickHooks* hooks = nullptr;    ///< Borrowed; may be null. Not cleared. See hooks.h.
  std::function<void()> waker;   ///< Given to C++ leaves that finish between ticks. Not cleared.
  /// Asked by each tick of a ManualSelector that has neither a running child nor the port `selection`. Must not block.
  /// Not cleared.
  std::function<Choice(NodeId)> choose;
};

struct StepResult {
  enum class Kind : std::uint8_t {
    kDone,     ///< A tick ended; `status` is the root's.
    kWaiting,  ///< The tick is suspended until `leaf` answers.
    kApplied,  ///< A halt, a timer or a leaf's "halted" took effect.
    kIgnored,  ///< The input does not fit: an answer nobody waits for, a tick while one is suspended.
    kFailed,   ///< `Effects::error` says why (a script without its entry, a bad threshold …). The tick is given up;
               ///< halt the tree before going on.
  };
  Kind kind = Kind::kIgnored;
  Status status = Status::kIdle;
  NodeId leaf = kNoNode;

  [[nodiscard]] bool done() const { return kind == Kind::kDone; }
  [[nodiscard]] bool waiting() const { return kind == Kind::kWaiting; }
};

/// Applies one input to the state and says what to do next. Never blocks; no threads, no clock of its own.
///
/// @param now  The run's time; not earlier than in the step before.
/// A root that completed is IDLE again, so the next tick starts anew.
/// Cost: O(nodes visited); no heap allocation once the vectors have grown, but for the effects' maps and strings.
StepResult step(const Tree& tree, State& state, const Input& input, TimePoint now, Effects& effects);

}  // namespace sentree::bt
