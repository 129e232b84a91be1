#pragma once

#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

/// `sentree verify --against RUN.mcap`: which replies of a recording the models do not allow. Returns the exit code.
/// @param plan  With the project's own models only.
[[nodiscard]] int verify_against(const VerifyCommand& command, const project::Plan& plan);

}  // namespace sentree::cli
