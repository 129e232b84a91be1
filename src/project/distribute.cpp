#include "sentree/project/distribute.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace sentree::project {

namespace {

// A name that no process has yet.
std::string unused(const std::vector<ProcessEntry>& processes, std::string name) {
  const auto taken = [&] {
    return std::any_of(processes.begin(), processes.end(), [&](const auto& process) { return process.name == name; });
  };
  while (taken()) name += "_";
  return name;
}

}  // namespace

Scenario in_processes(const Plan& plan) {
  Scenario scenario = plan.scenario;
  scenario.virtual_time = false;
  std::vector<ProcessEntry>& processes = scenario.processes;
  Project& project = scenario.project;

  const auto simulated = [](const ServiceEntry& service) { return service.at == "sim"; };
  if (std::any_of(project.services.begin(), project.services.end(), simulated)) {
    ProcessEntry& robot = processes.emplace_back();
    robot.name = unused(processes, "sim");
    robot.component = "sim";
    robot.restarts = kPartRestarts;
    robot.listen = fmt::format("unix:{{run}}/{}.sock", processes.size());
    for (ServiceEntry& service : project.services) {
      if (simulated(service)) service.at = fmt::format("{{{}}}", robot.name);
    }
  }

  // Models serve skills of their own process.
  const bool is_modelled =
      std::any_of(project.services.begin(), project.services.end(), [](const auto& s) { return s.at == "model"; });
  if (is_modelled) return scenario;
  std::set<std::string> placed;  // skills: leaves of one entry share a process
  for (const LeafPlan& leaf : plan.leaves) {
    if (!leaf.at.empty()) continue;
    // Topics reach skills of the run only.
    if (!leaf.subscribes.empty()) continue;
    const SkillEntry* entry = plan.scenario.project.skill(plan.tree.name(leaf.node), leaf.id);
    const std::string key = entry != nullptr ? entry->leaf : leaf.id;
    if (!placed.insert(key).second) continue;
    ProcessEntry process;
    process.name = unused(processes, key);
    process.skill = key;
    process.restarts = kPartRestarts;
    process.listen = fmt::format("unix:{{run}}/{}.sock", processes.size() + 1);
    const auto known = std::find_if(project.skills.begin(), project.skills.end(),
                                    [&](const SkillEntry& skill) { return skill.leaf == key; });
    if (known != project.skills.end())
      known->at = fmt::format("{{{}}}", process.name);
    else
      project.skills.push_back({.leaf = key, .file = {}, .at = fmt::format("{{{}}}", process.name), .span = {}});
    processes.push_back(std::move(process));
  }
  return scenario;
}

}  // namespace sentree::project
