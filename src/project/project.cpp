#include "sentree/project/project.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/project/faults_file.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/plan.h"
#include "sentree/project/requirements.h"
#include "sentree/project/timeline.h"
#include "sentree/project/yaml_reader.h"
#include "sentree/text/file.h"
#include "sentree/text/read_fence.h"

namespace sentree::project {

namespace {

using std::filesystem::path;

// "12.5 ms" → 12.5 and "ms".
std::optional<std::pair<double, std::string_view>> number_and_unit(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
  return std::pair{number, unit};
}

std::string stem(const std::string& path) { return std::filesystem::path(path).stem().string(); }

FileRef file_ref(YamlReader& reader, const std::string& key) { return {reader.required_string(key), reader.span(key)}; }

}  // namespace

bool is_inside(std::string_view at) { return at == "sim" || at == "model" || at == "topics"; }

namespace {

// Paths below the folder that a pattern with '*' names, sorted; '*' stands for text without a slash.
void expand(const path& folder, const path& done, const std::vector<std::string>& parts, std::size_t at,
            std::vector<std::string>& found) {
  if (found.size() > kMissionFilesMax) return;
  if (at == parts.size()) {
    found.push_back(done.generic_string());
    return;
  }
  if (parts[at].find('*') == std::string::npos) {
    expand(folder, done / parts[at], parts, at + 1, found);
    return;
  }
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder / done, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && matches_pattern(parts[at], name)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    const bool is_last = at + 1 == parts.size();
    if (is_last ? std::filesystem::is_regular_file(folder / done / name, error)
                : std::filesystem::is_directory(folder / done / name, error))
      expand(folder, done / name, parts, at + 1, found);
  }
}

void read_mission_files(YamlReader& reader, Project& project) {
  project.mission_files.clear();
  for (const std::string& pattern : reader.strings("files")) {
    std::vector<std::string> parts;
    for (const path& part : path(pattern)) parts.push_back(part.string());
    std::vector<std::string> found;
    expand(project.folder, {}, parts, 0, found);
    if (found.size() > kMissionFilesMax || project.mission_files.size() + found.size() > kMissionFilesMax) {
      reader.error(reader.span("files"), "project.too-many-files",
                   fmt::format("\"{}\": a mission has at most {} files", pattern, kMissionFilesMax));
      return;
    }
    if (found.empty())
      reader.error(reader.span("files"), "project.no-file",
                   fmt::format("\"{}\" matches no file in {}", pattern, project.folder.string()));
    for (std::string& file : found) {
      const auto same = [&](const FileRef& known) { return known.path == file; };
      if (std::none_of(project.mission_files.begin(), project.mission_files.end(), same))
        project.mission_files.push_back({std::move(file), reader.span("files")});
    }
  }
}

}  // namespace

namespace {

// One by one over what is there: a scenario may change some of them.
void read_entries(YamlReader& reader, Project& project) {
  const auto* const entries = reader.mapping("entries");
  if (entries == nullptr) return;
  for (const auto& [name, value] : entries->entries) {
    if (name.scalar.empty() || name.scalar.find_first_of("@{}") != std::string::npos) {
      reader.error(
          name.span, "project.entry",
          fmt::format("\"{}\" is no name of an entry; write it as scripts do, without @ and braces", name.scalar));
      continue;
    }
    if (!value.is_scalar()) {
      reader.error(value.is_null() ? name.span : value.span, "project.entry",
                   fmt::format("entry \"{}\" must begin with a number, true, false or a text; a list is a text as in "
                               "ports: \"1;2;3\"",
                               name.scalar));
      continue;
    }
    const auto old = std::find_if(project.entries.begin(), project.entries.end(),
                                  [&name = name](const MissionEntry& entry) { return entry.name == name.scalar; });
    MissionEntry entry{name.scalar, value.value(), name.span};
    if (old != project.entries.end())
      *old = std::move(entry);
    else
      project.entries.push_back(std::move(entry));
  }
}

}  // namespace

void read_mission(const text::YamlNode& node, EntriesOf whose, Project& project, Diagnostics& diagnostics) {
  YamlReader reader(node, "mission", diagnostics);
  const bool has_files = reader.node("files") != nullptr;
  const bool has_file = reader.node("file") != nullptr;
  if (has_file || (!has_files && whose == EntriesOf::kProject)) project.mission = file_ref(reader, "file");
  project.tree = reader.string("tree").value_or(project.tree);
  if (has_files) read_mission_files(reader, project);
  if (!has_file && (has_files || reader.node("tree") != nullptr))
    find_mission(project, has_files ? reader.span("files") : reader.span("tree"), diagnostics);
  project.repeat = reader.boolean("repeat").value_or(project.repeat);
  project.executed_by = reader.string("executed_by").value_or(project.executed_by);
  read_entries(reader, project);
  if (const auto rate = reader.string("rate")) {
    if (const auto period = parse_rate(*rate))
      project.period = *period;
    else
      reader.error(reader.span("rate"), "project.rate",
                   fmt::format("rate \"{}\" is not a rate such as 10 Hz, from 0.01 to 1000 Hz", *rate));
  }
}

namespace {

ServiceEntry read_interface(YamlReader& reader, const text::YamlNode& name) {
  ServiceEntry service{
      .name = name.scalar, .idl = {}, .interface = {}, .at = {}, .robot = {}, .observed = {}, .span = name.span};
  const std::string interface = reader.required_string("interface");
  auto [file, of] = interface_name(interface);
  if (file.empty() && !interface.empty()) {
    reader.error(reader.span("interface"), "project.interface",
                 fmt::format("interface \"{}\" must be FILE.thrift/SERVICE, e.g. robot.thrift/Battery, or of ROS "
                             "PACKAGE/srv/NAME, e.g. std_srvs/srv/SetBool",
                             interface));
  }
  service.idl = std::move(file);
  service.interface = std::move(of);
  return service;
}

void read_observed(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    YamlReader reader(entry, fmt::format("what is observed as \"{}\"", name.scalar), diagnostics);
    ServiceEntry observed = read_interface(reader, name);
    observed.observed = reader.required_string("at");
    observed.at = "topics";
    if (project.service(name.scalar) != nullptr) {
      reader.error(
          name.span, "project.duplicate",
          fmt::format("\"{}\" is a service already, and what passes there is observed; give what others say to "
                      "each other another name",
                      name.scalar));
    }
    if (!observed.observed.empty()) project.services.push_back(std::move(observed));
  }
}

void read_services(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    YamlReader reader(entry, fmt::format("service \"{}\"", name.scalar), diagnostics);
    ServiceEntry service = read_interface(reader, name);
    service.at = reader.string("at").value_or("sim");
    service.robot = reader.string("robot").value_or("");
    if (const auto* publish = reader.mapping("publish")) {
      for (const auto& [method, rate] : publish->entries) {
        const auto period = parse_rate(rate.scalar);
        if (period)
          service.publish.push_back({method.scalar, *period, method.span});
        else
          reader.error(rate.span, "project.rate",
                       fmt::format("\"{}\" is no rate from 0.01 Hz to 1000 Hz, e.g. 2 Hz", rate.scalar));
      }
    }
    service.idempotent = reader.strings("idempotent");
    service.idempotent_span = reader.span("idempotent");
    project.services.push_back(std::move(service));
  }
}

void read_fault_section(const text::YamlNode& node, VerifySection& verify, Diagnostics& diagnostics) {
  YamlReader faults(node, "faults", diagnostics);
  if (const auto at_most = faults.integer("at_most")) {
    if (*at_most < 0) faults.error(faults.span("at_most"), "project.verify", "at_most must be 0 or more");
    verify.faults_at_most = static_cast<std::size_t>(std::max<std::int64_t>(*at_most, 0));
  }
  const auto* any_of = faults.sequence("any_of");
  if (any_of == nullptr) return;
  for (const text::YamlNode& entry : any_of->items) {
    YamlReader fault(entry, "fault", diagnostics);
    std::vector<std::string_view> words;
    std::size_t said = 0;
    for (const Intervention& kind : every_kind()) {
      if (!kind_of(kind).fault) continue;
      words.push_back(word_of(kind));
      said += fault.node(std::string(words.back())) != nullptr ? 1U : 0U;
    }
    if (said != 1) {
      fault.error(entry.span, "project.verify", fmt::format("a fault is one of {}", fmt::join(words, ", ")));
      continue;
    }
    Intervention what = read_intervention(fault, entry, diagnostics);
    if (std::find(verify.faults.begin(), verify.faults.end(), what) != verify.faults.end()) {
      fault.error(entry.span, "project.verify", "this fault is named twice; one and the same stands once at a time");
      continue;
    }
    verify.faults.push_back(std::move(what));
    verify.fault_spans.push_back(entry.span);
  }
  if (verify.faults_at_most == 0 && !verify.faults.empty()) {
    diagnostics.push_back({Severity::kWarning, "project.verify",
                           "at_most is 0, so none of these faults is ever tried; write 1 or more, or leave them out",
                           faults.span("at_most")});
  }
}

void read_verify(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  YamlReader reader(node, "verify", diagnostics);
  VerifySection& verify = project.verify;
  verify.span = node.span;
  verify.fair = reader.strings("fair");
  verify.fair_span = reader.span("fair");
  if (const auto* section = reader.mapping("faults")) read_fault_section(*section, verify, diagnostics);
}

void read_skills(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    YamlReader reader(entry, fmt::format("skill \"{}\"", name.scalar), diagnostics);
    SkillEntry skill{.leaf = name.scalar, .file = {}, .at = {}, .span = name.span};
    read_skill(reader, project, skill, diagnostics);
    project.skills.push_back(std::move(skill));
  }
}

void read_rename(const text::YamlNode& name, const text::YamlNode& entry, MonitorEntry& monitor,
                 Diagnostics& diagnostics) {
  const std::string what = fmt::format("event \"{}\"", name.scalar);
  YamlReader reader(entry, what, diagnostics);
  EventRename rename{.event = name.scalar,
                     .on = reader.strings("on"),
                     .from = reader.strings("from"),
                     .data = {},
                     .when = reader.string("when").value_or(""),
                     .span = entry.span,
                     .from_span = reader.span("from")};
  if (rename.on.empty() && entry.find("on") == nullptr)
    reader.error(entry.span, "project.missing-key", what + " needs \"on\": the observations that it stands for");
  if (const auto* data = reader.mapping("data")) {
    for (const auto& [member, expression] : data->entries) {
      if (expression.is_scalar())
        rename.data.emplace_back(member.scalar, expression.scalar);
      else
        reader.error(expression.span, "project.type", fmt::format("data of {} must be expressions", what));
    }
  }
  if (rename.when == "changed" && rename.data.empty())
    reader.error(reader.span("when"), "project.when", what + " has no \"data\" that could change");
  // Any other word is an expression, with what `data` names.
  static const std::vector<std::string> kChanged{"changed"};
  const bool is_datum = std::any_of(rename.data.begin(), rename.data.end(),
                                    [&](const auto& datum) { return datum.first == rename.when; });
  if (const std::string near = did_you_mean(rename.when, kChanged); !near.empty() && !is_datum)
    reader.error(reader.span("when"), "project.when", fmt::format("when of {} is \"{}\"{}", what, rename.when, near));
  monitor.events.push_back(std::move(rename));
}

// One source of each event, or a list of them.
void read_renames(const text::YamlNode& node, MonitorEntry& monitor, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    if (entry.is_sequence()) {
      for (const text::YamlNode& source : entry.items) read_rename(name, source, monitor, diagnostics);
    } else {
      read_rename(name, entry, monitor, diagnostics);
    }
  }
}

}  // namespace

void read_plugins(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    if (entry.is_scalar() && !entry.scalar.empty())
      project.plugins.push_back({entry.scalar, entry.span});
    else
      diagnostics.push_back(
          {Severity::kError, "project.type", "a plug-in is the path of a shared library", entry.span});
  }
}

namespace {

// Files and folders that `key` lists; one alone may stand without a list.
std::vector<FileRef> file_refs(YamlReader& reader, const std::string& key) {
  std::vector<FileRef> all;
  for (std::string& file : reader.strings(key)) all.push_back({std::move(file), reader.span(key)});
  return all;
}

}  // namespace

void read_models(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "model", diagnostics);
    ModelEntry model;
    model.file = file_ref(reader, "file");
    model.name = reader.string("name").value_or(stem(model.file.path));
    model.serves = reader.strings("serves");
    model.serves_span = reader.span("serves");
    model.span = entry.span;
    model.subscribes = {reader.strings("subscribe"), {}, reader.span("subscribe")};
    const auto other = std::find_if(project.models.begin(), project.models.end(),
                                    [&](const ModelEntry& one) { return one.name == model.name; });
    if (other != project.models.end() && !model.name.empty()) {
      reader.error(entry.span, "project.duplicate",
                   fmt::format("two models are named \"{}\"; the other is at {}; give one another name with \"name\"",
                               model.name, to_string(other->span)));
      continue;
    }
    project.models.push_back(std::move(model));
  }
}

namespace {

// Of an entry with the name of another one.
std::string twice(const MonitorEntry& one, const MonitorEntry& other) {
  const std::string where = to_string(other.span);
  if (one.file.path == other.file.path && !one.requirement.empty())
    return fmt::format("{} is named at {} already; take one of the two out", one.file.path, where);
  const bool is_requirement = !one.requirement.empty() || !other.requirement.empty();
  return fmt::format("two monitors are named \"{}\"; the other is at {}; give one another name{}", one.name, where,
                     is_requirement ? fmt::format(", in {}", one.requirement.empty() ? other.file.path : one.file.path)
                                    : " with \"name\"");
}

}  // namespace

void read_monitors(const text::YamlNode& node, EntriesOf whose, Project& project, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "monitor", diagnostics);
    MonitorEntry monitor;
    monitor.file = file_ref(reader, "file");
    monitor.name = reader.string("name").value_or(stem(monitor.file.path));
    monitor.violated = reader.strings("violated");
    monitor.span = entry.span;
    if (const auto* events = reader.mapping("events")) read_renames(*events, monitor, diagnostics);
    monitor.gate = reader.strings("gate");
    monitor.gate_span = reader.span("gate");
    monitor.at = reader.string("at").value_or("");
    const MonitorEntry* clash = nullptr;  // The first of the entry: of a file that stands twice all do.
    for (MonitorEntry& one : expand_requirements(project, std::move(monitor))) {
      auto other = std::find_if(project.monitors.begin(), project.monitors.end(),
                                [&](const auto& m) { return m.name == one.name; });
      // What its requirements are called is not known; what is wrong with it is said when it is followed.
      if (is_unread_requirements(one)) other = project.monitors.end();
      if (other == project.monitors.end())
        project.monitors.push_back(std::move(one));
      else if (whose == EntriesOf::kScenario)
        *other = std::move(one);
      else if (std::exchange(clash, &*other) == nullptr)
        reader.error(entry.span, "project.duplicate", twice(one, *other));
    }
  }
}

// Something that listens: "true", PORT or HOST:PORT; "false" is nowhere.
struct PlaceKey {
  const char* key;
  const char* example;  // of a port
  int least = 0;        // port; 0, any free one, is no other's business
  int most = 65535;
  bool with_host = false;
};

void read_place(YamlReader& reader, const PlaceKey& key, std::string& place, SourceSpan& span) {
  const auto text = reader.string(key.key);
  if (!text || *text == "false") return;
  span = reader.span(key.key);
  place = *text;
  if (*text == "true") return;
  const std::size_t colon = text->rfind(':');
  const std::string port = colon == std::string::npos ? *text : text->substr(colon + 1);
  int number = -1;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  const bool is_port = error == std::errc() && end == port.data() + port.size() && number <= key.most &&
                       (number >= key.least || (number == 0 && !key.with_host));
  if (is_port && colon != 0 && (colon != std::string::npos || !key.with_host)) return;
  reader.error(
      span, "project.place",
      fmt::format("{}: \"{}\" is neither true, false{} nor HOST:PORT such as 127.0.0.1:{}", key.key, *text,
                  key.with_host ? "" : fmt::format(", a port from {} to {}", key.least, key.most), key.example));
}

void read_observers(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries) {
    YamlReader reader(entry, fmt::format("observer \"{}\"", name.scalar), diagnostics);
    project.observers.push_back({name.scalar, reader.required_string("at"), name.span});
  }
}

void read_deadlines(const text::YamlNode* node, Project& project, Diagnostics& diagnostics) {
  Deadlines& d = project.deadlines;
  if (node != nullptr) {
    YamlReader reader(*node, "deadlines", diagnostics);
    d.call = reader.duration("call").value_or(d.call);
    d.condition = reader.duration("condition").value_or(d.condition);
    d.budget = reader.duration("budget").value_or(d.budget);
    d.halt = reader.duration("halt").value_or(d.halt);
    d.unresponsive = reader.duration("unresponsive").value_or(d.unresponsive);
    d.script = reader.duration("script").value_or(d.script);
  }
  if (d.budget.count() == 0) d.budget = project.period;
  if (d.call.count() == 0) d.call = d.budget * 2 / 5;
  if (d.condition.count() == 0) d.condition = d.budget * 4 / 5;
  if (d.call < d.condition && d.condition < d.budget) return;
  const auto ms = [](Duration duration) { return fmt::format("{} ms", duration.count() / 1'000'000); };
  diagnostics.push_back({Severity::kError, "project.deadlines",
                         fmt::format("deadlines must nest: call ({}) < condition ({}) < tick budget ({}); otherwise a "
                                     "slow call is judged by the wrong one",
                                     ms(d.call), ms(d.condition), ms(d.budget)),
                         node != nullptr ? node->span : SourceSpan{project.file}});
}

std::optional<Duration> parse_rate(std::string_view text) {
  const auto read = number_and_unit(text);
  if (!read || (read->second != "Hz" && !read->second.empty())) return std::nullopt;
  if (!(read->first >= 0.01 && read->first <= 1000.0)) return std::nullopt;
  return from_seconds(1.0 / read->first);
}

std::optional<Duration> parse_duration(std::string_view text) {
  const auto read = number_and_unit(text);
  if (!read || !(read->first >= 0.0)) return std::nullopt;
  double unit_s = 0;
  if (read->second == "us")
    unit_s = 1e-6;
  else if (read->second == "ms")
    unit_s = 1e-3;
  else if (read->second == "s")
    unit_s = 1.0;
  else if (read->second == "min")
    unit_s = 60.0;
  else if (read->second == "h")
    unit_s = 3600.0;
  else
    return std::nullopt;
  constexpr double kLongest_s = 10 * 366 * 86400.0;  // times that are added up, and multiples, fit
  if (!(read->first * unit_s <= kLongest_s)) return std::nullopt;
  return from_seconds(read->first * unit_s);
}

const ServiceEntry* Project::service(std::string_view name) const {
  const auto found = std::find_if(services.begin(), services.end(), [&](const auto& s) { return s.name == name; });
  return found == services.end() ? nullptr : &*found;
}

const SkillEntry* Project::skill(std::string_view leaf_name, std::string_view leaf_id) const {
  for (const std::string_view wanted : {leaf_name, leaf_id}) {
    const auto found = std::find_if(skills.begin(), skills.end(), [&](const auto& s) { return s.leaf == wanted; });
    if (found != skills.end()) return &*found;
  }
  return nullptr;
}

std::string Project::shown(std::string_view path) const {
  const std::filesystem::path above = std::filesystem::path(file).parent_path();
  return (above / std::filesystem::path(path)).lexically_normal().string();
}

void read_faults(const std::filesystem::path& file, VerifySection& verify, Diagnostics& diagnostics) {
  const auto source = text::read_file(file);
  if (!source) return diagnostics.push_back(source.error());
  const auto yaml = text::parse_yaml(*source, file.string());
  if (!yaml) return diagnostics.push_back(yaml.error());
  verify.faults.clear();
  verify.fault_spans.clear();
  verify.faults_at_most = 1;
  if (yaml->find("faults") == nullptr) return read_fault_section(*yaml, verify, diagnostics);
  YamlReader reader(*yaml, "the file of faults", diagnostics);
  if (const auto* section = reader.mapping("faults")) read_fault_section(*section, verify, diagnostics);
}

// Keys that are no slip but for the file that they stand in.
constexpr std::string_view kOfScenarios[] = {"clock",    "seed",   "duration",  "stop_when_violated",
                                             "timeline", "delays", "processes", "expect"};

Loaded<Project> load_project(const std::filesystem::path& folder_or_file) {
  Loaded<Project> loaded;
  std::filesystem::path file = folder_or_file;
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) file /= "sentree.yaml";
  const text::ReadFence fence(file.parent_path(), {shipped_folder("interfaces")});
  const auto source = text::read_file(file);
  if (!source) {
    loaded.diagnostics.push_back(source.error());
    loaded.diagnostics.back().message += "; a project is a folder with a sentree.yaml (sentree init makes one)";
    return loaded;
  }
  const auto yaml = text::parse_yaml(*source, file.string());
  if (!yaml) {
    loaded.diagnostics.push_back(yaml.error());
    return loaded;
  }
  Project project;
  project.contents.insert(hash_bytes(*source));
  project.folder = file.parent_path();
  if (project.folder.empty()) project.folder = ".";
  project.file = file.string();
  {
    YamlReader reader(*yaml, "the project", loaded.diagnostics);
    for (const auto& [key, value] : yaml->entries) {
      if (std::find(std::begin(kOfScenarios), std::end(kOfScenarios), key.scalar) == std::end(kOfScenarios)) continue;
      reader.error(key.span, "project.unknown-key",
                   fmt::format("the project has no key \"{0}\": {0} stands in a scenario, such as scenarios/NAME.yaml",
                               key.scalar));
      reader.know(key.scalar);
    }
    if (const auto* mission = reader.node("mission"))
      read_mission(*mission, EntriesOf::kProject, project, loaded.diagnostics);
    else
      reader.error(yaml->span, "project.missing-key", "the project needs \"mission\": {file: mission.xml}");
    if (const auto* services = reader.mapping("services")) read_services(*services, project, loaded.diagnostics);
    if (const auto* observed = reader.mapping("observe")) read_observed(*observed, project, loaded.diagnostics);
    if (const auto* models = reader.sequence("models")) read_models(*models, project, loaded.diagnostics);
    if (const auto* verify = reader.mapping("verify")) read_verify(*verify, project, loaded.diagnostics);
    if (const auto* protocols = reader.mapping("protocols")) read_protocols(*protocols, project, loaded.diagnostics);
    if (const auto* skills = reader.mapping("skills")) read_skills(*skills, project, loaded.diagnostics);
    if (const auto* monitors = reader.sequence("monitors"))
      read_monitors(*monitors, EntriesOf::kProject, project, loaded.diagnostics);
    if (const auto* observers = reader.mapping("observers")) read_observers(*observers, project, loaded.diagnostics);
    project.palettes = file_refs(reader, "palettes");
    project.packages = file_refs(reader, "packages");
    if (const auto* plugins = reader.sequence("plugins")) read_plugins(*plugins, project, loaded.diagnostics);
    read_deadlines(reader.mapping("deadlines"), project, loaded.diagnostics);
    // The two ports beside Groot's must be there.
    read_place(reader, {.key = "groot", .example = "1667", .least = 2, .most = 65532}, project.groot,
               project.groot_span);
    read_place(reader, {.key = "foxglove", .example = "8765"}, project.foxglove, project.foxglove_span);
    read_place(reader, {.key = "yarp_server", .example = "10000", .least = 1, .with_host = true}, project.yarp_server,
               project.yarp_server_span);
    if (const auto durable = reader.string("durable"); durable && *durable != "false") {
      project.durable = *durable == "true" ? JournalSync::kInterval : parse_journal_sync(*durable);
      if (!project.durable)
        reader.error(reader.span("durable"), "project.durable",
                     fmt::format("\"{}\" is none of true, false, never, interval and each", *durable));
    }
    if (const auto world = reader.string("world")) project.world = FileRef{*world, reader.span("world")};
  }
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(project);
  return loaded;
}

std::optional<JournalSync> parse_journal_sync(std::string_view text) {
  if (text == "never") return JournalSync::kNever;
  if (text == "interval") return JournalSync::kInterval;
  if (text == "each") return JournalSync::kEach;
  return std::nullopt;
}

std::vector<std::filesystem::path> scenario_files(const Project& project) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(project.folder / "scenarios", error)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace sentree::project
