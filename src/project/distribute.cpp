#include "sentree/project/distribute.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

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

// "skills A, B and 3 more"; empty: there are none.
std::string list_of(std::string_view what, const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 12;
  if (names.empty()) return {};
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kShown));
  std::string text = fmt::format("{}{} {}", what, names.size() > 1 ? "s" : "", fmt::join(names.begin(), end, ", "));
  if (names.size() > kShown) text += fmt::format(" and {} more", names.size() - kShown);
  return text;
}

// Of what runs at one place.
struct PartsAt {
  std::vector<std::string> others, skills, monitors;

  [[nodiscard]] std::string text() const {
    std::vector<std::string> all = others;
    all.push_back(list_of("skill", skills));
    all.push_back(list_of("monitor", monitors));
    std::erase(all, "");
    return fmt::format("{}", fmt::join(all, ", "));
  }
};

}  // namespace

std::string shown_places(const Plan& plan) {
  PartsAt here{{"the mission"}, {}, {}};
  PartsAt processes;
  std::map<std::string, PartsAt> addresses;
  for (const ProcessEntry& entry : plan.scenario.processes) {
    if (!entry.component.empty()) processes.others.push_back(fmt::format("the simulator ({})", entry.name));
  }
  const auto has_process = [&](std::string ProcessEntry::*part, std::string_view name) {
    return std::any_of(plan.scenario.processes.begin(), plan.scenario.processes.end(),
                       [&](const ProcessEntry& entry) { return entry.*part == name; });
  };
  std::set<std::string> told;
  for (const LeafPlan& leaf : plan.leaves) {
    if (!told.insert(leaf.name).second) continue;
    if (leaf.at.empty())
      here.skills.push_back(leaf.name);
    else if (has_process(&ProcessEntry::skill, leaf.name) || has_process(&ProcessEntry::skill, leaf.id))
      processes.skills.push_back(leaf.name);
    else
      addresses[leaf.at].skills.push_back(leaf.name);
  }
  for (const monitor::Model& monitor : plan.monitors) here.monitors.push_back(monitor.name());
  for (const ObserverPlan& observer : plan.observers) {
    if (has_process(&ProcessEntry::monitor, observer.name))
      processes.monitors.push_back(observer.name);
    else
      (observer.is_monitor ? addresses[observer.at].monitors : addresses[observer.at].others).push_back(observer.name);
  }
  if (processes.text().empty() && addresses.empty()) return {};
  std::vector<std::string> places;
  if (!processes.text().empty()) places.push_back("in processes of their own: " + processes.text());
  for (const auto& [at, parts] : addresses) places.push_back(fmt::format("at {}: {}", at, parts.text()));
  places.push_back("in this one: " + here.text());
  return fmt::format("{}", fmt::join(places, "; "));
}

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
