#include "sentree/project/scenario_text.h"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sentree/project/intervention.h"
#include "sentree/project/loop.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::project {

namespace {

std::string flow(const text::YamlNode& node) {
  using Kind = text::YamlNode::Kind;
  std::string out;
  switch (node.kind) {
    case Kind::kNull: return "null";
    case Kind::kScalar:
      // A number, a truth value or a quantity as it was written.
      if (!node.quoted && node.value().as_string() == nullptr) return node.scalar;
      return text::yaml_flow(node.scalar);
    case Kind::kSequence:
      for (const text::YamlNode& item : node.items) out += (out.empty() ? "" : ", ") + flow(item);
      return fmt::format("[{}]", out);
    case Kind::kMapping:
      for (const auto& [key, member] : node.entries)
        out += fmt::format("{}{}: {}", out.empty() ? "" : ", ", flow(key), flow(member));
      return fmt::format("{{{}}}", out);
  }
  return out;
}

// An entry of the file: a mapping or a sequence gets a line for each member.
std::string block(const std::string& key, const text::YamlNode& node) {
  std::string out = key + ":";
  if (node.is_mapping() && !node.entries.empty()) {
    out += "\n";
    for (const auto& [name, member] : node.entries) out += fmt::format("  {}: {}\n", flow(name), flow(member));
    return out;
  }
  if (node.is_sequence() && !node.items.empty()) {
    out += "\n";
    for (const text::YamlNode& item : node.items) out += fmt::format("  - {}\n", flow(item));
    return out;
  }
  return fmt::format("{} {}\n", out, flow(node));
}

std::string entry(const Injection& injection) {
  Map map{{"at", exact_seconds(injection.at.time_since_epoch())}};
  if (injection.source != "scenario") map["source"] = injection.source;
  for (auto& [key, value] : to_entry(injection.what)) map[key] = value;
  return fmt::format("  - {}\n", text::yaml_flow(Value(std::move(map))));
}

std::string expectations(const Scenario& scenario, const RunOutcome& outcome) {
  std::string out;
  if (!outcome.mission.empty()) out += fmt::format("  mission: {}\n", outcome.mission);
  std::string monitors;
  for (const MonitorEntry& monitor : scenario.project.monitors) {
    const auto verdict = outcome.verdicts.find(monitor.name);
    monitors += fmt::format("{}{}: {}", monitors.empty() ? "" : ", ", text::yaml_flow(monitor.name),
                            verdict != outcome.verdicts.end() ? verdict->second : "undecided");
  }
  if (!monitors.empty()) out += fmt::format("  monitors: {{{}}}\n", monitors);
  return out.empty() ? out : "expect:\n" + out;
}

}  // namespace

std::string scenario_text(const Scenario& scenario, const std::vector<Injection>& done,
                          const std::optional<RunOutcome>& outcome, const std::string& project) {
  if (scenario.loop && !done.empty()) {
    // What was done in one round does not come again in the others.
    Scenario whole = scenario;
    write_out(whole);
    return scenario_text(whole, done, outcome, project);
  }
  const auto written = [&](const std::string& key) {
    const text::YamlNode* node = scenario.source.find(key);
    return node != nullptr && !node->is_null() ? block(key, *node) : std::string();
  };
  std::string out = written("description");
  if (!project.empty()) out += fmt::format("project: {}\n", text::yaml_flow(project));
  if (scenario.virtual_time)
    out += "clock: virtual\n";
  else
    out += fmt::format("clock: {{real: {}}}\n", shortest_decimal(scenario.factor));
  out += fmt::format("seed: {}\n", scenario.seed);
  for (const char* key : {"override", "processes", "delays"}) out += written(key);
  std::vector<Injection> timeline = scenario.timeline;
  std::erase_if(timeline, [](const Injection& injection) { return injection.again; });
  timeline.insert(timeline.end(), done.begin(), done.end());
  // At one instant the scenario's own come first, as they did.
  std::stable_sort(timeline.begin(), timeline.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  if (!timeline.empty()) out += "timeline:\n";
  for (const Injection& injection : timeline) out += entry(injection);
  if (scenario.choices) out += scenario.choices->empty() ? "choices: []\n" : "choices:\n";
  for (const ScenarioChoice& choice : scenario.choices.value_or(std::vector<ScenarioChoice>())) {
    Map map{{"model", choice.model}, {"number", static_cast<std::int64_t>(choice.number)}};
    if (!choice.name.empty()) map["name"] = choice.name;
    map["value"] = choice.value;
    if (choice.tick > 0) map["tick"] = static_cast<std::int64_t>(choice.tick);
    if (!choice.place.empty()) map["place"] = choice.place;
    out += fmt::format("  - {}\n", text::yaml_flow(Value(std::move(map))));
  }
  if (!scenario.orders.empty()) out += "orders:\n";
  for (const ScenarioOrder& order : scenario.orders) {
    Map map{{"number", static_cast<std::int64_t>(order.number)}, {"first", order.first}};
    if (order.tick > 0) map["tick"] = static_cast<std::int64_t>(order.tick);
    out += fmt::format("  - {}\n", text::yaml_flow(Value(std::move(map))));
  }
  if (scenario.loop) {
    const auto range = [](const ScenarioLoop::Range& of) { return fmt::format("[{}, {}]", of.first, of.last); };
    out += fmt::format("loop: {{from: {}, to: {}", scenario.loop->ticks.first, scenario.loop->ticks.last);
    std::string choices;
    for (const auto& [model, numbers] : scenario.loop->choices)
      choices += fmt::format("{}{}: {}", choices.empty() ? "" : ", ", text::yaml_flow(model), range(numbers));
    if (!choices.empty()) out += fmt::format(", choices: {{{}}}", choices);
    if (scenario.loop->orders) out += fmt::format(", orders: {}", range(*scenario.loop->orders));
    out += "}\n";
  }
  out += fmt::format("duration: {}\n", exact_seconds(scenario.duration));
  out += written("stop_when_violated");
  if (outcome) out += expectations(scenario, *outcome);
  return out;
}

Result<std::string> with_injections(std::string text, std::vector<Injection> timeline,
                                    const std::vector<Injection>& done, const std::string& file) {
  for (const Injection& one : done) {
    const Value what = to_entry(one.what);
    const bool known = std::any_of(timeline.begin(), timeline.end(), [&](const Injection& there) {
      return there.at == one.at && Value(to_entry(there.what)) == what;
    });
    if (known) continue;
    const auto later =
        std::find_if(timeline.begin(), timeline.end(), [&](const Injection& there) { return there.at > one.at; });
    Map entry{{"at", exact_seconds(one.at.time_since_epoch())}};
    for (const auto& [key, value] : *what.as_map()) entry[key] = value;
    auto with = text::with_item(text, {std::string("timeline")}, static_cast<std::size_t>(later - timeline.begin()),
                                Value(std::move(entry)), file);
    if (!with) return with;
    text = std::move(*with);
    timeline.insert(later, one);
  }
  return text;
}

}  // namespace sentree::project
