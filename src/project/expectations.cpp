#include "sentree/project/expectations.h"

namespace sentree::project {

bool expects_anything(const Scenario& scenario) {
  return scenario.mission || !scenario.mission_reason.empty() || !scenario.verdicts.empty() ||
         scenario.distinct_processes;
}

}  // namespace sentree::project
