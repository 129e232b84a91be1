#pragma once

#include <memory>
#include <optional>

#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/sim/world.h"

namespace sentree::campaign {

/// Runs of one mission with the simulated robot, whose steps are remembered from run to run (`mission::PartMemory`):
/// the robot and the monitors are all that is executed. For runs that go well; every other one is left to who executes
/// it.
///
/// What it says of a run is what `runtime::Run` says of it, to the number of observations.
class QuickRuns {
 public:
  /// Null: the mission is none for it. It may have parts in other processes, models, gates, topics, or scripts that
  /// need an interpreter for JavaScript.
  /// @param plan  Borrowed; its scenario and its world may change between runs.
  [[nodiscard]] static std::unique_ptr<QuickRuns> of(const project::Plan& plan);
  ~QuickRuns();
  QuickRuns(const QuickRuns&) = delete;
  QuickRuns& operator=(const QuickRuns&) = delete;

  struct Done {
    runtime::RunReport report;
    double battery_least = 1.0;
    double battery_end = 1.0;
  };
  /// @param scenario  That of the plan when it was made, but for seed, timeline and duration.
  /// @param world     As varied.
  /// @returns nothing if the run must be executed to know what comes of it: the mission did not succeed, a requirement
  /// was violated, or something was done to it that this does not know.
  [[nodiscard]] std::optional<Done> run(const project::Scenario& scenario, const sim::World& world);

  /// Of all runs; those whose memory was dropped since it had grown too large included.
  [[nodiscard]] std::uint64_t steps_executed() const;

 private:
  class Impl;
  explicit QuickRuns(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::campaign
