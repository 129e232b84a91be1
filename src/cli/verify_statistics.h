#pragma once

#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

/// `sentree verify --runs` and `--at-least`: prints how often requirements are violated. Returns the exit code.
[[nodiscard]] int verify_by_runs(const VerifyCommand& command, const project::Plan& plan);

}  // namespace sentree::cli
