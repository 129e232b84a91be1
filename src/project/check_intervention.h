#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/bt/tree.h"
#include "sentree/project/plan.h"

namespace sentree::project {

/// What interventions may name. Borrowed; null where it is not known, which is then not checked.
struct InterventionScope {
  const Scenario* scenario = nullptr;
  const bt::Tree* tree = nullptr;
  const std::vector<LeafPlan>* leaves = nullptr;
  const std::map<std::string, ServicePlan>* services = nullptr;
  idl::ServicePtr test_control;
  const sim::World* world = nullptr;
  const std::vector<monitor::Model>* monitors = nullptr;
  const monitor::Vocabulary* vocabulary = nullptr;
};
[[nodiscard]] InterventionScope scope_of(const Plan& plan);

/// Name under which the simulator of this process is killed: all of its services.
inline constexpr std::string_view kSimulatorPart = "sim";

/// Whether the things that an intervention names are there, with the names that there are, and what it says of them
/// fits. Codes: steering.*, scenario.call, scenario.kill, and those of `idl::conform`.
[[nodiscard]] Result<void> check_intervention(const Intervention& what, const InterventionScope& scope,
                                              const SourceSpan& span = {});

/// A `clear` of the timeline for whose number nothing can stand by then, as faults are numbered as they come.
[[nodiscard]] std::optional<Diagnostic> doubt_about_number(const Scenario& scenario, const Injection& injection);

/// What may well be meant, but is likely a slip: a falsified value beyond the IDL's range, a breakpoint at what nothing
/// in the project is observed as.
[[nodiscard]] std::optional<Diagnostic> doubt_about(const Intervention& what, const InterventionScope& scope,
                                                    const SourceSpan& span);

/// Something that can be killed and restarted.
struct SteeredPart {
  std::string name;
  std::string kind;      ///< "skill", "component" or "monitor".
  bool process = false;  ///< In a process of its own.
};

/// Everything that can be killed and restarted.
[[nodiscard]] std::vector<SteeredPart> parts_of(const InterventionScope& scope);

/// The member of a result that `path` names ("pose.x", "names.0"; empty: the result), by type. Error: steering.path.
[[nodiscard]] Result<const idl::Type*> type_at(const idl::Type& type, std::string_view path);

/// Puts `value` where `path` leads in `at`. False: there is no such place, and nothing has changed but for members that
/// a map of the way lacked.
[[nodiscard]] bool put_at(Value& at, std::string_view path, const Value& value);

}  // namespace sentree::project
