#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "sentree/replay/recorded_code.h"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace sentree::cli {

/// A command of the program, whose options are known to CLI11.
struct Command {
  const CLI::App* app;
  std::function<int()> work;  ///< Once they have been read; returns the exit code.
};
/// A command stands behind those that are part of it.
using Commands = std::vector<Command>;

/// The options of a command that is not part of another one, for CLI11 to fill; `work` gets them once they have been
/// read. They live as long as `commands`.
template <class Options>
[[nodiscard]] Options& options_for(const CLI::App* sub, Commands& commands, int (*work)(const Options&)) {
  const auto kept = std::make_shared<Options>();
  commands.push_back({sub, [kept, work] { return work(*kept); }});
  return *kept;
}

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
CLI::Option* add_allow_plugins(CLI::App& sub, replay::RecordedCode& code);

/// For options that are whole numbers: what is none, or out of range, is refused with the range. A recording, a
/// scenario and JSON hold numbers to 2^63 - 1.
[[nodiscard]] CLI::Validator whole_number(std::int64_t least,
                                          std::int64_t most = std::numeric_limits<std::int64_t>::max());

}  // namespace sentree::cli
