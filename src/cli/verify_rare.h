#pragma once

#include <vector>

#include "sentree/cli/commands.h"
#include "sentree/cli/verify_options.h"
#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"

namespace sentree::cli {

/// `sentree verify --split`: prints how likely requirements are violated that hardly ever are. Returns the exit code.
/// @param any_replies  Models that were made for the services without one.
[[nodiscard]] int verify_rare(const VerifyCommand& command, const project::Plan& plan, const Sampled& sampled,
                              const std::vector<verify::MadeModel>& any_replies);

}  // namespace sentree::cli
