#include "sentree/project/expectations.h"

namespace sentree::project {

bool expects_anything(const Scenario& scenario) {
  return scenario.mission || !scenario.mission_reason.empty() || !scenario.verdicts.empty() ||
         scenario.distinct_processes;
}

void check_expectations(const Scenario& scenario, Diagnostics& diagnostics) {
  if (expects_anything(scenario)) return;
  SourceSpan place = scenario.source.span;
  place.file = scenario.file;
  add(diagnostics, Severity::kNote, "scenario.expect",
      "the scenario expects nothing, so that no test of it fails; write expect: {mission: SUCCESS}, or verdicts of "
      "monitors",
      place);
}

}  // namespace sentree::project
