#include "sentree/cli/commands.h"

#include <fmt/format.h>
#include "sentree/cli/output.h"
#include "sentree/design/parts.h"

namespace sentree::cli {

int init(const InitCommand& command) {
  const std::filesystem::path target(command.folder);
  const auto files = design::begin_project(target);
  if (!files) {
    const Diagnostic& error = files.error();
    say(error.code == "design.not-empty" || error.code == "design.not-installed" ? error.message : to_string(error));
    return error.code == "design.not-empty" ? kInvalidInput : kEnvironment;
  }
  for (const auto& file : *files) print((target / file).string() + "\n");
  say(fmt::format("\nNow try:\n  sentree check {}\n  sentree run {} --clock virtual\n  sentree test {}", command.folder,
                  command.folder, command.folder));
  return kOk;
}

}  // namespace sentree::cli
