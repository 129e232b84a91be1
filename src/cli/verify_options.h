#pragma once

#include "sentree/cli/commands.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

/// What the command line and the project's `verify:` ask of an exploration. False: said what is wrong.
[[nodiscard]] bool read_options(const VerifyCommand& command, const project::Plan& plan, verify::Asked& asked);

}  // namespace sentree::cli
