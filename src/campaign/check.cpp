#include "sentree/campaign/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/base/told_once.h"
#include "sentree/campaign/runner.h"
#include "sentree/project/check_unnamed.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"

namespace sentree::campaign {

namespace {

namespace fs = std::filesystem;

// By its text: one that does not parse is told too.
bool has_one_of(const fs::path& file, std::initializer_list<std::string_view> keys) {
  if (file.extension() != ".yaml") return false;
  const auto source = text::read_file(file);
  if (!source) return false;
  const std::string text = "\n" + *source;
  const auto has = [&](std::string_view key) { return text.find(fmt::format("\n{}:", key)) != std::string::npos; };
  return !has("mission") && std::any_of(keys.begin(), keys.end(), has);
}

Diagnostics check_scenario(const fs::path& file, const project::Project& project, project::PartCache& parts) {
  auto scenario = project::load_scenario(file, &project);
  if (scenario.ok()) scenario.diagnostics = project::prepare(std::move(*scenario.value), parts).diagnostics;
  return std::move(scenario.diagnostics);
}

// What `verify` has written is no source of the project: that it was of another one is no error of this one.
void take_as_outdated(const fs::path& file, Diagnostics& diagnostics) {
  const auto source = text::read_file(file);
  if (!source || !source->starts_with(project::kFoundByVerify)) return;
  const auto is_own_error = [&](const Diagnostic& one) {
    return one.severity == Severity::kError && one.span.file == file.string();
  };
  const auto first = std::find_if(diagnostics.begin(), diagnostics.end(), is_own_error);
  if (first == diagnostics.end()) return;
  Diagnostic outdated = *first;
  outdated.severity = Severity::kWarning;
  outdated.code = "check.outdated-behaviour";
  outdated.message = fmt::format(
      "`sentree verify` found this behaviour in the project as it was before: {}; verify it again, or delete this file",
      outdated.message);
  std::erase_if(diagnostics, is_own_error);
  diagnostics.push_back(std::move(outdated));
}

Diagnostics check_vary_with(const fs::path& file, project::PartCache& parts) {
  const fs::path folder = file.parent_path();
  return Runner::load(folder.empty() ? fs::path(".") : folder, file, parts).diagnostics;
}

}  // namespace

bool is_vary(const fs::path& file) {
  return file.filename() == "campaign.yaml" || has_one_of(file, {"parameters", "faults", "runs"});
}

Diagnostics check_vary(const fs::path& file) {
  project::PartCache parts;
  return check_vary_with(file, parts);
}

Diagnostics check_project(const fs::path& folder_or_file) {
  project::PartCache parts;
  Diagnostics all;
  ToldOnce told;
  const auto add = [&](const Diagnostics& found) { told.append(found, all); };
  add(project::check_project(folder_or_file, parts));
  const auto project = project::load_project(folder_or_file);
  if (!project.ok()) return all;
  const fs::path& folder = project.value->folder;
  std::error_code error;
  if (fs::exists(folder / "campaign.yaml", error)) add(check_vary_with(folder / "campaign.yaml", parts));
  std::set<fs::path> elsewhere;
  for (auto entry = fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const bool is_left_out = name.starts_with('.') || name == "scenarios" || name == "runs" || name == "campaign" ||
                             entry.depth() >= kFolderDepthMax || fs::exists(entry->path() / "sentree.yaml", error);
    if (entry->is_directory(error)) {
      if (is_left_out) entry.disable_recursion_pending();
    } else if (entry.depth() > 0 && has_one_of(entry->path(), {"override", "timeline", "expect"})) {
      elsewhere.insert(entry->path());
    }
  }
  for (const fs::path& file : elsewhere) {
    Diagnostics found = check_scenario(file, *project.value, parts);
    take_as_outdated(file, found);
    add(found);
  }
  Diagnostics unnamed;
  project::check_unnamed(*project.value, unnamed);
  add(unnamed);
  return all;
}

}  // namespace sentree::campaign
