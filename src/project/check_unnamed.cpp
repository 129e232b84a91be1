#include "sentree/project/check_unnamed.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sentree/base/ascii.h"
#include "sentree/bt/model.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {

namespace {

namespace fs = std::filesystem;

struct Unnamed {
  fs::path file;     ///< Relative to the project's folder.
  std::string name;  ///< By which it may be named.
};

// Whether a name stands in a text, and not as a part of a longer one.
bool has_name(std::string_view text, std::string_view name) {
  const auto is_part = [&](std::size_t at) { return at < text.size() && (is_word(text[at]) || text[at] == '-'); };
  for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
    if (!(at > 0 && is_part(at - 1)) && !is_part(at + name.size())) return true;
  }
  return false;
}

// A leaf that is called so is that node, whatever charts there are.
bool is_builtin(const std::string& name) {
  constexpr int kFormat = 4;
  return bt::find_builtin(name, kFormat) != nullptr;
}

void find_files(const Project& project, const char* folder, std::string_view ending, std::vector<Unnamed>& all) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(project.folder / folder, error)) {
    const fs::path& file = entry.path();
    if (file.extension() != ending || file.filename().string().starts_with('.')) continue;
    // By its path alone is a skill named that is called like a built-in node.
    const bool is_skill = std::string_view(folder) == "skills" && !is_builtin(file.stem().string());
    all.push_back({fs::path(folder) / file.filename(), (is_skill ? file.stem() : file.filename()).string()});
  }
}

void forget_named(const std::string& text, const fs::path& by, std::vector<Unnamed>& files) {
  std::erase_if(files, [&](const Unnamed& one) { return one.file != by && has_name(text, one.name); });
}

// The rest of the project's texts.
void forget_named_elsewhere(const Project& project, std::vector<Unnamed>& files) {
  std::error_code error;
  for (auto entry =
           fs::recursive_directory_iterator(project.folder, fs::directory_options::skip_permission_denied, error);
       !error && !files.empty() && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& file = entry->path();
    const std::string name = file.filename().string();
    const std::string ending = file.extension().string();
    if (entry->is_directory(error)) {
      if (name.starts_with('.') || name == "runs" || entry.depth() >= kNamedDepthMax) entry.disable_recursion_pending();
    } else if (ending == ".yaml" || ending == ".xml" || ending == ".scxml") {
      if (const auto text = text::read_file(file)) forget_named(*text, file.lexically_relative(project.folder), files);
    }
  }
}

// What would be wrong with requirements that nobody watches, in this project. No errors: nothing rests on them.
void check_requirements(const Project& project, const fs::path& file, std::optional<Loaded<monitor::Vocabulary>>& known,
                        Diagnostics& diagnostics) {
  const auto source =
      text::read_file(project.folder / file, project.shown(file.string()), monitor::kRequirementBytesMax);
  if (!source) {
    diagnostics.push_back(source.error());
    return;
  }
  auto parsed = monitor::parse_requirements(*source, project.shown(file.string()));
  diagnostics.insert(diagnostics.end(), parsed.diagnostics.begin(), parsed.diagnostics.end());
  if (!parsed.ok()) return;
  // What is wrong with the project itself has been said.
  if (!known) known = load_vocabulary(project);
  if (!known->ok()) return;
  monitor::check_definitions(*parsed.value, &*known->value, diagnostics);
  for (const monitor::Requirement& requirement : parsed.value->requirements) {
    const auto model = monitor::Model::make(requirement, &*known->value);
    diagnostics.insert(diagnostics.end(), model.diagnostics.begin(), model.diagnostics.end());
  }
}

}  // namespace

void check_unnamed(const Project& project, Diagnostics& diagnostics) {
  std::vector<Unnamed> files;
  find_files(project, "requirements", ".req", files);
  find_files(project, "monitors", ".scxml", files);
  find_files(project, "models", ".scxml", files);
  find_files(project, "skills", ".scxml", files);
  if (!files.empty()) {
    if (const auto text = text::read_file(project.folder / fs::path(project.file).filename()))
      forget_named(*text, {}, files);
    if (const auto text = text::read_file(project.folder / project.mission.path)) forget_named(*text, {}, files);
    // Where monitors and requirements that the project itself does not name most often are.
    for (const fs::path& file : scenario_files(project)) {
      if (files.empty()) break;
      if (const auto text = text::read_file(file)) forget_named(*text, {}, files);
    }
    if (!files.empty()) forget_named_elsewhere(project, files);
  }
  find_files(project, "scenarios", ".yml", files);
  std::sort(files.begin(), files.end(), [](const Unnamed& a, const Unnamed& b) { return a.file < b.file; });
  std::optional<Loaded<monitor::Vocabulary>> vocabulary;
  for (const Unnamed& one : files) {
    const std::string name = one.file.generic_string();
    std::string message;
    const bool is_never_run = name.starts_with("skills/") && is_builtin(one.file.stem().string());
    if (is_never_run) {
      message = fmt::format("{0} is run by nobody: {1} is a built-in node, and <{1}> is that; call the skill otherwise",
                            name, one.file.stem().string());
    } else if (name.starts_with("skills/")) {
      message = fmt::format("{} is run by nobody: the mission has no leaf \"{}\"", name, one.name);
    } else if (name.starts_with("scenarios/")) {
      message = fmt::format("{0} is no scenario by its name, so it is not run; call it {1}.yaml", name,
                            fs::path(one.file).replace_extension().generic_string());
    } else if (name.starts_with("models/")) {
      message = fmt::format("{0} serves nobody; name it under models: - {{file: {0}, serves: […]}}", name);
    } else {
      message = fmt::format("{0} is watched by nobody; name it under monitors: - {{file: {0}}}", name);
    }
    diagnostics.push_back({name.starts_with("skills/") && !is_never_run ? Severity::kNote : Severity::kWarning,
                           "check.unnamed", std::move(message), SourceSpan{project.shown(name)}});
    if (one.file.extension() != ".req") continue;
    Diagnostics found;
    check_requirements(project, one.file, vocabulary, found);
    for (Diagnostic& each : found) {
      if (each.severity == Severity::kError) each.severity = Severity::kWarning;
      diagnostics.push_back(std::move(each));
    }
  }
}

}  // namespace sentree::project
