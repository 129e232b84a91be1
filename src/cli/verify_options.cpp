#include "sentree/cli/verify_options.h"

#include <map>
#include <stdexcept>

#include "sentree/cli/output.h"

namespace sentree::cli {

std::optional<std::uint64_t> bytes_of(const std::string& text) {
  const std::map<std::string, double> units{{"", 1}, {"B", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}};
  std::size_t end = 0;
  double number = 0;
  try {
    number = std::stod(text, &end);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  while (end < text.size() && text[end] == ' ') ++end;
  const auto unit = units.find(text.substr(end));
  if (unit == units.end() || !(number > 0) || number * unit->second > 1e18) return std::nullopt;
  return static_cast<std::uint64_t>(number * unit->second);
}

Loaded<project::Scenario> load_verified(const VerifyCommand& command) {
  if (!command.scenario.empty()) return project::load_scenario(command.scenario);
  auto project = project::load_project(command.project);
  Loaded<project::Scenario> loaded;
  loaded.diagnostics = std::move(project.diagnostics);
  if (project.ok()) loaded.value = project::plain_scenario(std::move(*project.value));
  return loaded;
}

bool read_options(const VerifyCommand& command, const project::Plan& plan, verify::Asked& asked) {
  const project::VerifySection& section = plan.scenario.project.verify;
  asked.only = command.only;
  asked.explore.memory_of_steps = !command.no_memory;
  asked.explore.exact = command.exact;
  asked.explore.order = command.order == "any" ? verify::Order::kAny : verify::Order::kVirtual;
  if (command.faults != "none") asked.explore.faults = section.faults;
  asked.explore.faults_at_most = section.faults_at_most;
  asked.judge.fair = section.fair;
  asked.judge.all_fair = command.fair;
  if (command.ticks) asked.explore.ticks = *command.ticks;
  if (command.states) asked.explore.states = *command.states;
  if (command.memory) {
    const auto bytes = bytes_of(*command.memory);
    if (!bytes) {
      say("--memory " + *command.memory + ": not a size such as 500 MB or 2 GB");
      return false;
    }
    asked.explore.memory = *bytes;
  }
  if (command.time) {
    const auto time = project::parse_duration(*command.time);
    if (!time) {
      say("--time " + *command.time + ": not a duration such as 30 s");
      return false;
    }
    asked.explore.time = *time;
  }
  return true;
}

}  // namespace sentree::cli
