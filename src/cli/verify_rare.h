#pragma once

#include "sentree/cli/commands.h"
#include "sentree/cli/verify_options.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

/// `sentree verify --split`: prints how likely requirements are violated that hardly ever are. Returns the exit code.
[[nodiscard]] int verify_rare(const VerifyCommand& command, const project::Plan& plan, const Sampled& sampled);

}  // namespace sentree::cli
