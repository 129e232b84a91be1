#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/projection.h"

namespace sentree::monitor {

/// The inside of `Model`; for this library's own files.
struct Model::Parts {
  Spec spec;
  std::vector<Verdict> decides;  ///< By state: what its entry decides.
  std::vector<bool> pending;     ///< By state: something is owed while it is active.
  bool has_data = false;
  bool listens_to_all = false;
  std::vector<std::string> descriptors;  ///< Event descriptors of the chart's transitions.
  Projection projection;                 ///< What it looks at.
  /// Computes the data of renamed events: event "<i>" in, effect send "<i>" with the data out.
  std::optional<scxml::Chart> renaming;
};

struct Access {
  static const Model::Parts& parts(const Model& model) { return *model.parts_; }
};

/// As the public ones, with the event's data made already.
Decisions observe(const Model& model, State& state, const Observation& observation, const scxml::Event& event,
                  scxml::ExecutionWatch* watch);

/// Gives `decision` its witness: the smallest part of `state.history` (one-minimal) after which it comes again.
void find_witness(const Model& model, const State& state, Decision& decision, scxml::ExecutionWatch* watch);
/// Keeps of the history only what leads to the present session, as far as that can be found quickly.
void reduce_history(const Model& model, State& state, scxml::ExecutionWatch* watch);

/// What one step of the chart did.
struct Stepped {
  Verdict verdict = Verdict::kUndecided;
  std::string state;
};
/// The pieces that a replay is made of: the beginning, one observation with the timers before it, and timers alone.
/// Timers stop at the first decision.
[[nodiscard]] State begin_replay(const Model& model, TimePoint now, scxml::ExecutionWatch* watch);
Stepped replay_message(const Model& model, State& state, const Observation& observation, const scxml::Event* event,
                       scxml::ExecutionWatch* watch);
Stepped replay_timers(const Model& model, State& state, TimePoint up_to, const Observation& during,
                      scxml::ExecutionWatch* watch);

}  // namespace sentree::monitor
