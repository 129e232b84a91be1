#include "sentree/import/import.h"

#include <algorithm>
#include <map>
#include <system_error>

#include <fmt/format.h>

#include "sentree/base/value.h"
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

namespace {

constexpr std::string_view kFileLine = "- ";
constexpr std::string_view kSumMark = "  sum ";

// By file, the sum that an IMPORT.md has of it.
std::map<std::string, std::string> sums_in(std::string_view report) {
  std::map<std::string, std::string> sums;
  std::size_t at = report.rfind("\n## Files\n");
  while (at < report.size()) {
    const std::string_view line = report.substr(at, report.find('\n', at) - at);
    at += line.size() + 1;
    const std::size_t mark = line.rfind(kSumMark);
    if (!line.starts_with(kFileLine) || mark == std::string_view::npos) continue;
    sums.emplace(line.substr(kFileLine.size(), mark - kFileLine.size()), line.substr(mark + kSumMark.size()));
  }
  return sums;
}

std::string sum_of(std::string_view content) { return fmt::format("{:016x}", hash_bytes(content)); }

}  // namespace

Result<std::vector<std::string>> write_project(const Imported& imported, const path& folder, bool force) {
  std::error_code error;
  const bool occupied = std::filesystem::exists(folder, error) &&
                        (!std::filesystem::is_directory(folder, error) || !std::filesystem::is_empty(folder, error));
  if (occupied && !force) {
    return fail("import.exists", "exists and is not empty; choose another folder, or --force to replace files in it",
                SourceSpan{folder.string()});
  }
  std::vector<ProjectFile> files = imported.files;
  const path named = folder.has_filename() ? folder : folder.parent_path();
  constexpr const char* kReport = "IMPORT.md";
  const auto report = text::read_file(folder / kReport);
  const auto sums = sums_in(report ? *report : "");
  files.push_back({kReport, report_of(imported, named.filename().string())});
  std::vector<std::string> kept;
  for (const ProjectFile& file : files) {
    const path target = folder / file.path;
    const auto there = occupied ? text::read_file(target) : Result<std::string>();
    const auto sum = sums.find(file.path);
    const bool is_edited = there && file.path != kReport && *there != file.content &&
                           (sum != sums.end() ? sum_of(*there) != sum->second : file.path.starts_with("skills/"));
    if (is_edited && occupied) {
      kept.push_back(file.path);
      continue;
    }
    std::filesystem::create_directories(target.parent_path(), error);
    if (auto written = text::write_file(target, file.content); !written) return tl::unexpected(written.error());
  }
  return kept;
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
  for (const ProjectFile& file : imported.files)
    text += fmt::format("{}{}{}{}\n", kFileLine, file.path, kSumMark, sum_of(file.content));
  return text;
}

}  // namespace sentree::import
