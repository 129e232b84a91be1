#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/requirement_file.h"
#include "sentree/text/file.h"

namespace sentree::cli {

int monitor_synth(const SynthCommand& command) {
  const std::filesystem::path folder =
      command.project.empty() ? project_above(command.file) : std::filesystem::path(command.project);
  Loaded<monitor::Vocabulary> known;
  if (!folder.empty()) known = vocabulary_of_project(folder);
  if (!known.ok()) {
    say(known.diagnostics);
    // A broken project above the file: then types come from the requirements alone.
    if (!command.project.empty()) return kInvalidInput;
    known.value.reset();
  }
  const auto models = load_requirement_file(command.file, known.value ? &*known.value : nullptr);
  say(models.diagnostics);
  if (!models.ok()) return kInvalidInput;
  std::vector<std::pair<std::filesystem::path, std::string>> charts;
  for (const monitor::Model& model : *models.value)
    charts.emplace_back(std::filesystem::path(command.output) / (model.name() + ".scxml"), model.chart().source());
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
