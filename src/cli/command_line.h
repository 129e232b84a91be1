#pragma once

#include <functional>
#include <vector>

namespace CLI {
class App;
}

namespace sentree::cli {

/// A command of the program, whose options are known to CLI11.
struct Command {
  const CLI::App* app;
  std::function<int()> work;  ///< Once they have been read; returns the exit code.
};
/// A command stands behind those that are part of it.
using Commands = std::vector<Command>;

// In the order in which the help has them.
void add_project_commands(CLI::App& app, Commands& commands);
void add_run_commands(CLI::App& app, Commands& commands);
void add_file_commands(CLI::App& app, Commands& commands);
void add_service_commands(CLI::App& app, Commands& commands);
void add_machine_commands(CLI::App& app, Commands& commands);

struct TreeOptions;
/// What several commands have: where the types of a tree's nodes are looked for …
void add_trees(CLI::App& sub, TreeOptions& options);
/// … and whether code that a recording brings is loaded.
void add_allow_plugins(CLI::App& sub, bool& allowed);

}  // namespace sentree::cli
