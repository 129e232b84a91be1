#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/bt/step.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// How the mission reaches the skill of one leaf, wherever that runs. Called in the mission's actor; never blocks.
class LeafDriver {
 public:
  virtual ~LeafDriver() = default;
  /// Answered by `Mission::answered` with the same `tick`, once at most.
  virtual void tick(std::uint64_t tick, bool started, const Map& inputs) = 0;
  /// Answered by `Mission::halted`.
  virtual void halt() = 0;
  /// The run is given up; no answer is expected, late ones are ignored.
  virtual void cancel() = 0;
};

/// Lateness of root ticks in real time.
struct TickTiming {
  std::uint64_t ticks = 0;
  std::uint64_t missed = 0;  ///< Periods in which no tick could begin, because the one before was not over.
  Duration late_median{0};   ///< How long after its planned time a tick began, in wall time.
  Duration late_p99{0};
  Duration late_max{0};
  Duration tick_median{0};  ///< From a tick's beginning to its end, in wall time.
};

struct MissionOptions {
  Duration period{};
  bool repeat = false;
  project::Deadlines deadlines;  ///< Wall time.
  double factor = 1.0;           ///< Run seconds per wall second; deadlines are stretched by it.
  /// When the first ticks begin, instead of by the rate: those of a recording.
  std::vector<TimePoint> tick_times;
  /// When the mission gives up waiting for the answer of a leaf that it has just ticked; time 0: as the deadlines say.
  /// Null: always so.
  std::function<TimePoint(std::size_t leaf)> due;
  /// Told, in the mission's actor, when a root tick has been done; may be empty.
  std::function<void(std::uint64_t tick)> tick_done = {};
  StandingInterventions* standing = nullptr;  ///< Forced results; null: there are none.
};

/// Executes the tree: ticks it at its rate, carries ticks and halts to the leaves and their answers back, keeps
/// deadlines, publishes what is observable, and ends when the root completes. One actor.
class Mission {
 public:
  Mission(const project::Plan& plan, MissionOptions options, Scheduler& scheduler, Stream& stream,
          std::vector<std::unique_ptr<LeafDriver>> drivers);

  /// Schedules the first tick. `ended` is called once, in the mission's actor, when nothing is left to do.
  void start(std::function<void()> ended);
  /// Halts the tree; `ended` follows when the leaves have halted, or after the halt deadline.
  void stop();

  /// From the drivers, in any thread, with no lock held.
  void answered(std::size_t leaf, std::uint64_t tick, bt::Status status, Map outputs);
  void halted(std::size_t leaf);

  [[nodiscard]] ActorId actor() const { return actor_; }
  // For reports, after the run.
  [[nodiscard]] bt::Status status() const { return root_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }
  [[nodiscard]] TickTiming timing() const;
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
  [[nodiscard]] const bt::State& state() const { return state_; }

 private:
  struct Leaf {
    const project::LeafPlan* plan = nullptr;
    std::unique_ptr<LeafDriver> driver;
    std::uint64_t outstanding = 0;            // number of the tick not yet answered; 0: none
    std::uint64_t call = 0;                   // of that tick, joins request and reply
    std::uint64_t halt_call = 0;              // of the outstanding halt; 0: none
    TimePoint asked{};                        // when that tick was sent
    std::optional<bt::Status> lateness_told;  // as what a missing answer counted; told once until it answers
    std::optional<bt::Input> late;            // a completed answer that came too late for its tick
    // What a skill that has ended said while its leaf was forced to be RUNNING; its next tick gets it.
    std::optional<bt::Input> held;
  };
  // Of the leaf that was ticked last: no other is waited for.
  struct AnswerDeadline {
    std::size_t leaf = 0;
    std::uint64_t tick = 0;
    TimePoint when{};
  };
  struct StatusEvents;

  void on_period();
  void plan_next_tick(TimePoint by_rate);
  void run(bt::Input input);
  void follow(const std::vector<bt::Effect>& effects);
  void tick_leaf(const bt::Effect& effect);
  // What stands may make the leaf say something else. True: it does.
  bool force(Leaf& leaf, bt::Status& status, Map& outputs);
  void watch_deadline();
  void on_deadline(AnswerDeadline deadline);
  void tell_late(Leaf& leaf, bt::Status counts_as, const std::string& why);
  void finish_tick(bt::Status status);
  void check_end();
  void publish(MessageKind kind, std::string source, std::string target, std::string name, Value data,
               std::uint64_t call = 0);
  [[nodiscard]] Duration stretched(Duration wall) const;
  [[nodiscard]] std::size_t index_of(bt::NodeId node) const;
  void problem(std::string what);

  const project::Plan& plan_;
  MissionOptions options_;
  Scheduler& scheduler_;
  Stream& stream_;
  ActorId actor_;
  bt::State state_;
  bt::Effects effects_;
  std::vector<Leaf> leaves_;
  std::vector<std::size_t> leaf_of_node_;
  std::shared_ptr<StatusEvents> observer_;
  std::function<void()> ended_;

  std::uint64_t next_tick_ = 0;  // ticks of leaves, numbered
  std::uint64_t ticks_ = 0;      // of the root
  TimePoint planned_{};
  std::size_t given_tick_ = 0;  // of the options' tick times
  TimePoint began_{};
  TimePoint timer_at_ = kNever;
  AnswerDeadline deadline_;
  TimePoint deadline_timer_ = kNever;  // rings no later than deadline_
  bool stopping_ = false;
  bool over_ = false;  // root completed or halted; only outstanding halts are awaited
  bool done_ = false;
  bt::Status root_ = bt::Status::kIdle;
  std::string reason_;
  std::uint64_t missed_ = 0;
  std::vector<Duration> lateness_;
  std::vector<Duration> durations_;
  std::vector<std::string> problems_;
};

/// Problems kept for the report; more are counted only.
inline constexpr std::size_t kProblemsMax = 100;
/// Ticks whose timing is kept for medians; beyond that the newest replace the oldest.
inline constexpr std::size_t kTimingsMax = 1U << 16U;

}  // namespace sentree::runtime
