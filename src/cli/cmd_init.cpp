#include "sentree/cli/commands.h"

#include <fmt/format.h>
#include "sentree/cli/output.h"
#include "sentree/cli/shell_word.h"
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
  const std::string folder = shell_word(command.folder);
  say(fmt::format("\nNow try:\n  sentree check {0}\n  sentree run {0} --clock virtual\n  sentree test {0}", folder));
  return kOk;
}

}  // namespace sentree::cli
