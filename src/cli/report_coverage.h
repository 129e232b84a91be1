#pragma once

#include <string>

#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

/// HTML of what a recorded run has reached of its charts, calls and requirements: counts, what it never reached, and
/// the charts with that written into them. Why not, where it cannot be executed again.
/// @param plan  Of the recording.
[[nodiscard]] std::string coverage_section(const ReportCommand& command, const project::Plan& plan);

}  // namespace sentree::cli
