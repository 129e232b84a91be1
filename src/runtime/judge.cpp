#include <algorithm>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "sentree/runtime/run.h"

namespace sentree::runtime {

namespace {

// A re-arming monitor goes on, and may be something else at the end.
bool was_violated(const MonitorReport& monitor) {
  return monitor.verdict == monitor::Verdict::kViolated || monitor.violations > 0;
}

// "mission.xml:3:7: …": of the tree itself; what a leaf says begins with its name.
bool has_place(std::string_view reason) {
  const std::string_view before = reason.substr(0, reason.find(": "));
  const std::size_t column = before.rfind(':');
  const std::size_t line = column == std::string_view::npos || column == 0 ? column : before.rfind(':', column - 1);
  if (line == std::string_view::npos || line == 0) return false;
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  return is_number(before.substr(line + 1, column - line - 1)) && is_number(before.substr(column + 1));
}

// Why the mission's tree could not be executed, where its status does not tell: a script has failed while it was halted
// at the end.
bool hides_a_failure(const RunReport& report) {
  return report.mission != bt::Status::kFailure && has_place(report.reason) &&
         std::any_of(report.problems.begin(), report.problems.end(),
                     [&](const std::string& problem) { return problem.starts_with(report.reason); });
}

}  // namespace

bool RunReport::any_violated() const {
  return std::any_of(monitors.begin(), monitors.end(), [](const MonitorReport& m) { return was_violated(m); });
}

void judge(const project::Scenario& scenario, RunReport& report) {
  report.unmet.clear();
  for (const std::string& why : report.given_up) report.unmet.push_back(why);
  if (!report.error.empty() && report.given_up.empty())
    report.unmet.push_back("the run could not go on: " + report.error);
  if (report.interrupted) report.unmet.push_back("the run was interrupted");
  if (scenario.mission && *scenario.mission != to_string(report.mission)) {
    report.unmet.push_back(fmt::format("mission status {}, expected {}{}", to_string(report.mission), *scenario.mission,
                                       report.reason.empty() ? "" : fmt::format(" ({})", report.reason)));
  } else if (scenario.mission && scenario.mission_reason.empty() && hides_a_failure(report)) {
    report.unmet.push_back(fmt::format(
        "mission status {} as expected, but a script failed while it was halted: {} (`reason: …` expects that)",
        *scenario.mission, report.reason));
  }
  if (!scenario.mission_reason.empty() && report.reason.find(scenario.mission_reason) == std::string::npos) {
    report.unmet.push_back(fmt::format("reason \"{}\", expected \"{}\" in it", report.reason, scenario.mission_reason));
  }
  for (const MonitorReport& monitor : report.monitors) {
    const auto expected = scenario.verdicts.find(monitor.name);
    const bool said =
        std::find(report.given_up.begin(), report.given_up.end(), monitor.failure) != report.given_up.end();
    if (!monitor.failure.empty() && !said)
      report.unmet.push_back(fmt::format("monitor {} was given up: {}", monitor.name, monitor.failure));
    if (expected == scenario.verdicts.end()) continue;
    const std::string verdict(to_string(monitor.verdict));
    const bool owes = monitor.verdict == monitor::Verdict::kUndecided && monitor.standing.starts_with("pending");
    if (was_violated(monitor)) {
      if (expected->second == "violated") continue;
      if (monitor.verdict != monitor::Verdict::kViolated) {
        report.unmet.push_back(fmt::format("monitor {} was violated{} before it was {}, expected {}", monitor.name,
                                           monitor.violations > 1 ? fmt::format(" {} times", monitor.violations) : "",
                                           verdict, expected->second));
        continue;
      }
    }
    if (expected->second == verdict || (expected->second == "owed" && owes)) continue;
    const bool tells = expected->second == "owed" && !monitor.standing.empty();
    report.unmet.push_back(fmt::format("monitor {} is {}{}, expected {}", monitor.name, verdict,
                                       tells ? fmt::format(" ({})", monitor.standing) : "", expected->second));
  }
  if (scenario.distinct_processes) {
    std::set<std::int64_t> pids;
    for (const ProcessReport& process : report.processes) pids.insert(process.pid);
    if (pids.size() != scenario.processes.size() + 1)
      report.unmet.push_back("its parts did not run in processes of their own");
  }
}

}  // namespace sentree::runtime
