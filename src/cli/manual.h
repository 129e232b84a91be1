#pragma once

#include <string>

namespace CLI {
class App;
}

namespace sentree::cli {

/// Writes sentree.1 and sentree-COMMAND.1 for each command, in man's macros, made of the commands' own help.
/// @returns an exit code; what went wrong is said.
[[nodiscard]] int write_manual(const CLI::App& app, const std::string& folder);

}  // namespace sentree::cli
