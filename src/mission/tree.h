#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/time.h"
#include "sentree/bt/state.h"
#include "sentree/bt/status.h"
#include "sentree/bt/step.h"
#include "sentree/mission/delivery.h"
#include "sentree/mission/observation_name.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// Until when time passes for monitors of a run that ended then. The instant at which a mission is cut off is not
/// whole: an observation that would have been in time may have been to come, so what is due there stays open. The one
/// at which it ends by itself is.
[[nodiscard]] constexpr TimePoint judged_until(TimePoint ended, bool by_itself) {
  return by_itself ? ended : std::max(TimePoint{}, ended - Duration(1));
}

/// Where the mission is between two deliveries.
enum class TreePhase : std::uint8_t {
  kBetween,  ///< No tick goes on.
  kWaiting,  ///< A tick waits for the answer of a leaf.
  kHalting,  ///< No tick follows; leaves are still halting.
  kEnded,    ///< Nothing is left to do.
};
[[nodiscard]] std::string_view to_string(TreePhase phase);

/// A step that the mission may take from one phase to another, and by what.
struct TreeEdge {
  TreePhase from;
  std::string_view by;  ///< "period", "timer", "due", "answered", "halted", "stop" or "limit".
  TreePhase to;
  friend bool operator==(const TreeEdge&, const TreeEdge&) = default;
};
/// All of them. A step that is not in the table is a bug, and stops the program.
[[nodiscard]] std::span<const TreeEdge> tree_edges();
/// What a delivery counts as in the table.
[[nodiscard]] std::string_view kind_of(const TreeDelivery& delivery);

/// What a mission is made of. Never changes.
struct TreeModel {
  const project::Plan* plan = nullptr;  ///< Borrowed.
  Duration period{};
  bool repeat = false;           ///< The mission begins anew when the root has completed.
  project::Deadlines deadlines;  ///< Run time.
  /// When the first ticks begin, instead of by the rate: those of a recording.
  std::vector<TimePoint> tick_times;
  /// A deadline that is not the next one gets no timer of its own: in real time each that rings for nothing wakes a
  /// processor.
  bool one_deadline_timer = false;
};

/// What the mission remembers between deliveries. A plain value: a copy goes on alike.
struct TreeState {
  struct Completed {
    bt::Status status = bt::Status::kIdle;
    Map outputs;
    friend bool operator==(const Completed&, const Completed&) = default;
  };
  struct Leaf {
    std::uint64_t outstanding = 0;            ///< Number of the tick not yet answered; 0: none.
    std::uint64_t call = 0;                   ///< Of that tick, joins request and reply.
    std::uint64_t halt_call = 0;              ///< Of the outstanding halt; 0: none.
    TimePoint asked{};                        ///< When that tick was sent.
    std::optional<bt::Status> lateness_told;  ///< As what a missing answer counted; told once until it answers.
    std::optional<Completed> late;            ///< A completed answer that came too late for its tick.
    /// What a skill that has ended said while its leaf was forced to be RUNNING; its next tick gets it.
    std::optional<Completed> held;
    /// What follows does not depend on it.
    [[nodiscard]] bool at_rest() const {
      return outstanding == 0 && halt_call == 0 && !lateness_told && !late && !held;
    }
    friend bool operator==(const Leaf&, const Leaf&) = default;
  };

  bt::State tree;
  /// By their place in the plan, between deliveries those that are not at rest: of thousands hardly more than one.
  std::map<std::size_t, Leaf> leaves;
  std::uint64_t next_tick = 0;  ///< Ticks of leaves, numbered.
  std::uint64_t ticks = 0;      ///< Of the root.
  std::uint64_t missed = 0;     ///< Periods in which no tick could begin, because the one before was not over.
  TimePoint planned{};          ///< The next period, or the present one.
  std::size_t given_tick = 0;   ///< Of the model's tick times, the next.
  TimePoint began{};            ///< The last tick.
  TimePoint timer_at = kNever;  ///< When the tree's timer rings.
  /// Of the leaf that was ticked last: no other is waited for.
  AnswerDue deadline;
  TimePoint deadline_timer = kNever;  ///< Rings no later than `deadline`.
  TreePhase phase = TreePhase::kBetween;
  bool over = false;  ///< The root has completed, or was halted.
  bt::Status root = bt::Status::kIdle;
  std::string reason;  ///< Why it failed, as the failing leaf said.

  /// Of a leaf.
  [[nodiscard]] std::uint64_t outstanding(std::size_t leaf) const {
    const auto found = leaves.find(leaf);
    return found != leaves.end() ? found->second.outstanding : 0;
  }
  friend bool operator==(const TreeState&, const TreeState&) = default;
};

/// What the mission does to the world around it, in order.
class TreeHost {
 public:
  virtual ~TreeHost() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  virtual void publish(Message message) = 0;
  /// Whether anybody would see an observation of that name. One that nobody would see is not published but passed.
  [[nodiscard]] virtual bool is_heard(ObservationName& /*name*/) { return true; }
  /// Has its place in the order, and that is all.
  virtual void pass() {}
  /// A node of the tree has another status now.
  virtual void changed(bt::NodeId /*node*/, bt::Status /*to*/) {}
  /// A leaf has answered a tick so.
  virtual void has_answered(std::size_t /*leaf*/, bt::Status /*status*/) {}
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// The number of a leaf's next tick: at least 1, and that of none of its ticks and answers that are on their way.
  /// @param next  Where they are counted.
  [[nodiscard]] virtual std::uint64_t tick_number(std::size_t /*leaf*/, std::uint64_t next) { return next; }
  /// From now on observations belong to this root tick.
  virtual void set_tick(std::uint64_t tick) = 0;
  // How a leaf's skill is reached, wherever that runs; `Answered` and `Halted` follow. A cancelled run answers nothing.
  virtual void tick(std::size_t leaf, std::uint64_t tick, bool started, const Map& inputs) = 0;
  /// @param asked  When its request was published.
  virtual void halt(std::size_t leaf, TimePoint asked) = 0;
  /// @param asked  When that was published; kNever: it was not.
  virtual void cancel(std::size_t leaf, TimePoint asked) = 0;
  /// Something for the mission itself: as soon as possible, or at a time.
  virtual void deliver(TreeDelivery what) = 0;
  virtual void deliver_at(TimePoint when, Rank rank, TreeDelivery what) = 0;
  /// What stands for a leaf to answer instead of the truth.
  [[nodiscard]] virtual std::optional<bt::Status> forced(std::string_view leaf) = 0;
  /// When the mission gives up waiting for the leaf that it has just ticked; time 0: as the deadlines say; kNever: not
  /// at all.
  [[nodiscard]] virtual TimePoint due(std::size_t leaf) = 0;
  /// A root tick begins, so much after its planned time; it has been done, so long after it began.
  virtual void tick_began(Duration late) = 0;
  virtual void tick_done(std::uint64_t tick, Duration took) = 0;
  /// Something a person should know; the run goes on.
  virtual void problem(std::string what) = 0;
  /// Told once: nothing is left to do.
  virtual void ended() = 0;
};

/// Executes the tree: ticks it at its rate, carries ticks and halts to the leaves and their answers back, keeps
/// deadlines, publishes what is observable, and ends when the root completes.
///
/// Owns no thread and no clock. Deterministic: equal states, deliveries and answers of the host give equal effects.
class TreeMachine {
 public:
  explicit TreeMachine(TreeModel model);
  TreeMachine(const TreeMachine&) = delete;
  TreeMachine& operator=(const TreeMachine&) = delete;

  [[nodiscard]] const TreeModel& model() const { return model_; }
  /// Before the first tick.
  [[nodiscard]] TreeState initial() const;
  /// Asks the host for the first period.
  void start(TreeState& state, TreeHost& host) const;
  void step(TreeState& state, TreeDelivery&& delivery, TreeHost& host);

 private:
  class Step;
  // Publishes node statuses as observations.
  struct StatusEvents final : bt::Observer {
    void status_changed(bt::NodeId node, bt::Status from, bt::Status to, TimePoint time) override;
    const bt::Tree* tree = nullptr;
    TreeHost* host = nullptr;
    ObservationName name{"node.status"};
  };
  struct LeafNames {
    ObservationName request;
    ObservationName reply;
  };

  TreeModel model_;
  std::vector<std::size_t> leaf_of_node_;
  std::vector<LeafNames> names_;  // of leaves' ticks, as in the plan
  bt::Effects effects_;
  std::vector<bt::Effect> followed_;
  StatusEvents statuses_;
};

}  // namespace sentree::mission
