#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "sentree/campaign/coverage.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/coverage_command.h"
#include "sentree/cli/output.h"
#include "sentree/cli/progress.h"
#include "sentree/cli/report.h"
#include "sentree/processes/elsewhere.h"
#include "sentree/project/expectations.h"

namespace sentree::cli {

namespace {

struct Tested {
  Value value;
  bool ok = false;
  std::string text;
  bool valid = true;  ///< The scenario could be run.
};

// @param coverage  Null: nobody asks what is reached.
Tested test_one(const std::filesystem::path& file, bool strict, campaign::Coverage* coverage) {
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
    return {Map{{"name", stem}, {"ok", false}, {"diagnostics", to_value(diagnostics)}}, false, text, false};
  }
  const auto began = std::chrono::steady_clock::now();
  runtime::RunOptions options;
  options.elsewhere = processes::elsewhere();
  auto progress = std::make_unique<Progress>(*plan, options);
  std::optional<campaign::CoverageWatch> watch;
  if (coverage != nullptr) watch.emplace(*plan, *coverage, options);
  runtime::Run run(*plan, std::move(options));
  runtime::RunReport report = run.execute();
  progress.reset();
  if (watch) watch->finish(report);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();

  const project::Scenario& scenario = plan->scenario;
  // One that expects nothing, as what was done by hand and saved, is a way to do it again.
  const bool expects = project::expects_anything(scenario);
  if (!expects) report.problems.emplace_back("the scenario expects nothing, whatever comes out");
  for (const runtime::MonitorReport& monitor : report.monitors) {
    if (strict && !monitor.vacuity.empty())
      report.unmet.push_back("monitor " + monitor.name + " was not put to the test: it " + monitor.vacuity);
    // One that is re-arming goes on behind it.
    const bool violated = monitor.verdict == monitor::Verdict::kViolated || monitor.violations > 0;
    if (violated && !scenario.verdicts.contains(monitor.name)) {
      (expects ? report.unmet : report.problems)
          .push_back(fmt::format("monitor {} is violated, and the scenario does not expect it (`monitors: {{{}: "
                                 "violated}}`)",
                                 monitor.name, monitor.name));
    }
  }
  for (const Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.code == "scenario.too-late" || diagnostic.code == "scenario.unused-choice")
      report.problems.push_back(to_string(diagnostic));
  }
  // What goes wrong on the way is seen in any case.
  const std::vector<std::string> problems = report.problems;
  if (strict) report.unmet.insert(report.unmet.end(), problems.begin(), problems.end());
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
  for (const std::string& problem : problems) {
    if (!strict) text += "    ! " + problem + "\n";
  }
  return {std::move(value), report.unmet.empty(), text};
}

// A scenario file by itself; all of a project, or those named.
bool find_scenarios(const std::filesystem::path& path, const std::vector<std::string>& wanted,
                    std::vector<std::filesystem::path>& files) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error) && path.filename() != "sentree.yaml") {
    files.push_back(path);
    return true;
  }
  const auto project = project::load_project(path);
  say(project.diagnostics);
  if (!project.ok()) return false;
  const std::size_t before = files.size();
  std::vector<std::string> names;
  for (const auto& file : project::scenario_files(*project.value)) {
    names.push_back(file.stem().string());
    if (wanted.empty() || std::find(wanted.begin(), wanted.end(), names.back()) != wanted.end()) files.push_back(file);
  }
  for (const std::string& name : wanted) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    say(project.value->file + ": the project has no scenario \"" + name + "\"" + did_you_mean(name, names));
    return false;
  }
  if (files.size() > before) return true;
  say(project.value->file + ": the project has no scenarios; `sentree add scenario NAME` makes one");
  return false;
}

int test_all(const TestCommand& command, campaign::Coverage* coverage, double min) {
  std::vector<std::filesystem::path> files;
  for (const std::string& path : command.paths) {
    if (!find_scenarios(path, command.scenarios, files)) return kInvalidInput;
  }
  List results;
  std::size_t held = 0;
  bool valid = true;
  for (const auto& file : files) {
    Tested tested = test_one(file, command.strict, coverage);
    held += tested.ok ? 1 : 0;
    valid = valid && tested.valid;
    results.push_back(std::move(tested.value));
    if (!command.json) print(tested.text);
  }
  bool enough = true;
  Map all{{"scenarios", std::move(results)}};
  std::string covered;
  if (coverage != nullptr) {
    const auto count = coverage->all();
    const double share = count.of == 0 ? 1.0 : static_cast<double>(count.reached) / static_cast<double>(count.of);
    enough = share >= min;
    all["coverage"] = coverage->to_value();
    covered = "\n" + coverage->to_text() +
              fmt::format("reached       {:>5} of {:<5} {:>5.1f} %{}\n", count.reached, count.of, share * 100,
                          enough ? "" : fmt::format(", less than {:g} %", min * 100));
  }
  if (command.json)
    print(to_json(Value(std::move(all))) + "\n");
  else
    print("\n" + std::to_string(held) + " of " + std::to_string(files.size()) + " scenarios held\n" + covered);
  return held == files.size() && enough ? kOk : valid ? kFindings : kInvalidInput;
}

}  // namespace

int test(const TestCommand& command) { return test_all(command, nullptr, 0.0); }

int test_coverage(const TestCommand& command, const std::string& min) {
  char* end = nullptr;
  double least = std::strtod(min.c_str(), &end);
  std::string unit(end);
  std::erase(unit, ' ');
  if (unit == "%") least /= 100;
  if (!min.empty() && (end == min.c_str() || !(unit.empty() || unit == "%") || !(least >= 0 && least <= 1))) {
    say("--min " + min + ": a share up to 100 %, such as 90%");
    return kUsage;
  }
  campaign::Coverage coverage;
  return test_all(command, &coverage, least);
}

}  // namespace sentree::cli
