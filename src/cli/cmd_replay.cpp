#include <fmt/format.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/runtime/replay.h"

namespace sentree::cli {

namespace {

Value describe(const runtime::ReplayReport& report) {
  List differences;
  for (const runtime::Difference& d : report.differences) {
    differences.push_back(Map{{"time", seconds(d.time)},
                              {"tick", static_cast<std::int64_t>(d.tick)},
                              {"who", d.who},
                              {"recorded", d.recorded},
                              {"replayed", d.replayed}});
  }
  Map value{{"recorded_requests", static_cast<std::int64_t>(report.recorded_requests)},
            {"answered_requests", static_cast<std::int64_t>(report.answered_requests)},
            {"differences", std::move(differences)}};
  if (!report.unrecorded.empty()) {
    value["unrecorded"] = report.unrecorded;
    value["unrecorded_at"] = seconds(report.unrecorded_at);
    value["continued"] = report.continued;
  }
  value["run"] = to_value(report.run);
  return value;
}

std::string text_of(const runtime::ReplayReport& report) {
  std::string text = fmt::format("replayed {:.3f} s of run time; {} of {} recorded requests were made again\n",
                                 seconds(report.run.ended), report.answered_requests, report.recorded_requests);
  if (report.differences.empty() && report.unrecorded.empty()) return text + "✓ it behaves as recorded\n";
  if (!report.differences.empty()) text += "It differs from the recording:\n";
  for (const runtime::Difference& d : report.differences) {
    text += fmt::format("{}  tick {:<5} {}\n{:>12}recorded: {}\n{:>12}now:      {}\n", time_column(d.time), d.tick,
                        d.who, "", d.recorded, "", d.replayed);
  }
  if (!report.unrecorded.empty()) {
    text += fmt::format(
        "{}  {}, which was not recorded; {}\n", time_column(report.unrecorded_at), report.unrecorded,
        report.continued ? "the simulator took over" : "the replay ends here (--continue goes on in the simulator)");
  }
  return text;
}

}  // namespace

int replay(const ReplayCommand& command) {
  auto recorded = runtime::RecordedRun::open(command.file);
  if (!recorded) {
    say(to_string(recorded.error()));
    return kInvalidInput;
  }
  auto scenario = command.project.empty() ? recorded->scenario() : recorded->scenario_in(command.project);
  if (!scenario.ok()) {
    say(scenario.diagnostics);
    return kInvalidInput;
  }
  scenario.value->virtual_time = false;  // parts in other processes are replayed in this one
  auto plan = runtime::prepare(std::move(*scenario.value));
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  runtime::ReplayOptions options;
  options.go_on = command.go_on;
  Narrator narrator;
  if (!command.json) {
    options.run.listeners.push_back([&](const Message& message) {
      const std::string text = command.verbose ? line(message) : std::string();
      if (!text.empty()) print(text + "\n");
    });
    options.run.on_decision = [](const runtime::MonitorReport& report) { print(story(report)); };
  }
  const auto report = runtime::replay(*recorded, std::move(*plan.value), std::move(options));
  say(recorded->reader().problems());
  if (!report) {
    say(to_string(report.error()));
    return kInvalidInput;
  }
  if (command.json) {
    print(to_json(describe(*report)) + "\n");
  } else {
    print(text_of(*report));
    if (report->continued) print(summary(report->run));
  }
  if (report->continued) return report->run.any_violated() ? kFindings : kOk;
  return report->differences.empty() && report->unrecorded.empty() ? kOk : kFindings;
}

}  // namespace sentree::cli
