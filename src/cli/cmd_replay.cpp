#include <fmt/format.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/replay/replay.h"

namespace sentree::cli {

namespace {

Value replay_value(const replay::ReplayReport& report) {
  List differences;
  for (const replay::Difference& d : report.differences) {
    differences.push_back(Map{{"time", seconds(d.time)},
                              {"tick", static_cast<std::int64_t>(d.tick)},
                              {"who", d.who},
                              {"recorded", d.recorded},
                              {"replayed", d.replayed}});
  }
  Map value{{"recorded_requests", static_cast<std::int64_t>(report.recorded_requests)},
            {"answered_requests", static_cast<std::int64_t>(report.answered_requests)},
            {"differences", std::move(differences)}};
  if (report.restored) value["restored"] = seconds(*report.restored);
  if (!report.unrecorded.empty()) {
    value["unrecorded"] = report.unrecorded;
    value["unrecorded_at"] = seconds(report.unrecorded_at);
    value["continued"] = report.continued;
  }
  value["run"] = cli::to_value(report.run);
  return value;
}

std::string replay_text(const replay::ReplayReport& report) {
  std::string text = fmt::format("replayed {:.3f} s of run time; {} of {} recorded requests were made again\n",
                                 seconds(report.run.ended), report.answered_requests, report.recorded_requests);
  if (report.restored)
    text = fmt::format("went on from the snapshot at {:.3f} s, to {:.3f} s\n", seconds(*report.restored),
                       seconds(report.run.ended));
  if (report.differences.empty() && report.unrecorded.empty()) return text + "✓ it behaves as recorded\n";
  if (!report.differences.empty()) text += "It differs from the recording:\n";
  for (const replay::Difference& d : report.differences) {
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

// What people ask of a moment; --json has all of it.
std::string replay_text(const Map& moment) {
  std::string text = fmt::format("{:.3f} s, tick {}, after observation {}\n", moment.find("time")->number(),
                                 *moment.find("tick")->as_int(), *moment.find("sequence")->as_int());
  text += "tree\n";
  for (const auto& [node, status] : *moment.find("nodes")->as_map())
    text += fmt::format("  {:<32}{}\n", node, status.text());
  text += "skills\n";
  for (const auto& [leaf, skill] : *moment.find("skills")->as_map()) {
    const Value* running = skill.find("running");
    if (running == nullptr || running->as_bool() == nullptr || !*running->as_bool()) continue;
    const Value* states = skill.find("states");
    const Value* data = skill.find("data");
    text += fmt::format("  {:<32}{} {}\n", leaf, states != nullptr ? to_json(*states) : "",
                        data != nullptr ? to_json(*data) : "");
  }
  text += "monitors\n";
  for (const auto& [name, monitor] : *moment.find("monitors")->as_map()) {
    const Value* standing = monitor.find("standing");
    text += fmt::format("  {:<32}{}{}\n", name, monitor.find("verdict")->text(),
                        standing != nullptr ? fmt::format(" ({})", standing->text()) : "");
  }
  return text;
}

}  // namespace

int replay(const ReplayCommand& command) {
  auto recorded = replay::RecordedRun::open(command.file);
  if (!recorded) {
    say(to_string(recorded.error()));
    return kInvalidInput;
  }
  auto scenario =
      command.project.empty() ? recorded->scenario(command.recorded_code) : recorded->scenario_in(command.project);
  say(scenario.diagnostics);
  if (!scenario.ok()) return kInvalidInput;
  // What was expected of the fault that was recorded is not expected of what may have mended it.
  if (!command.project.empty()) scenario.value->expect_nothing();
  scenario.value->virtual_time = false;  // parts in other processes are replayed in this one
  auto plan = project::prepare(std::move(*scenario.value));
  say(command.project.empty() ? recorded->errors_in(plan.diagnostics) : plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  replay::ReplayOptions options;
  options.go_on = command.go_on || !command.from.empty();
  for (const auto& [text, moment] : {std::pair(command.at, &options.at), std::pair(command.from, &options.go_on_at)}) {
    if (text.empty()) continue;
    const auto time = project::parse_duration(text);
    if (!time || time->count() < 0) {
      say(fmt::format("\"{}\" is no moment of a run; write for example '52 s' or '1500 ms'", text));
      return kUsage;
    }
    *moment = TimePoint(*time);
  }
  Narrator narrator;
  if (!command.json) {
    options.run.listeners.push_back([&](const Message& message) {
      const std::string text = command.verbose ? line(message) : std::string();
      if (!text.empty()) print(text + "\n");
    });
    if (!options.at) options.run.on_decision = [](const runtime::MonitorReport& report) { print(story(report)); };
  }
  const auto report = replay::replay(*recorded, std::move(*plan.value), std::move(options));
  say_each(recorded->reader().problems());
  if (!report) {
    say(to_string(report.error()));
    return kInvalidInput;
  }
  if (report->moment) {
    for (const replay::Difference& d : report->differences)
      say(fmt::format(
          "! at {:.3f} s {} did something else in the recording, which the state does not know: {}; now: {}",
          seconds(d.time), d.who, d.recorded, d.replayed));
    print(command.json ? to_json(Value(*report->moment)) + "\n" : replay_text(*report->moment));
    return report->differences.empty() ? kOk : kFindings;
  }
  if (command.json) {
    print(to_json(replay_value(*report)) + "\n");
  } else {
    print(replay_text(*report));
    if (report->continued) print(summary(report->run));
  }
  if (report->continued) return report->run.any_violated() ? kFindings : kOk;
  return report->differences.empty() && report->unrecorded.empty() ? kOk : kFindings;
}

}  // namespace sentree::cli
