#pragma once

#include <optional>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/scxml/enabled.h"

namespace sentree::monitor {

/// A monitor that decides the same at the same times, but keeps no observations: its decisions have no witness. For
/// whoever wants verdicts of many runs.
[[nodiscard]] Model without_witnesses(const Model& model);
/// Whether observations that it is given must outlive its step.
[[nodiscard]] bool keeps_observations(const Model& model);
/// As `scxml::enabled_by`, told from the observation where it is. Nothing: only that can tell.
[[nodiscard]] std::optional<std::vector<scxml::TransitionIndex>> enabled_plainly(const Model& model, const Core& core,
                                                                                 const Message& message);
/// `vacuity` would say nothing.
[[nodiscard]] bool was_tested(const Model& model, const State& state);

}  // namespace sentree::monitor
