#include <algorithm>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/monitor/monitor.h"
#include "sentree/runtime/plan.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

// The project that a file belongs to: the nearest sentree.yaml above it.
std::filesystem::path project_above(const std::filesystem::path& file) {
  std::error_code error;
  for (auto folder = std::filesystem::absolute(file, error).parent_path();; folder = folder.parent_path()) {
    if (std::filesystem::exists(folder / "sentree.yaml", error)) return folder;
    if (folder == folder.root_path() || folder.empty()) return {};
  }
}

// What the project observes; nothing without one, or if it is broken: then types come from the requirements alone.
std::optional<monitor::Vocabulary> vocabulary(const SynthCommand& command, bool& usable) {
  const std::filesystem::path folder =
      command.project.empty() ? project_above(command.file) : std::filesystem::path(command.project);
  if (folder.empty()) return std::nullopt;
  const auto project = runtime::load_project(folder);
  auto known = project.ok() ? runtime::load_vocabulary(*project.value) : Loaded<monitor::Vocabulary>();
  if (!known.ok()) {
    say(project.diagnostics);
    say(known.diagnostics);
    usable = command.project.empty();
  }
  return std::move(known.value);
}

}  // namespace

int monitor_synth(const SynthCommand& command) {
  const auto source = text::read_file(command.file, {}, monitor::kRequirementBytesMax);
  if (!source) {
    say(to_string(source.error()));
    return kInvalidInput;
  }
  const auto parsed = monitor::parse_requirements(*source, command.file);
  say(parsed.diagnostics);
  if (!parsed.ok()) return kInvalidInput;
  bool usable = true;
  const auto known = vocabulary(command, usable);
  if (!usable) return kInvalidInput;
  std::vector<std::pair<std::filesystem::path, std::string>> charts;
  bool wrong = false;
  for (const monitor::Requirement& requirement : parsed.value->requirements) {
    const auto model = monitor::Model::make(requirement, known ? &*known : nullptr);
    say(model.diagnostics);
    wrong = wrong || !model.ok();
    if (model.ok())
      charts.emplace_back(std::filesystem::path(command.output) / (requirement.name + ".scxml"),
                          model.value->chart().source());
  }
  if (wrong) return kInvalidInput;
  std::error_code error;
  std::filesystem::create_directories(command.output, error);
  for (const auto& [file, chart] : charts) {
    if (const auto written = text::write_file(file, chart); !written) {
      say(to_string(written.error()));
      return kEnvironment;
    }
    print(file.string() + "\n");
  }
  return kOk;
}

}  // namespace sentree::cli
