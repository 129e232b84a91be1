#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "sentree/campaign/coverage.h"
#include "sentree/replay/behaviour.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/history.h"

namespace sentree::studio {

/// Observations of a shadow run; one that makes more is ended there.
inline constexpr std::size_t kShadowObservationsMax = 2'000'000;

/// Whether all parts of a plan can run in this process, beside what they are otherwise. Error: shadow.elsewhere (parts
/// in other processes or at addresses).
[[nodiscard]] Result<void> runs_here(const project::Plan& plan);

/// A scenario as it goes with what is edited: run in virtual time, as fast as the machine allows, recorded nowhere.
class Shadow {
 public:
  /// Errors: those of `runs_here`, and what prevents a run. Returns early once `stop` is true.
  [[nodiscard]] static Result<std::shared_ptr<const Shadow>> run(project::Plan plan, const std::atomic<bool>& stop);

  const project::Plan plan;
  const Subject subject;
  History history;
  replay::Behaviour behaviour;
  campaign::Coverage coverage;
  runtime::RunReport report;
  bool whole = true;  ///< False: it was ended before its scenario was.

  explicit Shadow(project::Plan scenario) : plan(std::move(scenario)), subject(plan), history(subject) {}
};

}  // namespace sentree::studio
