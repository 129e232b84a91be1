#pragma once

#include "sentree/project/project.h"
#include "sentree/scxml/chart.h"

namespace sentree::project {

/// Constants for <data> that the chart does not have. Code: check.skill-data.
void check_skill_data(const std::vector<SkillConstant>& constants, const scxml::Chart& chart, Diagnostics& diagnostics);

/// Whether the chart takes the events that the protocol gives it, and can answer as the protocol says.
/// Code: check.protocol.
void check_protocol(const SkillProtocol& protocol, const scxml::Chart& chart, Diagnostics& diagnostics);

}  // namespace sentree::project
