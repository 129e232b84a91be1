#include <algorithm>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::cli {

int init(const InitCommand& command) {
  const std::filesystem::path target(command.folder);
  std::error_code error;
  if (std::filesystem::exists(target, error) && !std::filesystem::is_empty(target, error)) {
    say(command.folder + ": exists and is not empty; choose another folder");
    return kInvalidInput;
  }
  const std::filesystem::path source = project::shipped_folder("examples") / "minimal";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(source, error)) {
    if (entry.is_regular_file()) files.push_back(std::filesystem::relative(entry.path(), source));
  }
  if (files.empty()) {
    say("the example that a new project starts from is missing; Sentree is not installed whole");
    return kEnvironment;
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    const auto content = text::read_file(source / file);
    std::filesystem::create_directories((target / file).parent_path(), error);
    const auto written =
        content ? text::write_file(target / file, *content) : Result<void>(tl::unexpected(content.error()));
    if (!written) {
      say(to_string(written.error()));
      return kEnvironment;
    }
    print((target / file).string() + "\n");
  }
  say("\nNow try:\n  sentree check " + command.folder + "\n  sentree run " + command.folder +
      " --clock virtual\n  sentree test " + command.folder);
  return kOk;
}

}  // namespace sentree::cli
