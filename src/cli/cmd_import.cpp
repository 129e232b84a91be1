#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "sentree/cli/commands.h"
#include "sentree/cli/import_command.h"
#include "sentree/cli/output.h"
#include "sentree/import/import.h"

namespace sentree::cli {

namespace {

Value finding_value(const import::Finding& finding) {
  return Map{{"what", std::string(import::to_string(finding.fate))},
             {"file", finding.span.file},
             {"line", std::int64_t{finding.span.line}},
             {"column", std::int64_t{finding.span.column}},
             {"original", finding.original},
             {"reason", finding.reason}};
}

void print_json(const ImportCommand& command, const import::Imported* imported, const std::vector<std::string>& kept,
                const Diagnostics& diagnostics) {
  List files;
  List findings;
  if (imported != nullptr) {
    for (const import::ProjectFile& file : imported->files) files.emplace_back(file.path);
    for (const import::Finding& finding : imported->findings) findings.push_back(finding_value(finding));
  }
  print(to_json(Value(Map{{"project", command.output},
                          {"form", imported != nullptr ? imported->form : std::string()},
                          {"files", std::move(files)},
                          {"kept", List(kept.begin(), kept.end())},
                          {"findings", std::move(findings)},
                          {"diagnostics", to_value(diagnostics)}})) +
        "\n");
}

void print_text(const ImportCommand& command, const import::Imported& imported, const std::vector<std::string>& kept) {
  for (const import::ProjectFile& file : imported.files) {
    if (std::find(kept.begin(), kept.end(), file.path) == kept.end())
      print(fmt::format("{}/{}\n", command.output, file.path));
  }
  print(command.output + "/IMPORT.md\n");
  for (const import::Finding& finding : imported.findings) {
    // What a person need not look at stands in IMPORT.md only.
    if (finding.fate == import::Fate::kNotNeeded) continue;
    say(fmt::format("{}: {}: {}{}", to_string(finding.span), import::to_string(finding.fate),
                    finding.original.empty() ? "" : finding.original + ": ", finding.reason));
  }
  for (const std::string& file : kept)
    say(fmt::format("{}/{}: kept, for it has been edited; without it, import --force writes it anew", command.output,
                    file));
  if (!imported.plug_in_nodes.empty()) {
    say(fmt::format(
        "\nFirst write a plug-in with {} (docs/coming-from-behaviortree-cpp.md, Plug-ins) and name it under "
        "`plugins:` in {}/sentree.yaml: until then the mission does not run.",
        fmt::join(imported.plug_in_nodes, ", "), command.output));
  }
  say(fmt::format(
      "\n{2}:\n  sentree check {0}\n{1}  sentree graph {0} -o tree.svg", command.output,
      imported.form == import::kTreeForm ? fmt::format("  sentree run {} --clock virtual\n", command.output) : "",
      imported.plug_in_nodes.empty() ? "Now try" : "Then try"));
}

}  // namespace

int import_project(const ImportCommand& command) {
  const auto imported = import::import_system(command.system, command.main);
  if (!imported.value) {
    if (command.json) print_json(command, nullptr, {}, imported.diagnostics);
    say(imported.diagnostics);
    return kInvalidInput;
  }
  const auto kept = import::write_project(*imported.value, command.output, command.force);
  if (!kept) {
    if (command.json) print_json(command, nullptr, {}, {kept.error()});
    say(to_string(kept.error()));
    return kept.error().code == "import.exists" ? kInvalidInput : kEnvironment;
  }
  if (command.json) {
    print_json(command, &*imported.value, *kept, imported.diagnostics);
  } else {
    say(imported.diagnostics);
    print_text(command, *imported.value, *kept);
  }
  const auto& findings = imported.value->findings;
  const bool left = std::any_of(findings.begin(), findings.end(),
                                [](const auto& finding) { return finding.fate == import::Fate::kByHand; });
  return left ? kFindings : kOk;
}

}  // namespace sentree::cli
