#pragma once

#include "sentree/monitor/monitor.h"

namespace sentree::monitor {

/// A monitor that decides the same at the same times, but keeps no observations: its decisions have no witness. For
/// whoever wants verdicts of many runs.
[[nodiscard]] Model without_witnesses(const Model& model);
/// Whether observations that it is given must outlive its step.
[[nodiscard]] bool keeps_observations(const Model& model);

}  // namespace sentree::monitor
