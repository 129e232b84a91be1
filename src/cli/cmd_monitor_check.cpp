#include <fmt/format.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/requirement.h"
#include "sentree/runtime/recorded_run.h"
#include "sentree/runtime/requirements.h"
#include "sentree/scxml/loader.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

std::optional<monitor::Model> load_monitor(const std::string& file, const std::vector<std::string>& violated) {
  const auto source = text::read_file(file);
  if (!source) {
    say(to_string(source.error()));
    return std::nullopt;
  }
  auto chart = scxml::load(*source, file);
  say(chart.diagnostics);
  if (!chart.ok()) return std::nullopt;
  auto model = monitor::Model::make({.name = std::filesystem::path(file).stem().string(),
                                     .chart = std::move(*chart.value),
                                     .violated = violated,
                                     .renames = {},
                                     .span = SourceSpan{file}});
  say(model.diagnostics);
  return std::move(model.value);
}

// One monitor for each requirement of the file. False: something is wrong with it, which has been said.
bool load_requirements(const std::string& file, const runtime::Plan* plan, std::vector<monitor::Model>& models) {
  const auto source = text::read_file(file, file, monitor::kRequirementBytesMax);
  if (!source) {
    say(to_string(source.error()));
    return false;
  }
  const auto parsed = monitor::parse_requirements(*source, file);
  say(parsed.diagnostics);
  if (!parsed.ok()) return false;
  std::optional<monitor::Vocabulary> vocabulary;
  if (plan != nullptr) vocabulary = runtime::vocabulary_of(plan->services, &plan->tree, plan->leaves);
  for (const monitor::Requirement& requirement : parsed.value->requirements) {
    auto model = monitor::Model::make(requirement, vocabulary ? &*vocabulary : nullptr);
    say(model.diagnostics);
    if (!model.ok()) return false;
    models.push_back(std::move(*model.value));
  }
  return true;
}

}  // namespace

int monitor_check(const MonitorCheckCommand& command) {
  auto recorded = runtime::RecordedRun::open(command.file);
  if (!recorded) {
    say(to_string(recorded.error()));
    return kInvalidInput;
  }
  // The project tells the types of what was recorded, and has monitors of its own.
  auto scenario = command.project.empty() ? recorded->scenario() : recorded->scenario_in(command.project);
  std::optional<runtime::Plan> plan;
  if (scenario.ok()) {
    scenario.value->virtual_time = false;
    auto prepared = runtime::prepare(std::move(*scenario.value));
    if (!prepared.ok()) say(prepared.diagnostics);
    plan = std::move(prepared.value);
  } else if (command.monitors.empty() && command.requirements.empty()) {
    say(scenario.diagnostics);
  }
  std::vector<monitor::Model> models;
  for (const std::string& file : command.monitors) {
    auto model = load_monitor(file, command.violated);
    if (!model) return kInvalidInput;
    models.push_back(std::move(*model));
  }
  for (const std::string& file : command.requirements) {
    if (!load_requirements(file, plan ? &*plan : nullptr, models)) return kInvalidInput;
  }
  if (models.empty()) {
    if (!plan) return kInvalidInput;
    models = plan->monitors;
  }

  std::vector<monitor::State> states;
  std::vector<runtime::MonitorReport> reports;
  for (const monitor::Model& model : models) {
    states.push_back(monitor::start(model, TimePoint{}));
    reports.emplace_back().name = model.name();
  }
  const auto take = [&](std::size_t i, monitor::Decisions decisions) {
    for (monitor::Decision& decision : decisions) {
      reports[i].verdict = decision.verdict;
      reports[i].explanation = monitor::explain(models[i], decision, "");
      reports[i].decision = std::move(decision);
      if (!command.json) print(story(reports[i]));
    }
  };
  std::uint64_t observations = 0;
  const auto read = recorded->each([&](Message message) {
    ++observations;
    if (plan) runtime::restore_numbers(*plan, message);
    for (std::size_t i = 0; i < models.size(); ++i) take(i, monitor::observe(models[i], states[i], message));
    return true;
  });
  say(recorded->reader().problems());
  if (!read) {
    say(to_string(read.error()));
    return kInvalidInput;
  }
  bool any_violated = false;
  List list;
  std::string text = fmt::format("\n{} observations until {:.3f} s\n", observations, seconds(recorded->ended()));
  for (std::size_t i = 0; i < models.size(); ++i) {
    take(i, monitor::advance(models[i], states[i], recorded->ended()));
    runtime::MonitorReport& report = reports[i];
    if (states[i].failure) report.failure = to_string(*states[i].failure);
    any_violated = any_violated || report.verdict == monitor::Verdict::kViolated;
    const char* mark = report.verdict == monitor::Verdict::kViolated    ? "✗"
                       : report.verdict == monitor::Verdict::kSatisfied ? "✓"
                                                                        : "·";
    text += fmt::format("  {} monitor {}: {}\n", mark, report.name, to_string(report.verdict));
    if (!report.failure.empty()) text += "    given up: " + report.failure + "\n";
  }
  runtime::RunReport whole;
  whole.monitors = std::move(reports);
  if (command.json)
    print(to_json(Value(Map{{"observations", static_cast<std::int64_t>(observations)},
                            {"time", seconds(recorded->ended())},
                            {"monitors", *to_value(whole).find("monitors")}})) +
          "\n");
  else
    print(text);
  return any_violated ? kFindings : kOk;
}

}  // namespace sentree::cli
