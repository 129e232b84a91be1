#pragma once

#include "sentree/project/project.h"
#include "sentree/project/yaml_reader.h"

namespace sentree::project {

/// `timeline:` of a scenario. Codes: as `read_intervention`.
void read_timeline(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics);

}  // namespace sentree::project
