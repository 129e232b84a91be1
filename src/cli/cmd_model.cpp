#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/tree_files.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/skill_models.h"
#include "sentree/text/file.h"
#include "sentree/text/rewrite.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

using std::filesystem::path;

// A tree stands for the project that it is the mission of, else for itself and the skills/ beside it. So do several
// trees, and folders of trees.
std::optional<project::Project> project_of(const ModelCommand& command) {
  const std::vector<std::string> names = command.files.empty() ? std::vector<std::string>{"."} : command.files;
  std::error_code error;
  const path file(names.front());
  const path folder = file.parent_path().empty() ? path(".") : file.parent_path();
  const bool is_folder = std::filesystem::is_directory(file, error);
  Diagnostics problems;
  const auto files = given_files(names, problems);
  const bool has_trees =
      std::any_of(files.begin(), files.end(), [](const GivenFile& f) { return f.path.extension() == ".xml"; });
  if (std::filesystem::exists(file / "sentree.yaml", error) || file.filename() == "sentree.yaml" ||
      (is_folder ? !has_trees : !std::filesystem::exists(file, error))) {
    auto project = project::load_project(file);
    say(project.diagnostics);
    return std::move(project.value);
  }
  if (names.size() == 1 && std::filesystem::exists(folder / "sentree.yaml", error)) {
    auto project = project::load_project(folder);
    if (project.ok() && std::filesystem::equivalent(folder / project.value->mission.path, file, error))
      return std::move(project.value);
  }
  say(problems);
  if (has_errors(problems)) return std::nullopt;
  project::Project alone;
  alone.folder = is_folder ? file : folder;
  alone.file = (alone.folder / "sentree.yaml").lexically_normal().string();
  for (const GivenFile& given : files) {
    const auto source = text::read_file(given.path);
    if (given.named && given.path.extension() != ".scxml") {
      const auto document = source ? text::XmlDocument::parse(*source, given.path.string(), {.lenient = true})
                                   : tl::unexpected(source.error());
      if (!document || document_kind(*source) != "tree") {
        say(document ? given.path.string() + ": no behavior tree" : to_string(document.error()));
        return std::nullopt;
      }
    }
    if (given.path.extension() == ".scxml" || (!given.named && (!source || document_kind(*source) != "tree"))) continue;
    alone.mission_files.push_back({std::filesystem::proximate(given.path, alone.folder, error).string(), {}});
  }
  if (alone.mission_files.empty()) return alone;
  alone.mission = alone.mission_files.front();
  project::find_mission(alone, {}, problems);
  return alone;
}

Value models_value(const std::vector<bt::NodeModel>& models) {
  List list;
  for (const bt::NodeModel& model : models) {
    List ports;
    for (const bt::PortInfo& port : model.ports) {
      std::string direction(bt::to_string(port.direction));
      direction.resize(direction.find('_'));  // "input_port" …
      Map entry{{"name", port.name}, {"direction", direction}};
      const std::string type = !port.declared_type.empty() ? port.declared_type : port.type ? port.type->name : "";
      entry["type"] = type.empty() ? Value() : Value(type);
      entry["default"] = port.default_text ? Value(*port.default_text) : Value();
      entry["description"] = port.description;
      ports.push_back(std::move(entry));
    }
    list.push_back(Map{{"id", model.id}, {"category", bt::to_string(model.category)}, {"ports", std::move(ports)}});
  }
  return Map{{"models", std::move(list)}};
}

int write_to(const path& file, const std::string& content) {
  if (const auto written = text::write_file(file, content); !written) {
    say(to_string(written.error()));
    return kEnvironment;
  }
  return kOk;
}

int insert_into(const path& file, const std::vector<bt::NodeModel>& models) {
  const auto source = text::read_file(file);
  if (!source) {
    say(to_string(source.error()));
    return kInvalidInput;
  }
  const auto changed = bt::with_models(*source, models, file.string());
  if (!changed) {
    say(to_string(changed.error()));
    return kInvalidInput;
  }
  if (*changed == *source) return kOk;
  if (const auto written = text::rewrite_file(file, *changed); !written) {
    say(to_string(written.error()));
    return kEnvironment;
  }
  return kOk;
}

}  // namespace

int model(const ModelCommand& command) {
  auto project = project_of(command);
  if (!project) return kInvalidInput;
  for (const std::string& palette : command.trees.palettes) project->palettes.push_back(palette_file(palette));
  for (const std::string& folder : command.trees.packages)
    project->packages.push_back({std::filesystem::absolute(folder).string(), {}});
  const auto models = project::skill_models(*project);
  say(models.diagnostics);
  if (!models.ok()) return kInvalidInput;
  if (!command.into.empty()) return insert_into(command.into, *models.value);
  const std::string content =
      command.json ? to_json(models_value(*models.value)) + "\n"
                   : fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<root BTCPP_format=\"4\">\n{}</root>\n",
                                 bt::write_models(*models.value));
  if (!command.output.empty()) return write_to(command.output, content);
  print(content);
  return kOk;
}

}  // namespace sentree::cli
