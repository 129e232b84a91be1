#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/bt/tree.h"
#include "sentree/runtime/plan.h"
#include "sentree/runtime/steering.h"

namespace sentree::runtime {

/// What interventions may name. Borrowed; null where it is not known, which is then not checked.
struct InterventionScope {
  const Scenario* scenario = nullptr;
  const bt::Tree* tree = nullptr;
  const std::vector<LeafPlan>* leaves = nullptr;
  const std::map<std::string, ServicePlan>* services = nullptr;
  idl::ServicePtr test_control;
  const sim::World* world = nullptr;
  const std::vector<monitor::Model>* monitors = nullptr;
};
[[nodiscard]] InterventionScope scope_of(const Plan& plan);

/// Name under which the simulator of this process is killed: all of its services.
inline constexpr std::string_view kSimulatorPart = "sim";

/// Whether the things that an intervention names are there, with the names that there are, and what it says of them
/// fits. Codes: steering.*, scenario.call, scenario.kill, and those of `idl::conform`.
[[nodiscard]] Result<void> check_intervention(const Intervention& what, const InterventionScope& scope,
                                              const SourceSpan& span = {});

/// Everything that can be killed and restarted.
[[nodiscard]] std::vector<SteeredPart> parts_of(const InterventionScope& scope);

}  // namespace sentree::runtime
