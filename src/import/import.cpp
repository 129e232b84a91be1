#include "sentree/import/import.h"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include "sentree/import/detail/roaml_system.h"
#include "sentree/import/detail/source_folder.h"
#include "sentree/import/detail/tree_system.h"
#include "sentree/import/detail/yarp_system.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

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

Loaded<Imported> import_system(const path& from, const std::string& main) {
  const auto failed = [](std::string code, std::string message, const path& where) {
    return Loaded<Imported>{
        .value = std::nullopt,
        .diagnostics = {{Severity::kError, std::move(code), std::move(message), SourceSpan{where.string()}}}};
  };
  std::error_code error;
  if (!std::filesystem::exists(from, error)) return failed("file.not-found", "there is no such file or folder", from);
  const bool is_file = std::filesystem::is_regular_file(from, error);
  if (is_file && is_tree_file(from)) return import_tree(from);
  const path above = from.has_parent_path() ? from.parent_path() : path(".");
  const auto folder = SourceFolder::open(is_file ? above : from);
  if (!folder) return Loaded<Imported>{.value = std::nullopt, .diagnostics = {folder.error()}};
  if (is_file) return import_roaml(*folder, from.filename().string());
  if (!main.empty()) {
    if (folder->contains(main))
      return is_tree_file(from / main) ? import_trees(*folder, main) : import_roaml(*folder, main);
    return failed("file.not-found", "there is no such file in the folder", from / main);
  }
  const std::vector<std::string> mains = roaml_mains(*folder);
  if (mains.size() == 1) return import_roaml(*folder, mains.front());
  if (mains.size() > 1) {
    std::string list;
    for (std::size_t i = 0; i < mains.size() && i < 10; ++i) list += (i == 0 ? "" : ", ") + mains[i];
    return failed("import.ambiguous",
                  fmt::format("the folder holds {} AS2FM systems; choose one with --main: {}", mains.size(), list),
                  from);
  }
  if (holds_yarp_skills(*folder)) return import_yarp_skills(*folder);
  const std::vector<std::string> documents = folder->with_ending({".xml"});
  if (std::any_of(documents.begin(), documents.end(),
                  [&](const std::string& file) { return is_tree_file(from / file); }))
    return import_trees(*folder, main);
  auto none =
      failed("import.unknown-form",
             "no system that can be imported: neither Behavior Trees, alone or with Qt SCXML skills, nor the main file "
             "of an AS2FM system",
             from);
  // One that cannot be read may have been meant.
  for (const std::string& file : documents) {
    const auto source = folder->read(file);
    const auto document = source ? text::XmlDocument::parse(*source, folder->shown(file), {.lenient = true})
                                 : tl::unexpected(source.error());
    if (!document) none.diagnostics.push_back(document.error());
  }
  return none;
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
    if (auto written = text::write_file(target, file.content); !written) return written;
  }
  return {};
}

std::string report_of(const Imported& imported, const std::string& name) {
  std::string text = fmt::format("# {}: what was imported\n\nForm: {}.\n", name, imported.form);
  const auto section = [&](Fate fate, const std::string& title) {
    std::string lines;
    for (const Finding& finding : imported.findings) {
      if (finding.fate != fate) continue;
      lines += fmt::format("- {}: ", to_string(finding.span));
      if (!finding.original.empty()) {
        std::string original = finding.original;
        std::replace(original.begin(), original.end(), '`', '\'');
        lines += fmt::format("`{}`: ", original);
      }
      lines += finding.reason + "\n";
    }
    if (!lines.empty()) text += fmt::format("\n## {}\n\n{}", title, lines);
  };
  section(Fate::kByHand, "To be done by hand");
  section(Fate::kReview, "Translated with an assumption: to be confirmed");
  section(Fate::kNotNeeded, "Left out, because Sentree does it by itself");
  text += "\n## Files\n\n";
  for (const ProjectFile& file : imported.files) text += fmt::format("- {}\n", file.path);
  return text;
}

}  // namespace sentree::import
