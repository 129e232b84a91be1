#include <algorithm>
#include <chrono>
#include <cstdio>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"

namespace sentree::cli {

namespace {

struct Tested {
  Value value;
  bool ok = false;
  std::string text;
};

Tested test_one(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  auto loaded = project::load_scenario(file);
  Diagnostics diagnostics = loaded.diagnostics;
  std::optional<project::Plan> plan;
  if (loaded.ok()) {
    auto prepared = project::prepare(std::move(*loaded.value));
    diagnostics.insert(diagnostics.end(), prepared.diagnostics.begin(), prepared.diagnostics.end());
    plan = std::move(prepared.value);
  }
  if (!plan) {
    std::string text = "✗ " + stem + ": cannot be run\n";
    for (const Diagnostic& diagnostic : diagnostics) text += "    " + to_string(diagnostic) + "\n";
    return {Map{{"name", stem}, {"ok", false}, {"diagnostics", to_value(diagnostics)}}, false, text};
  }
  const auto began = std::chrono::steady_clock::now();
  runtime::Run run(*plan, {});
  const runtime::RunReport report = run.execute();
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();

  const Value data = to_value(report);
  Map value{{"name", report.scenario}};
  for (const auto& [key, entry] : *data.as_map()) {
    if (key != "scenario") value[key] = entry;
  }
  value["wall_s"] = wall_s;
  std::string text = (report.unmet.empty() ? "✓ " : "✗ ") + report.scenario;
  if (!plan->scenario.description.empty()) text += ": " + plan->scenario.description;
  char timing[64];
  std::snprintf(timing, sizeof timing, " (%.0f s in %.2f s)\n", seconds(report.ended), wall_s);
  text += timing;
  for (const std::string& sentence : report.unmet) text += "    " + sentence + "\n";
  if (!report.unmet.empty()) {
    for (const std::string& problem : report.problems) text += "    ! " + problem + "\n";
  }
  return {std::move(value), report.unmet.empty(), text};
}

}  // namespace

int test(const TestCommand& command) {
  const auto project = project::load_project(command.project);
  say(project.diagnostics);
  if (!project.ok()) return kInvalidInput;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> names;
  for (const auto& file : project::scenario_files(*project.value)) {
    names.push_back(file.stem().string());
    if (command.scenarios.empty() ||
        std::find(command.scenarios.begin(), command.scenarios.end(), names.back()) != command.scenarios.end()) {
      files.push_back(file);
    }
  }
  for (const std::string& wanted : command.scenarios) {
    if (std::find(names.begin(), names.end(), wanted) != names.end()) continue;
    say(project.value->file + ": the project has no scenario \"" + wanted + "\"" + did_you_mean(wanted, names));
    return kInvalidInput;
  }
  if (files.empty()) {
    say(project.value->file + ": the project has no scenarios; add scenarios/NAME.yaml");
    return kInvalidInput;
  }
  List results;
  std::size_t held = 0;
  for (const auto& file : files) {
    Tested tested = test_one(file);
    held += tested.ok ? 1 : 0;
    results.push_back(std::move(tested.value));
    if (!command.json) print(tested.text);
  }
  if (command.json)
    print(to_json(Value(Map{{"scenarios", std::move(results)}})) + "\n");
  else
    print("\n" + std::to_string(held) + " of " + std::to_string(files.size()) + " scenarios held\n");
  return held == files.size() ? kOk : kFindings;
}

}  // namespace sentree::cli
