#include <algorithm>

#include <fmt/format.h>

#include "sentree/project/plan.h"
#include "sentree/project/project.h"
#include "sentree/project/requirements.h"
#include "sentree/project/timeline.h"
#include "sentree/project/variant.h"
#include "sentree/project/yaml_reader.h"
#include "sentree/text/file.h"
#include "sentree/text/read_fence.h"

namespace sentree::project {

namespace {

void read_clock(YamlReader& reader, Scenario& scenario) {
  const auto* clock = reader.node("clock");
  if (clock == nullptr) return;
  if (clock->is_scalar() && clock->scalar == "virtual") return;
  scenario.virtual_time = false;
  if (clock->is_scalar() && clock->scalar == "real") return;
  const auto* factor = clock->find("real");
  const auto number = factor ? factor->number() : std::nullopt;
  if (number && *number > 0 && *number <= 1000 && clock->entries.size() == 1) {
    scenario.factor = *number;
  } else {
    reader.error(clock->span, "scenario.clock",
                 "clock must be virtual, real, or {real: FACTOR} with a factor up to 1000");
  }
}

void read_delays(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "a delay", diagnostics);
    scenario.delays.push_back(
        {reader.required_string("message"), reader.duration("by").value_or(Duration(0)), entry.span});
    if (entry.is_mapping() && reader.node("by") == nullptr)
      reader.error(entry.span, "project.missing-key", "a delay needs \"by\"");
    if (reader.node("count") == nullptr) continue;
    // Each process of a run counts what it delays for itself.
    reader.error(reader.span("count"), "scenario.count",
                 "what stands in `delays:` is for the whole run; a delay of so many messages is an entry of "
                 "`timeline:`, {at: 0 s, delay: {message: …, by: …, count: …}}");
  }
}

void read_processes(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    YamlReader reader(entry, fmt::format("process \"{}\"", name.scalar), diagnostics);
    ProcessEntry process{.name = name.scalar,
                         .component = reader.string("component").value_or(""),
                         .skill = reader.string("skill").value_or(""),
                         .monitor = reader.string("monitor").value_or(""),
                         .restarts = 0,
                         .listen = reader.required_string("listen"),
                         .span = name.span};
    if (const auto restarts = reader.integer("restarts")) {
      if (*restarts >= 0 && *restarts <= kRestartsMax)
        process.restarts = static_cast<int>(*restarts);
      else
        reader.error(reader.span("restarts"), "scenario.process",
                     fmt::format("restarts must be from 0 to {}", kRestartsMax));
    }
    if ((process.component.empty() ? 0 : 1) + (process.skill.empty() ? 0 : 1) + (process.monitor.empty() ? 0 : 1) !=
        1) {
      reader.error(name.span, "scenario.process",
                   fmt::format("process \"{}\" needs one of \"component: sim\", \"skill: LEAF\" and \"monitor: NAME\"",
                               name.scalar));
    } else if (!process.component.empty() && process.component != "sim") {
      reader.error(reader.span("component"), "scenario.process",
                   fmt::format("component \"{}\" is not known; there is \"sim\"", process.component));
    }
    scenario.processes.push_back(std::move(process));
  }
}

void read_expect(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  YamlReader reader(node, "expect", diagnostics);
  scenario.expect_span = node.span;
  scenario.mission = reader.string("mission");
  if (scenario.mission && *scenario.mission != "SUCCESS" && *scenario.mission != "FAILURE" &&
      *scenario.mission != "RUNNING") {
    reader.error(reader.span("mission"), "scenario.expect",
                 fmt::format("mission \"{}\" must be SUCCESS, FAILURE or RUNNING", *scenario.mission));
  }
  scenario.mission_reason = reader.string("reason").value_or("");
  scenario.distinct_processes = reader.boolean("distinct_processes").value_or(false);
  const auto* monitors = reader.mapping("monitors");
  if (monitors == nullptr) return;
  std::vector<std::string> names;
  bool any_unread = false;
  for (const MonitorEntry& monitor : scenario.project.monitors) {
    names.push_back(monitor.name);
    any_unread = any_unread || is_unread_requirements(monitor);
  }
  for (const auto& [name, verdict] : monitors->entries) {
    if (!any_unread && std::find(names.begin(), names.end(), name.scalar) == names.end()) {
      reader.error(name.span, "scenario.expect",
                   fmt::format("the project has no monitor \"{}\"{}", name.scalar, did_you_mean(name.scalar, names)));
    }
    if (verdict.scalar != "violated" && verdict.scalar != "satisfied" && verdict.scalar != "undecided" &&
        verdict.scalar != "owed") {
      reader.error(verdict.span, "scenario.expect",
                   fmt::format("verdict \"{}\" must be violated, satisfied, undecided or owed", verdict.scalar));
    }
    scenario.verdicts[name.scalar] = verdict.scalar;
  }
}

void read_choices(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  scenario.choices.emplace();
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "choice", diagnostics);
    ScenarioChoice choice;
    choice.span = entry.span;
    choice.model = reader.required_string("model");
    const auto number = reader.integer("number");
    if (!number || *number < 1)
      reader.error(entry.span, "scenario.choice", "choice needs \"number\": which of the model's choices, from 1");
    choice.number = static_cast<std::uint64_t>(std::max<std::int64_t>(number.value_or(1), 1));
    choice.name = reader.string("name").value_or("");
    choice.tick = static_cast<std::uint64_t>(std::max<std::int64_t>(reader.integer("tick").value_or(0), 0));
    choice.place = reader.string("place").value_or("");
    reader.know("value");
    // null is an alternative like any other.
    if (const auto* value = entry.find("value"); value == nullptr)
      reader.error(entry.span, "scenario.choice", "choice needs \"value\": the alternative that comes");
    else
      choice.value = value->value();
    std::vector<std::string> names;
    for (const ModelEntry& model : scenario.project.models) names.push_back(model.name);
    if (std::find(names.begin(), names.end(), choice.model) == names.end()) {
      reader.error(reader.span("model"), "scenario.choice",
                   fmt::format("the project has no model \"{}\"{}", choice.model, did_you_mean(choice.model, names)));
    }
    scenario.choices->push_back(std::move(choice));
  }
}

void read_orders(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "order", diagnostics);
    ScenarioOrder order;
    order.span = entry.span;
    const auto number = reader.integer("number");
    if (!number || *number < 1) {
      reader.error(entry.span, "scenario.order",
                   "order needs \"number\": which of the times at which something is due for several parts, from 1");
    }
    order.number = static_cast<std::uint64_t>(std::max<std::int64_t>(number.value_or(1), 1));
    order.first = reader.required_string("first");
    order.tick = static_cast<std::uint64_t>(std::max<std::int64_t>(reader.integer("tick").value_or(0), 0));
    scenario.orders.push_back(std::move(order));
  }
}

// Changes that a scenario makes to its project.
void read_overrides(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  YamlReader reader(node, "override", diagnostics);
  if (const auto* skills = reader.mapping("skills")) {
    for (const auto& [name, entry] : skills->entries) {
      YamlReader skill(entry, fmt::format("skill \"{}\"", name.scalar), diagnostics);
      SkillEntry changed{.leaf = name.scalar, .file = {}, .at = {}, .span = name.span};
      const auto old = std::find_if(project.skills.begin(), project.skills.end(),
                                    [&name = name](const auto& s) { return s.leaf == name.scalar; });
      if (old != project.skills.end()) changed = *old;
      read_skill(skill, project, changed, diagnostics);
      if (old != project.skills.end())
        *old = std::move(changed);
      else
        project.skills.push_back(std::move(changed));
    }
  }
  if (const auto* services = reader.mapping("services")) {
    std::vector<std::string> names;
    for (const ServiceEntry& service : project.services) names.push_back(service.name);
    for (const auto& [name, entry] : services->entries) {
      YamlReader service(entry, fmt::format("service \"{}\"", name.scalar), diagnostics);
      const auto at = service.required_string("at");
      const auto old = std::find_if(project.services.begin(), project.services.end(),
                                    [&name = name](const auto& s) { return s.name == name.scalar; });
      if (old != project.services.end()) {
        old->at = at;
        old->span = name.span;
        if (at != "sim") old->publish.clear();
      } else {
        service.error(
            name.span, "scenario.override",
            fmt::format("the project has no service \"{}\"{}", name.scalar, did_you_mean(name.scalar, names)));
      }
    }
  }
  if (const auto* models = reader.sequence("models")) read_models(*models, project, diagnostics);
  if (const auto* mission = reader.mapping("mission"))
    read_mission(*mission, EntriesOf::kScenario, project, diagnostics);
  if (const auto* monitors = reader.sequence("monitors"))
    read_monitors(*monitors, EntriesOf::kScenario, project, diagnostics);
  if (const auto* observers = reader.mapping("observers")) read_observers(*observers, project, diagnostics);
  read_deadlines(reader.mapping("deadlines"), project, diagnostics);
  if (const auto* world = reader.mapping("world")) project.world_overrides = *world;
}

}  // namespace

void apply_overrides(const text::YamlNode& changes, Scenario& scenario, Diagnostics& diagnostics) {
  std::optional<text::YamlNode> world = std::move(scenario.project.world_overrides);
  scenario.project.world_overrides.reset();
  read_overrides(changes, scenario.project, diagnostics);
  if (world) {
    if (scenario.project.world_overrides) merge(*world, *scenario.project.world_overrides);
    scenario.project.world_overrides = std::move(world);
  }
  text::YamlNode key;
  key.kind = text::YamlNode::Kind::kScalar;
  key.scalar = "override";
  text::YamlNode change;
  change.kind = scenario.source.kind = text::YamlNode::Kind::kMapping;
  change.entries.emplace_back(std::move(key), changes);
  merge(scenario.source, change);
}

void Scenario::expect_nothing() {
  mission.reset();
  mission_reason.clear();
  verdicts.clear();
  distinct_processes = false;
}

Scenario plain_scenario(Project project) {
  Scenario scenario;
  scenario.file = project.file;
  // "." has a name too.
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::absolute(project.folder, error).lexically_normal();
  scenario.name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  scenario.project = std::move(project);
  scenario.virtual_time = false;
  return scenario;
}

namespace {

/// @param known  A project that has been read and told of already; null: none.
/// @param is_it  It is the scenario's, whatever that names.
Loaded<Scenario> load_over(const std::filesystem::path& file, const Project* known, bool is_it) {
  Loaded<Scenario> loaded;
  const text::ReadFence fence(file.parent_path(), {shipped_folder("interfaces")});
  const auto source = text::read_file(file);
  if (!source) {
    loaded.diagnostics.push_back(source.error());
    return loaded;
  }
  const auto yaml = text::parse_yaml(*source, file.string());
  if (!yaml) {
    loaded.diagnostics.push_back(yaml.error());
    return loaded;
  }
  Scenario scenario;
  scenario.file = file.string();
  {
    YamlReader reader(*yaml, "the scenario", loaded.diagnostics);
    scenario.name = reader.string("name").value_or(file.stem().string());
    scenario.description = reader.string("description").value_or("");
    const std::filesystem::path named = file.parent_path() / reader.string("project").value_or("..");
    const std::filesystem::path project_path = text::ReadFence::place_of(named).value_or(named);
    const std::filesystem::path from = project_path.lexically_normal();
    const auto is_known = [&] {
      if (is_it) return true;
      const std::filesystem::path its(known->file);
      return its == from || its.parent_path() == from || its.parent_path() / "" == from;
    };
    Loaded<Project> project;
    if (known != nullptr && is_known())
      project.value = *known;
    else
      project = load_project(from);
    if (!project.ok() && reader.node("project") != nullptr && project.diagnostics.front().code.starts_with("file.")) {
      // It can be mended where it is named.
      Diagnostic& why = project.diagnostics.front();
      why.message = fmt::format("the project {}: {}", why.span.file, why.message);
      why.span = reader.span("project");
    }
    loaded.diagnostics.insert(loaded.diagnostics.end(), project.diagnostics.begin(), project.diagnostics.end());
    if (!project.ok()) {
      reader.give_up();
      return loaded;
    }
    scenario.project = std::move(*project.value);
    scenario.project.contents.insert(hash_bytes(*source));

    read_clock(reader, scenario);
    if (const auto seed = reader.integer("seed")) {
      if (*seed < 0) reader.error(reader.span("seed"), "scenario.seed", "a seed is a whole number from 0 on");
      scenario.seed = static_cast<std::uint64_t>(std::max<std::int64_t>(*seed, 0));
    }
    scenario.duration = reader.duration("duration").value_or(scenario.duration);
    scenario.stop_when_violated = reader.boolean("stop_when_violated").value_or(false);
    if (const auto* overrides = reader.mapping("override"))
      read_overrides(*overrides, scenario.project, loaded.diagnostics);
    if (const auto* timeline = reader.sequence("timeline")) read_timeline(*timeline, scenario, loaded.diagnostics);
    for (const Injection& injection : scenario.timeline) {
      if (injection.at.time_since_epoch() <= scenario.duration) continue;
      loaded.diagnostics.push_back({Severity::kWarning, "scenario.too-late",
                                    fmt::format("this is behind the duration of the run, {} s",
                                                std::chrono::duration<double>(scenario.duration).count()),
                                    injection.span});
    }
    if (const auto* choices = reader.sequence("choices")) read_choices(*choices, scenario, loaded.diagnostics);
    if (const auto* orders = reader.sequence("orders")) read_orders(*orders, scenario, loaded.diagnostics);
    if (const auto* loop = reader.mapping("loop")) read_loop(*loop, scenario, loaded.diagnostics);
    if (const auto* delays = reader.sequence("delays")) read_delays(*delays, scenario, loaded.diagnostics);
    if (const auto* processes = reader.mapping("processes")) read_processes(*processes, scenario, loaded.diagnostics);
    if (const auto* expect = reader.mapping("expect")) read_expect(*expect, scenario, loaded.diagnostics);
  }
  scenario.source = *yaml;
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(scenario);
  return loaded;
}

}  // namespace

Loaded<Scenario> load_scenario(const std::filesystem::path& file, const Project* known) {
  return load_over(file, known, false);
}

Loaded<Scenario> load_scenario_of(const Project& project, const std::filesystem::path& file) {
  return load_over(file, &project, true);
}

}  // namespace sentree::project
