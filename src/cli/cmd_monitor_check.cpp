#include <fmt/format.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/requirement_file.h"
#include "sentree/cli/verdicts.h"
#include "sentree/cli/watched_work.h"
#include "sentree/monitor/monitor.h"
#include "sentree/project/requirements.h"
#include "sentree/replay/recorded_run.h"
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

// `plan`: of what was recorded; null: it is not known.
int judge(const MonitorCheckCommand& command, replay::RecordedRun& recorded, const project::Plan* plan,
          const std::vector<monitor::Model>& models) {
  Verdicts verdicts(models, [&](const runtime::MonitorReport& report) {
    if (!command.json) print(story(report));
  });
  std::uint64_t observations = 0;
  const auto read = recorded.each([&](Message message) {
    ++observations;
    if (plan) replay::restore_numbers(*plan, message);
    verdicts.observe(std::move(message));
    return true;
  });
  say_each(recorded.reader().problems());
  if (!read) {
    say(to_string(read.error()));
    return kInvalidInput;
  }
  runtime::RunReport whole;
  whole.monitors = verdicts.finish(recorded.judged_until());
  std::string text = fmt::format("\n{} observations until {:.3f} s\n", observations, seconds(recorded.ended()));
  for (const runtime::MonitorReport& report : whole.monitors) text += monitor_line(report);
  if (command.json)
    print(to_json(Value(Map{{"observations", static_cast<std::int64_t>(observations)},
                            {"time", seconds(recorded.ended())},
                            {"monitors", *to_value(whole).find("monitors")}})) +
          "\n");
  else
    print(text);
  return whole.any_violated() ? kFindings : kOk;
}

}  // namespace

int monitor_check(const MonitorCheckCommand& command) {
  auto recorded = replay::RecordedRun::open(command.file);
  if (!recorded) {
    say(to_string(recorded.error()));
    return kInvalidInput;
  }
  // The project tells the types of what was recorded, and has monitors of its own.
  auto scenario =
      command.project.empty() ? recorded->scenario(command.recorded_code) : recorded->scenario_in(command.project);
  std::optional<project::Plan> plan;
  if (scenario.ok()) {
    say(scenario.diagnostics);
    scenario.value->virtual_time = false;
    auto prepared = project::prepare(std::move(*scenario.value));
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
  std::optional<monitor::Vocabulary> vocabulary;
  if (plan) vocabulary = project::vocabulary_of(*plan);
  for (const std::string& file : command.requirements) {
    auto loaded = load_requirement_file(file, vocabulary ? &*vocabulary : nullptr);
    say(loaded.diagnostics);
    if (!loaded.ok()) return kInvalidInput;
    for (monitor::Model& model : *loaded.value) models.push_back(std::move(model));
  }
  if (models.empty()) {
    if (!plan) return kInvalidInput;
    models = plan->monitors;
  }

  const Duration script_max = plan ? plan->scenario.project.deadlines.script : project::Deadlines().script;
  return watched_work(
      models, script_max, command.json, [&] { return judge(command, *recorded, plan ? &*plan : nullptr, models); },
      [&](Diagnostics found) { return recorded->errors_in(std::move(found)); });
}

}  // namespace sentree::cli
