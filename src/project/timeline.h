#pragma once

#include "sentree/project/project.h"
#include "sentree/project/yaml_reader.h"

namespace sentree::project {

/// What an entry of a timeline does: one of call, stop, kill, restart, delay, falsify, force, breakpoint and clear.
/// Codes: scenario.*, project.*.
[[nodiscard]] Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics);

/// `timeline:` of a scenario. Codes: as `read_intervention`.
void read_timeline(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics);

}  // namespace sentree::project
