#include "sentree/monitor/carry.h"

#include <utility>

#include "sentree/monitor/detail/model.h"
#include "sentree/scxml/carry.h"

namespace sentree::monitor {

Loaded<State> carry(const Model& before, const State& state, const Model& after, TimePoint now) {
  const Model::Parts& was = Access::parts(before);
  const Model::Parts& is = Access::parts(after);
  auto session = scxml::carry(was.spec.chart, state.session, is.spec.chart);
  if (!session.ok()) return {std::nullopt, std::move(session.diagnostics)};
  // Where it would begin: what it renames by, and what it looks at first.
  State next = start(after, now);
  next.session = std::move(*session.value);
  next.verdict = state.verdict;
  next.since = state.since;
  for (std::size_t i = 0; i < is.last_of.size(); ++i) {
    for (std::size_t old = 0; is.last_of[i] && old < was.last_of.size(); ++old) {
      if (was.last_of[old] && was.spec.renames[old].event == is.spec.renames[i].event)
        next.last[*is.last_of[i]] = state.last[*was.last_of[old]];
    }
  }
  Trail& trail = next.trail;
  trail.violations = state.trail.violations;
  trail.seen = state.trail.seen;
  trail.started = state.trail.started;
  trail.history_complete = false;
  if (trail.test && before.test() != nullptr) {
    if (!state.trail.test) {
      trail.test.reset();
    } else if (auto test = scxml::carry(before.test()->chart(), state.trail.test->session, after.test()->chart());
               test.ok()) {
      trail.test->session = std::move(*test.value);
    }
  }
  const auto states = was.spec.chart.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto same = states[i].id.empty() ? std::nullopt : is.spec.chart.find(states[i].id);
    if (same) trail.entered_by.edit()[*same] = (*state.trail.entered_by)[i];
  }
  return {std::move(next), {}};
}

}  // namespace sentree::monitor
