#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/mission/tree.h"
#include "sentree/runtime/problems.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// How the mission reaches the skill of one leaf, wherever that runs. Called in the mission's actor; never blocks.
class LeafDriver {
 public:
  virtual ~LeafDriver() = default;
  /// Answered by `Mission::answered` with its number, once at most.
  /// @param asked  When the request was published.
  virtual void tick(mission::TickSkill what, TimePoint asked) = 0;
  /// Answered by `Mission::halted`.
  virtual void halt(TimePoint asked) = 0;
  /// The run is given up; no answer is expected, late ones are ignored.
  /// @param asked  When that was published; kNever: it was not.
  virtual void cancel(TimePoint asked) = 0;
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

/// What a mission tells and asks, in its actor; any may be empty.
struct MissionHooks {
  /// When the mission gives up waiting for the answer of a leaf that it has just ticked; time 0: as the deadlines say.
  std::function<TimePoint(std::size_t leaf)> due;
  /// A root tick has been done.
  std::function<void(std::uint64_t tick)> tick_done;
  /// Told once, when nothing is left to do.
  std::function<void()> ended;
};

/// The mission of a run, in an actor of its own.
class Mission final : private mission::TreeHost {
 public:
  /// @param factor  Run seconds per wall second, for `timing`.
  Mission(mission::TreeModel model, double factor, Scheduler& scheduler, Stream& stream, StandingFaults& faults,
          std::vector<std::unique_ptr<LeafDriver>> drivers, MissionHooks hooks);

  /// Schedules the first tick.
  void start() { machine_.start(state_, *this); }
  /// Halts the tree; the hook `ended` follows when the leaves have halted, or after the halt deadline.
  void stop() { deliver(mission::Stop{}); }

  /// From the drivers, in any thread, with no lock held.
  void answered(std::size_t leaf, std::uint64_t tick, bt::Status status, Map outputs);
  void halted(std::size_t leaf);

  [[nodiscard]] ActorId actor() const { return actor_; }
  /// What it remembers: of its actor, and of anybody while nothing is executed.
  [[nodiscard]] mission::TreeState& state() { return state_; }
  [[nodiscard]] const mission::TreeState& state() const { return state_; }
  // For reports, after the run.
  [[nodiscard]] TickTiming timing() const;
  [[nodiscard]] std::vector<std::string> problems() const { return problems_.list(); }

 private:
  void tell_stopped();

  TimePoint now() const override { return scheduler_.now(); }
  void publish(Message message) override { stream_.publish(std::move(message)); }
  bool is_heard(mission::ObservationName& name) override { return stream_.is_heard(name); }
  void pass() override { stream_.pass(); }
  std::uint64_t next_call() override { return stream_.next_call(); }
  void set_tick(std::uint64_t tick) override { stream_.set_tick(tick); }
  void tick(std::size_t leaf, std::uint64_t tick, bool started, const Map& inputs) override {
    drivers_[leaf]->tick({tick, started, inputs}, state_.leaves.at(leaf).asked);
  }
  void halt(std::size_t leaf, TimePoint asked) override { drivers_[leaf]->halt(asked); }
  void cancel(std::size_t leaf, TimePoint asked) override { drivers_[leaf]->cancel(asked); }
  void deliver(mission::TreeDelivery what) override { scheduler_.post(actor_, addressed(std::move(what))); }
  void deliver_at(TimePoint when, mission::Rank rank, mission::TreeDelivery what) override {
    scheduler_.at(actor_, when, rank, addressed(std::move(what)));
  }
  std::optional<bt::Status> forced(std::string_view leaf) override { return faults_.forced(leaf); }
  TimePoint due(std::size_t leaf) override { return hooks_.due ? hooks_.due(leaf) : TimePoint{}; }
  void tick_began(Duration late) override;
  void tick_done(std::uint64_t tick, Duration took) override;
  void problem(std::string what) override;
  void ended() override {
    if (hooks_.ended) hooks_.ended();
  }
  static mission::Delivery addressed(mission::TreeDelivery what) { return {mission::Delivery::kTree, std::move(what)}; }

  const double factor_;
  Scheduler& scheduler_;
  Stream& stream_;
  StandingFaults& faults_;
  std::vector<std::unique_ptr<LeafDriver>> drivers_;
  MissionHooks hooks_;
  mission::TreeMachine machine_;
  mission::TreeState state_;
  ActorId actor_;
  std::vector<Duration> lateness_;
  std::vector<Duration> durations_;
  Problems problems_;
};

/// Ticks whose timing is kept for medians; beyond that the newest replace the oldest.
inline constexpr std::size_t kTimingsMax = 1U << 16U;

}  // namespace sentree::runtime
