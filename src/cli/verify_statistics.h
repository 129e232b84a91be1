#pragma once

#include <vector>

#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"

namespace sentree::cli {

/// `sentree verify --runs` and `--at-least`: prints how often requirements are violated. Returns the exit code.
/// @param any  Models that were made for the services without one.
[[nodiscard]] int verify_by_runs(const VerifyCommand& command, const project::Plan& plan,
                                 const std::vector<verify::MadeModel>& any);

}  // namespace sentree::cli
