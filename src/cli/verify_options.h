#pragma once

#include "sentree/cli/commands.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

/// What is verified: the scenario that the command line names, or the project alone. Codes: those of `load_scenario`
/// and `load_project`.
[[nodiscard]] Loaded<project::Scenario> load_verified(const VerifyCommand& command);

/// "2 GB" in bytes; nothing: it is no size.
[[nodiscard]] std::optional<std::uint64_t> bytes_of(const std::string& text);

/// What the command line and the project's `verify:` ask of an exploration. False: said what is wrong.
[[nodiscard]] bool read_options(const VerifyCommand& command, const project::Plan& plan, verify::Asked& asked);

}  // namespace sentree::cli
