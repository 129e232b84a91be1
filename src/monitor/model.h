#pragma once

#include <cstdint>
#include <map>
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
  bool forgoes_witnesses = false;  ///< See `without_witnesses`.
  bool listens_to_all = false;
  std::vector<std::string> descriptors;  ///< Event descriptors of the chart's transitions.
  Projection projection;                 ///< What it looks at.
  /// Computes the data of renamed events: event "rename<i>" in, <send> with the data out; and whether they come: event
  /// "when<i>" in, a <send> if so.
  std::optional<scxml::Chart> renaming;
  std::vector<std::optional<std::size_t>> last_of;  ///< By rename: its place in `Core::last`, if its event looks back.
  std::size_t lasts = 0;
  /// By observation: the only ones whose it is about. Of names that are not here it is about everybody's.
  std::map<std::string, std::vector<std::string>, std::less<>> only_of;
  // Data, by slot, that every observation overwrites before anything reads them: of the chart, and of `renaming`.
  std::vector<bool> overwritten;
  std::vector<bool> renamed;
};

struct Access {
  static const Model::Parts& parts(const Model& model) { return *model.parts_; }
  static void exchange(Model& model, Model::Parts parts) {
    model.parts_ = std::make_shared<const Model::Parts>(std::move(parts));
  }
};

/// Whether `name` fits one of the patterns.
[[nodiscard]] bool is_one_of(std::string_view name, const std::vector<std::string>& patterns);

/// Where a step leaves its trail; null: nowhere.
struct Tracing {
  Trail* trail = nullptr;
  Observation during = {};  ///< Null: no observation.
};

// As the public ones, with a trail, and with the event made already (null: not yet). They know no decided monitor.
[[nodiscard]] Core begin(const Model& model, TimePoint now, const Tracing& tracing, scxml::ExecutionWatch* watch);
Stepped step(const Model& model, Core& core, const Message& message, const scxml::Event* event, const Tracing& tracing,
             scxml::ExecutionWatch* watch);
Stepped step_timers(const Model& model, Core& core, TimePoint until, const Tracing& tracing,
                    scxml::ExecutionWatch* watch);
Decisions observe(const Model& model, State& state, const Observation& observation, const scxml::Event* event,
                  scxml::ExecutionWatch* watch);

/// Gives `decision` its witness: the smallest part of the history (one-minimal) after which it comes again.
void find_witness(const Model& model, const Trail& trail, Decision& decision, scxml::ExecutionWatch* watch);
/// Keeps of the history only what leads to the present session, as far as that can be found quickly.
void reduce_history(const Model& model, State& state, scxml::ExecutionWatch* watch);

}  // namespace sentree::monitor
