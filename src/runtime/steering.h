#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/mission/apply.h"
#include "sentree/mission/faults.h"
#include "sentree/project/check_intervention.h"
#include "sentree/project/intervention.h"
#include "sentree/runtime/services.h"

namespace sentree::runtime {

/// Steers a run while it goes on. From any thread but the run's own (its listeners and callbacks): what has an outcome
/// waits until it has happened.
///
/// `pause`, `resume`, `step`, `run_until` and `set_factor` change when things happen on the wall clock, not what
/// happens, and leave no trace. Everything else is an intervention: it is observed as "scenario.injection", and in
/// virtual time the same interventions at the same times give the same observations, byte for byte.
class Steering {
 public:
  enum class State { kRunning, kPaused, kEnded };
  struct Status {
    State state = State::kRunning;
    double factor = 0.0;           ///< Run seconds per wall second; 0: as fast as the machine allows.
    std::uint64_t breakpoint = 0;  ///< Number of the breakpoint at which it paused; 0: none.
    std::string stopped_at;        ///< What was reached there, e.g. "GoToKitchen is RUNNING".
  };

  virtual ~Steering() = default;

  [[nodiscard]] virtual Status status() const = 0;
  /// Blocks until the run is paused, with nothing left to do at that time, or has ended.
  virtual Status wait_paused() = 0;
  /// What a view shows as now.
  [[nodiscard]] virtual TimePoint time() const = 0;

  // Errors of everything below: steering.ended (the run is over), steering.busy (too many commands wait),
  // steering.inside (called by the run itself).

  virtual Result<void> pause() = 0;
  virtual Result<void> resume() = 0;
  /// Goes on until `ticks` more root ticks have begun and been done, then pauses.
  virtual Result<void> step(std::uint64_t ticks = 1) = 0;
  /// Goes on until all that comes before `time` has happened, then pauses.
  virtual Result<void> run_until(TimePoint time) = 0;
  /// Run seconds per wall second, from kFactorMin to kFactorMax; 0: as fast as the machine allows (virtual time only).
  /// Error: steering.factor.
  virtual Result<void> set_factor(double factor) = 0;

  using Applied = mission::Applied;
  /// Errors: steering.* with the names that there are. A run that was paused goes on to be stopped.
  Result<Applied> apply(const project::Intervention& what) { return apply_for(what, "studio"); }
  /// The same for somebody else than the studio, as the observation says.
  virtual Result<Applied> apply_for(const project::Intervention& what, const std::string& source) = 0;

  [[nodiscard]] virtual std::vector<mission::StandingIntervention> standing() const = 0;
  [[nodiscard]] virtual std::vector<project::SteeredPart> parts() const = 0;
  /// The run so far as a scenario that does the same again: the text of a file in the project's scenarios/ folder.
  [[nodiscard]] virtual Result<std::string> scenario() const = 0;
};

}  // namespace sentree::runtime
