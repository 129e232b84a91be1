#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "sentree/campaign/check.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/document.h"
#include "sentree/cli/output.h"
#include "sentree/cli/requirement_file.h"
#include "sentree/cli/tree_files.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/check.h"
#include "sentree/sim/world.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::cli {

namespace {

// The same finding may be reached through the project and through each of its scenarios.
void add_new(Diagnostics& all, const Diagnostics& found) {
  for (const Diagnostic& diagnostic : found) {
    if (std::find(all.begin(), all.end(), diagnostic) == all.end()) all.push_back(diagnostic);
  }
}

// What is said of the projects that charts lie in, by folder: each is checked once.
struct ProjectFindings {
  Diagnostics all;
  std::set<std::filesystem::path> files;  ///< That were read.
  bool told = false;                      ///< That it has errors elsewhere.
};
using KnownProjects = std::map<std::filesystem::path, ProjectFindings>;

std::filesystem::path whole_path(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::weakly_canonical(file, error);
}

// What the project above a chart says of it, if that names the chart: services, leaves and what is renamed for it are
// known then. Nothing: it stands alone.
std::optional<Diagnostics> check_in_project(const std::filesystem::path& chart, KnownProjects& projects) {
  const std::filesystem::path folder = project_above(chart);
  if (folder.empty()) return std::nullopt;
  const auto [slot, is_new] = projects.try_emplace(folder);
  ProjectFindings& found = slot->second;
  if (is_new) {
    const text::ReadLog log;
    found.all = project::check_project(folder);
    for (const text::ReadFile& file : log.files()) found.files.insert(whole_path(file.path));
  }
  const std::filesystem::path wanted = whole_path(chart);
  if (!found.files.contains(wanted)) return std::nullopt;
  Diagnostics own;
  bool others = false;
  for (Diagnostic diagnostic : found.all) {
    if (whole_path(diagnostic.span.file) == wanted) {
      diagnostic.span.file = chart.string();
      own.push_back(std::move(diagnostic));
    } else {
      others = others || diagnostic.severity == Severity::kError;
    }
  }
  if (others && !std::exchange(found.told, true)) {
    own.push_back(
        {Severity::kWarning, "check.project",
         fmt::format("the project in {} has errors elsewhere, so not all that it says of its charts could be checked",
                     folder.string()),
         SourceSpan{chart.string()}});
  }
  return own;
}

// A chart; of one that stands alone the services are taken on trust.
Diagnostics check_chart(const std::filesystem::path& path, KnownProjects& projects) {
  if (auto found = check_in_project(path, projects)) return std::move(*found);
  const auto source = text::read_file(path);
  if (!source) return {source.error()};
  auto loaded = look_at_chart(*source, path.string());
  if (loaded.value) {
    const Diagnostics found = scxml::check(*loaded.value);
    loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
    if (loaded.value->obstacle()) {
      loaded.diagnostics.push_back({Severity::kNote, "scxml.not-run",
                                    "the chart can be drawn, formatted and compared; running it is refused: " +
                                        loaded.value->obstacle()->message,
                                    SourceSpan{path.string()}});
    }
  }
  sort_by_place(loaded.diagnostics);
  return loaded.diagnostics;
}

// Requirements against the project above them; without one, or if it is broken, as far as they stand alone.
Diagnostics check_requirements(const std::filesystem::path& path) {
  const std::filesystem::path folder = project_above(path);
  const auto known = folder.empty() ? Loaded<monitor::Vocabulary>() : vocabulary_of_project(folder);
  auto loaded = load_requirement_file(path.string(), known.ok() ? &*known.value : nullptr);
  if (!folder.empty() && !known.ok()) {
    loaded.diagnostics.push_back(
        {.severity = Severity::kWarning,
         .code = "monitor.no-vocabulary",
         .message = fmt::format(
             "its services and leaves are taken on trust, since the project in {} does not load; check that first",
             folder.string()),
         .span = SourceSpan{path.string()}});
  }
  sort_by_place(loaded.diagnostics);
  return loaded.diagnostics;
}

// Whether the file is a scenario: it has no mission of its own.
bool is_scenario(const std::filesystem::path& path) {
  if (path.extension() != ".yaml" || path.filename() == "sentree.yaml") return false;
  const auto source = text::read_file(path);
  const auto yaml = source ? text::parse_yaml(*source) : tl::unexpected(source.error());
  return yaml && yaml->is_mapping() && yaml->find("mission") == nullptr;
}

Diagnostics check_scenario(const std::filesystem::path& path) {
  auto scenario = project::load_scenario(path);
  Diagnostics all = std::move(scenario.diagnostics);
  if (!scenario.ok()) return all;
  add_new(all, project::prepare(std::move(*scenario.value)).diagnostics);
  return all;
}

// A project, or a file that is neither a tree nor a chart.
Diagnostics check_one(const std::string& path) {
  const std::filesystem::path file(path);
  if (file.extension() == ".mcap")
    return {{Severity::kError, "check.recording", "a recording; `sentree info` and `sentree monitor check` take it",
             SourceSpan{path}}};
  if (is_world(path)) return sim::load_world(path).diagnostics;
  if (file.extension() == ".req") return check_requirements(file);
  const std::string ending = file.extension().string();
  if (ending == ".thrift" || ending == ".msg" || ending == ".srv" || ending == ".action")
    return project::load_interface(file, path).diagnostics;
  if (campaign::is_vary(file)) return campaign::check_vary(file);
  if (is_scenario(file)) return check_scenario(file);
  return campaign::check_project(path);
}

// Whether that is a project, and not just a folder with trees and charts in it.
bool is_project(const std::filesystem::path& path) {
  std::error_code error;
  return !std::filesystem::is_directory(path, error) || std::filesystem::exists(path / "sentree.yaml", error);
}

// Folders with a sentree.yaml below one that has none, sorted.
std::vector<std::filesystem::path> projects_below(const std::string& folder) {
  std::vector<std::filesystem::path> found;
  std::size_t seen = 0;  // that there are more is told by `given_files`
  std::error_code error;
  for (auto at = std::filesystem::recursive_directory_iterator(
           folder, std::filesystem::directory_options::skip_permission_denied, error);
       !error && at != decltype(at)() && ++seen <= kGivenEntriesMax; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with('.')) at.disable_recursion_pending();
    if (name == "sentree.yaml") found.push_back(at->path().parent_path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// What is said of a folder that is no project, where that may be a slip.
Diagnostics no_project(const std::string& folder, bool has_any) {
  const std::filesystem::path path(folder);
  std::error_code error;
  if (std::filesystem::exists(path / "sentree.yml", error))
    return {{Severity::kError, "check.no-project", "a project's file is called sentree.yaml; rename this one",
             SourceSpan{(path / "sentree.yml").string()}}};
  constexpr const char* kParts[] = {"skills", "scenarios", "requirements", "monitors", "models", "interfaces"};
  const bool has_parts = std::any_of(std::begin(kParts), std::end(kParts), [&](const char* part) {
    return std::filesystem::is_directory(path / part, error);
  });
  if (has_any || !has_parts) return {};
  return {{Severity::kNote, "check.no-project",
           "no project, for want of a sentree.yaml (sentree init makes one); its trees and charts are looked at one by "
           "one",
           SourceSpan{folder}}};
}

// Folders of a project that nobody looks into for the want of a letter.
Diagnostics misspelt_folders(const std::string& project) {
  const std::filesystem::path folder(project);
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) return {};
  Diagnostics found;
  for (const auto& [wrong, right] : {std::pair("scenario", "scenarios"), std::pair("skill", "skills")}) {
    if (!std::filesystem::is_directory(folder / wrong, error)) continue;
    found.push_back({Severity::kWarning, "check.unknown-folder",
                     fmt::format("{0} are looked for in {0}/ only; put what is here there", right),
                     SourceSpan{(folder / wrong).string()}});
  }
  return found;
}

// A finding in a file that several others use is told once.
class Findings {
 public:
  void add(const Diagnostics& found) {
    for (const Diagnostic& diagnostic : found) {
      if (told_.insert(to_string(diagnostic)).second) all.push_back(diagnostic);
    }
  }
  Diagnostics all;

 private:
  std::set<std::string> told_;
};

Diagnostics check_all(const CheckCommand& command) {
  Findings findings;
  std::vector<std::string> trees_and_charts;
  std::set<std::filesystem::path> read;  // By projects below a folder, which say all that there is to say of them.
  bool has_projects = false;
  for (const std::string& name : command.files.empty() ? std::vector<std::string>{"."} : command.files) {
    const auto ending = std::filesystem::path(name).extension();
    std::error_code error;
    const auto source = std::filesystem::is_regular_file(name, error) ? text::read_file(name) : Result<std::string>();
    if (!is_project(name)) {
      const text::ReadLog log;
      bool has_any = false;
      for (const std::filesystem::path& project : projects_below(name)) {
        findings.add(check_one(project.string()));
        findings.add(misspelt_folders(project.string()));
        has_projects = has_any = true;
      }
      findings.add(no_project(name, has_any));
      for (const text::ReadFile& file : log.files()) read.insert(whole_path(file.path));
    }
    if (ending == ".xml" || ending == ".scxml" || !is_project(name) ||
        (source && is_xml_source(*source) && !other_kind(name)))
      trees_and_charts.push_back(name);
    else
      findings.add(check_one(name));
    findings.add(misspelt_folders(name));
  }
  Diagnostics problems;
  const std::vector<GivenFile> files = given_files(trees_and_charts, problems);
  // The hint that a project is a folder with a sentree.yaml.
  if (files.empty() && !trees_and_charts.empty() && problems.empty() && !has_projects)
    problems = check_one(trees_and_charts.front());
  const TreeFiles trees(files, command.trees, problems);
  KnownProjects projects;
  findings.add(problems);
  for (const GivenFile& file : files) {
    if (!file.named && !read.empty() && read.contains(whole_path(file.path))) continue;
    const auto source = text::read_file(file.path);
    const std::string kind = source ? document_kind(*source) : "";
    if (kind == "chart" || (kind.empty() && file.path.extension() == ".scxml"))
      findings.add(check_chart(file.path, projects));
    else if (kind == "tree" || file.named || !source || !is_well_formed(*source))
      findings.add(trees.load(file.path).diagnostics);
  }
  return findings.all;
}

}  // namespace

int check(const CheckCommand& command) {
  const Diagnostics found = check_all(command);
  const auto errors =
      std::count_if(found.begin(), found.end(), [](const Diagnostic& d) { return d.severity == Severity::kError; });
  const auto warnings =
      std::count_if(found.begin(), found.end(), [](const Diagnostic& d) { return d.severity == Severity::kWarning; });
  if (command.json) {
    print(to_json(Value(Map{{"errors", errors}, {"warnings", warnings}, {"diagnostics", to_value(found)}})) + "\n");
  } else {
    print(told(found));
    if (found.empty())
      print("nothing to complain about\n");
    else
      print(fmt::format("{} error{}, {} warning{}\n", errors, errors == 1 ? "" : "s", warnings,
                        warnings == 1 ? "" : "s"));
  }
  return errors > 0 ? kInvalidInput : warnings > 0 ? kFindings : kOk;
}

}  // namespace sentree::cli
