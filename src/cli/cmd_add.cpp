#include "sentree/cli/commands.h"

#include <fmt/format.h>
#include "sentree/cli/output.h"
#include "sentree/cli/shell_word.h"
#include "sentree/design/parts.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

std::string filled(std::string text, const std::string& project, const std::string& mission) {
  for (const auto& [mark, value] :
       {std::pair<std::string, std::string>("{project}", project), {"{mission}", mission}}) {
    for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + value.size()))
      text.replace(at, mark.size(), value);
  }
  return text;
}

}  // namespace

int add(const AddCommand& command) {
  if (const auto named = design::new_part(command.kind, command.name, nullptr); !named) {
    say(named.error().message);
    return kUsage;
  }
  auto loaded = project::load_project(command.project);
  if (!loaded.ok()) {
    say(loaded.diagnostics);
    return kInvalidInput;
  }
  const project::Project project = *loaded.value;
  const auto plan = project::prepare(project::plain_scenario(std::move(*loaded.value)));
  // A skill may be what a project lacks, that of a tree that others have drawn above all.
  if (!plan.ok() && command.kind != "skill") {
    say(plan.diagnostics);
    say(fmt::format("mend the project first: `sentree check {}`", shell_word(command.project)));
    return kInvalidInput;
  }
  if (!plan.ok()) say(plan.diagnostics);
  const auto made = design::new_part(command.kind, command.name, plan.ok() ? &*plan.value : nullptr);
  if (!made) {
    say(made.error().message);
    return kInvalidInput;
  }
  const design::Part& part = *made;
  for (const auto& [file, content] : part.files) {
    std::error_code error;
    if (!fs::exists(project.folder / file, error)) continue;
    say(project.shown(file) + ": is there already; choose another name");
    return kInvalidInput;
  }
  const fs::path yaml = project.folder / fs::path(project.file).filename();
  auto source = text::read_file(yaml);
  for (const auto& [section, entry] : part.entries) {
    if (source) source = text::with_entry(*source, section, entry, project.file);
    if (source) continue;
    say(to_string(source.error()));
    say(fmt::format("nothing was added; the entry would be, under {}:\n  {}", section, entry));
    return kInvalidInput;
  }
  std::vector<std::pair<fs::path, std::string>> files(part.files.begin(), part.files.end());
  if (!part.entries.empty()) files.emplace_back(yaml.filename(), *source);
  for (const auto& [file, content] : files) {
    std::error_code error;
    fs::create_directories((project.folder / file).parent_path(), error);
    if (const auto written = text::write_file(project.folder / file, content); !written) {
      say(to_string(written.error()));
      return kEnvironment;
    }
    print(project.shown(file.string()) + "\n");
  }
  say(filled(part.next, shell_word(command.project), shell_word(project.shown(project.mission.path))));
  return kOk;
}

}  // namespace sentree::cli
