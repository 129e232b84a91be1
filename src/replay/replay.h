#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sentree/replay/behaviour.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/runtime/run.h"

namespace sentree::replay {

/// How many periods, or ticks, of the mission earlier or later than it was recorded a request may come and still get
/// its recorded outcome.
inline constexpr std::uint64_t kReplayTicksMax = 10;
/// Differences that are kept.
inline constexpr std::size_t kDifferencesMax = 100;

struct ReplayReport {
  runtime::RunReport run;
  std::uint64_t recorded_requests = 0;
  std::uint64_t answered_requests = 0;  ///< Those that were made again.
  std::vector<Difference> differences;  ///< The first of each leaf, of the mission and of each monitor, by time.
  /// The first request that was not recorded, e.g. `GoToStation asks navigation.stopNavigation({"goal_id":1})`; empty:
  /// there was none.
  std::string unrecorded;
  TimePoint unrecorded_at{};
  bool continued = false;  ///< The simulator took over there.
  /// The snapshot from which the run went on, nothing of what was before being executed; time 0: its beginning.
  /// Nothing: services answered as recorded.
  std::optional<TimePoint> restored;
  /// Everything at the moment that was asked for: what a snapshot of the recording has (see snapshot.h), and `time`,
  /// `tick`, `nodes` (status by path, of those not idle), each skill's `states` and `data`, each monitor's `standing`.
  std::optional<Map> moment;
};

struct ReplayOptions {
  /// At the first request that was not recorded, restore the simulator to that moment and go on with it.
  bool go_on = false;
  /// Let the simulator take over at this moment, whatever is asked; at the end of the run it is as `at`.
  std::optional<TimePoint> go_on_at = {};
  /// End when everything up to and including this moment has happened, and tell what the state is then.
  std::optional<TimePoint> at = {};
  runtime::RunOptions run;
};

/// Runs the mission of `plan` again in virtual time: its skills, tree and monitors are executed, and its services
/// answer what they answered in the recording, as long after the request as then. The recording's interventions
/// happen again at their times. A skill that was killed in a process of its own is killed here, until that was
/// restarted.
///
/// Of a recording in virtual time models of components are executed as well, and faults on calls are put on them again:
/// what an unchanged plan does is the recorded run, observation for observation. In real time models, and faults on
/// calls, are in what was answered then.
///
/// Behaviour is what leaves answer and ask, what the mission's status is and what monitors decide; of a recording in
/// real time the order in each of them counts, of one in virtual time the tick as well. A plan with parts elsewhere is
/// replayed in this process.
///
/// A moment (`at`, `go_on_at`) of a run in virtual time of this very plan is reached from the last snapshot before it,
/// in the simulator: what the run did then it does again. Cost: what lies between that snapshot and the moment.
///
/// Of a recording in real time, what passes between mission and skills arrives when it did then, however late the
/// machine was; virtual time has no lateness of its own. Ticks, halts, timers and topics that a skill took behind what
/// came later are taken where the recording says so ("<leaf>.tick.taken" and the like).
/// Errors: record.*, json.*, replay.foreign-skill, replay.after-end (a moment behind the end of the run),
/// replay.continued (a run that was resumed has no beginning of its own).
[[nodiscard]] Result<ReplayReport> replay(RecordedRun& recorded, project::Plan plan, ReplayOptions options);

}  // namespace sentree::replay
