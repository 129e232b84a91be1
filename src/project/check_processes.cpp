#include "sentree/project/detail/check_processes.h"

#include <algorithm>

#include <fmt/format.h>

#include "sentree/project/any_reply.h"
#include "sentree/rpc/address.h"

namespace sentree::project {

namespace {

// At an address that can be meant, or in a process of the scenario; what is wrong with others is told by itself.
bool is_elsewhere(const std::string& at) {
  return !is_inside(at) && at != kAnyReply && (at.starts_with('{') || rpc::Address::parse(at));
}

// That the part at `elsewhere` has no virtual time, where one can mend it: in the scenario, or if it is not that which
// says so, in what is asked for.
void tell_clock(const Scenario& scenario, const std::string& what, const SourceSpan& elsewhere,
                Diagnostics& diagnostics) {
  const text::YamlNode* const clock = scenario.source.find("clock");
  const bool is_own = scenario.file != scenario.project.file && (clock == nullptr || clock->scalar == "virtual");
  if (!is_own) {
    add(diagnostics, Severity::kError, "scenario.clock",
        what +
            " runs in another process, which has no virtual time: run it with --clock real; to verify a mission needs "
            "everything in it as charts",
        elsewhere);
    return;
  }
  SourceSpan place = clock != nullptr ? clock->span : scenario.source.span;
  if (place.file.empty()) place.file = scenario.file;
  add(diagnostics, Severity::kError, "scenario.clock",
      fmt::format("{} ({}) runs in another process, which has no virtual time: the scenario needs clock: real, or "
                  "{{real: FACTOR}}; to verify a mission needs everything in it as charts",
                  what, to_string(elsewhere)),
      place);
}

}  // namespace

void check_processes(const Scenario& scenario, Diagnostics& diagnostics) {
  const auto check = [&](const std::string& at, const std::string& what, const SourceSpan& span) {
    if (!at.starts_with('{')) return;
    const std::string name = at.substr(1, at.find('}') == std::string::npos ? at.size() : at.find('}') - 1);
    const auto& processes = scenario.processes;
    if (std::any_of(processes.begin(), processes.end(), [&](const auto& p) { return p.name == name; })) return;
    add(diagnostics, Severity::kError, "scenario.process",
        fmt::format("{} is at \"{}\", but the scenario has no process \"{}\"", what, at, name), span);
  };
  for (const ServiceEntry& service : scenario.project.services)
    check(service.at, fmt::format("service \"{}\"", service.name), service.span);
  for (const MonitorEntry& monitor : scenario.project.monitors)
    check(monitor.at, fmt::format("monitor \"{}\"", monitor.name), monitor.span);
  for (const ObserverEntry& observer : scenario.project.observers)
    check(observer.at, fmt::format("observer \"{}\"", observer.name), observer.span);
  for (const SkillEntry& skill : scenario.project.skills)
    check(skill.at, fmt::format("skill \"{}\"", skill.leaf), skill.span);
  if (scenario.virtual_time) {
    SourceSpan elsewhere;  // the first part that is
    std::string what;
    const auto part = [&](bool is_elsewhere, const SourceSpan& at, const char* kind, const std::string& name) {
      if (!is_elsewhere || !elsewhere.file.empty()) return;
      elsewhere = at;
      what = fmt::format("{} \"{}\"", kind, name);
    };
    const Project& project = scenario.project;
    for (const ProcessEntry& process : scenario.processes) part(true, process.span, "process", process.name);
    for (const ObserverEntry& observer : project.observers) part(true, observer.span, "observer", observer.name);
    for (const MonitorEntry& monitor : project.monitors)
      part(!monitor.at.empty(), monitor.span, "monitor", monitor.name);
    for (const SkillEntry& skill : project.skills) part(!skill.at.empty(), skill.span, "skill", skill.leaf);
    for (const ServiceEntry& service : project.services)
      part(is_elsewhere(service.at), service.span, "service", service.name);
    if (!elsewhere.file.empty()) tell_clock(scenario, what, elsewhere, diagnostics);
  }
  for (const ProcessEntry& process : scenario.processes) {
    if (process.skill.empty()) continue;
    const auto subscribes = std::find_if(
        scenario.project.skills.begin(), scenario.project.skills.end(),
        [&](const SkillEntry& skill) { return skill.leaf == process.skill && !skill.subscribes.topics.empty(); });
    if (subscribes != scenario.project.skills.end()) {
      add(diagnostics, Severity::kError, "check.subscribe",
          fmt::format("skill \"{}\" subscribes to topics, which do not reach other processes; let it run in the run",
                      process.skill),
          process.span);
    }
  }
}

bool may_call(const scxml::Chart& chart, std::string_view service) {
  if (scxml::invokes_unknown(chart)) return true;
  const std::vector<scxml::SendInfo> sends = scxml::sends_with_invoked(chart);
  return std::any_of(sends.begin(), sends.end(), [&](const scxml::SendInfo& send) {
    return send.type.value_or("thrift") == "thrift" && send.target.value_or(std::string(service)) == service;
  });
}

void check_process_skills(const Scenario& scenario, const bt::Tree& tree, const std::vector<LeafPlan>& plans,
                          Diagnostics& diagnostics) {
  std::vector<std::string> leaves;
  for (const bt::NodeId node : tree.external_leaves()) {
    leaves.push_back(tree.event_name(node));
    leaves.emplace_back(tree.name(node));
    leaves.emplace_back(tree.registration(node));
  }
  std::vector<std::string> monitors;
  for (const MonitorEntry& monitor : scenario.project.monitors) monitors.push_back(monitor.name);
  const auto check = [&](const std::string& name, const std::vector<std::string>& known, const char* what,
                         const SourceSpan& span) {
    if (name.empty() || std::find(known.begin(), known.end(), name) != known.end()) return;
    add(diagnostics, Severity::kError, "scenario.process",
        fmt::format("{}{} \"{}\"{}", "the project has no ", what, name, did_you_mean(name, known)), span);
  };
  for (const ProcessEntry& process : scenario.processes) {
    check(process.skill, leaves, "leaf", process.span);
    check(process.monitor, monitors, "monitor", process.span);
    for (const ServiceEntry& service : scenario.project.services) {
      if (service.at != "sim" && service.at != "model") continue;
      if (std::none_of(plans.begin(), plans.end(), [&](const LeafPlan& leaf) {
            return (leaf.name == process.skill || leaf.id == process.skill) && leaf.chart &&
                   may_call(*leaf.chart, service.name);
          }))
        continue;
      add(diagnostics, Severity::kError, "scenario.process",
          fmt::format(
              "skill \"{}\" runs in another process and cannot reach service \"{}\", which is at: {} in this one; {}",
              process.skill, service.name, service.at,
              service.at == "sim" ? "run the simulator in a process too"
                                  : "models serve skills of their own process only"),
          process.span);
    }
  }
}

}  // namespace sentree::project
