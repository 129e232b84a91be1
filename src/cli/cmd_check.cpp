#include <algorithm>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/runtime/plan.h"
#include "sentree/sim/world.h"

namespace sentree::cli {

namespace {

// The same finding may be reached through the project and through each of its scenarios.
void add_new(Diagnostics& all, const Diagnostics& found) {
  for (const Diagnostic& diagnostic : found) {
    if (std::find(all.begin(), all.end(), diagnostic) == all.end()) all.push_back(diagnostic);
  }
}

Diagnostics check_all(const std::string& path) {
  Diagnostics all;
  if (is_world(path)) return sim::load_world(path).diagnostics;
  auto project = runtime::load_project(path);
  add_new(all, project.diagnostics);
  if (!project.ok()) return all;
  const auto files = runtime::scenario_files(*project.value);
  add_new(all, runtime::prepare(runtime::plain_scenario(std::move(*project.value))).diagnostics);
  for (const auto& file : files) {
    auto scenario = runtime::load_scenario(file);
    add_new(all, scenario.diagnostics);
    if (scenario.ok()) add_new(all, runtime::prepare(std::move(*scenario.value)).diagnostics);
  }
  return all;
}

}  // namespace

int check(const CheckCommand& command) {
  const Diagnostics found = check_all(command.project);
  const auto errors =
      std::count_if(found.begin(), found.end(), [](const Diagnostic& d) { return d.severity == Severity::kError; });
  const auto warnings =
      std::count_if(found.begin(), found.end(), [](const Diagnostic& d) { return d.severity == Severity::kWarning; });
  if (command.json) {
    print(to_json(Value(Map{{"errors", errors}, {"warnings", warnings}, {"diagnostics", to_value(found)}})) + "\n");
  } else {
    for (const Diagnostic& diagnostic : found) print(to_string(diagnostic) + "\n");
    if (found.empty())
      print("nothing to complain about\n");
    else
      print(std::to_string(errors) + " errors, " + std::to_string(warnings) + " warnings\n");
  }
  return errors > 0 ? kInvalidInput : warnings > 0 ? kFindings : kOk;
}

}  // namespace sentree::cli
