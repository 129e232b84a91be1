#include "sentree/import/import.h"

#include <algorithm>
#include <system_error>

#include "sentree/import/source_folder.h"
#include "sentree/import/yarp_system.h"
#include "sentree/text/file.h"

namespace sentree::import {

using std::filesystem::path;

std::string_view to_string(Fate fate) {
  switch (fate) {
    case Fate::kByHand: return "by hand";
    case Fate::kReview: return "review";
    case Fate::kNotNeeded: break;
  }
  return "not needed";
}

Loaded<Imported> import_system(const path& from, const std::string&) {
  const auto failed = [](Diagnostic diagnostic) {
    return Loaded<Imported>{.value = std::nullopt, .diagnostics = {std::move(diagnostic)}};
  };
  const auto folder = SourceFolder::open(from);
  if (!folder) return failed(folder.error());
  if (holds_yarp_skills(*folder)) return import_yarp_skills(*folder);
  return failed({Severity::kError, "import.unknown-form",
                 "no system that can be imported: Behavior Trees with Qt SCXML skills", SourceSpan{from.string()}});
}

Result<void> write_project(const Imported& imported, const path& folder, bool force) {
  std::error_code error;
  const bool occupied = std::filesystem::exists(folder, error) &&
                        (!std::filesystem::is_directory(folder, error) || !std::filesystem::is_empty(folder, error));
  if (occupied && !force) {
    return fail("import.exists", "exists and is not empty; choose another folder, or --force to replace files in it",
                SourceSpan{folder.string()});
  }
  std::vector<ProjectFile> files = imported.files;
  const path named = folder.has_filename() ? folder : folder.parent_path();
  files.push_back({"IMPORT.md", report_of(imported, named.filename().string())});
  for (const ProjectFile& file : files) {
    const path target = folder / file.path;
    std::filesystem::create_directories(target.parent_path(), error);
    if (const auto written = text::write_file(target, file.content); !written) return written;
  }
  return {};
}

std::string report_of(const Imported& imported, const std::string& name) {
  std::string text = "# " + name + ": what was imported\n\nForm: " + imported.form + ".\n";
  const auto section = [&](Fate fate, const std::string& title) {
    std::string lines;
    for (const Finding& finding : imported.findings) {
      if (finding.fate != fate) continue;
      lines += "- " + to_string(finding.span) + ": ";
      if (!finding.original.empty()) {
        std::string original = finding.original;
        std::replace(original.begin(), original.end(), '`', '\'');
        lines += "`" + original + "`: ";
      }
      lines += finding.reason + "\n";
    }
    if (!lines.empty()) text += "\n## " + title + "\n\n" + lines;
  };
  section(Fate::kByHand, "To be done by hand");
  section(Fate::kReview, "Translated with an assumption: to be confirmed");
  section(Fate::kNotNeeded, "Left out, because Sentree does it by itself");
  text += "\n## Files\n\n";
  for (const ProjectFile& file : imported.files) text += "- " + file.path + "\n";
  return text;
}

}  // namespace sentree::import
