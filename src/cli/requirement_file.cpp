#include "sentree/cli/requirement_file.h"

#include <algorithm>

#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::cli {

Loaded<std::vector<monitor::Model>> load_requirement_file(const std::string& file,
                                                          const monitor::Vocabulary* vocabulary) {
  Loaded<std::vector<monitor::Model>> loaded;
  const auto source = text::read_file(file, {}, monitor::kRequirementBytesMax);
  if (!source) {
    loaded.diagnostics = {source.error()};
    return loaded;
  }
  auto parsed = monitor::parse_requirements(*source, file);
  loaded.diagnostics = std::move(parsed.diagnostics);
  if (!parsed.ok()) return loaded;
  monitor::check_definitions(*parsed.value, vocabulary, loaded.diagnostics);
  std::vector<monitor::Model> models;
  for (const monitor::Requirement& requirement : parsed.value->requirements) {
    auto model = monitor::Model::make(requirement, vocabulary);
    // What is wrong with a definition is wrong for each requirement that uses it.
    for (Diagnostic& diagnostic : model.diagnostics) {
      if (std::find(loaded.diagnostics.begin(), loaded.diagnostics.end(), diagnostic) == loaded.diagnostics.end())
        loaded.diagnostics.push_back(std::move(diagnostic));
    }
    if (model.ok()) models.push_back(std::move(*model.value));
  }
  if (models.size() == parsed.value->requirements.size()) loaded.value = std::move(models);
  return loaded;
}

std::filesystem::path project_above(const std::filesystem::path& file) {
  std::error_code error;
  for (auto folder = std::filesystem::absolute(file, error).parent_path();; folder = folder.parent_path()) {
    if (std::filesystem::exists(folder / "sentree.yaml", error)) return folder;
    if (folder == folder.root_path() || folder.empty()) return {};
  }
}

Loaded<monitor::Vocabulary> vocabulary_of_project(const std::filesystem::path& folder) {
  auto project = project::load_project(folder);
  if (project.ok()) return project::load_vocabulary(*project.value);
  Loaded<monitor::Vocabulary> none;
  none.diagnostics = std::move(project.diagnostics);
  return none;
}

}  // namespace sentree::cli
