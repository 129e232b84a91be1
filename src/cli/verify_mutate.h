#pragma once

#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

/// `sentree verify --mutate`: which small changes of the mission and of its skills no requirement notices. Returns the
/// exit code.
/// @param plan  As it is verified, with models.
[[nodiscard]] int verify_mutants(const VerifyCommand& command, const project::Plan& plan);

}  // namespace sentree::cli
