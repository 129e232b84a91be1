#include "sentree/cli/tree_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "sentree/bt/load.h"
#include "sentree/cli/document.h"
#include "sentree/nav2/nav2.h"
#include "sentree/scxml/diff.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

bool is_chart_name(const std::filesystem::path& file) {
  return file.extension() == ".scxml" || file.extension() == ".ascxml";
}

using std::filesystem::path;

void files_below(const path& folder, std::vector<GivenFile>& all, Diagnostics& problems) {
  std::vector<path> found;
  std::size_t seen = 0;
  std::error_code error;
  path last = folder;  // which is opened by the next step, if it is a folder
  for (auto at = std::filesystem::recursive_directory_iterator(folder, error); at != decltype(at)();
       at.increment(error)) {
    last = at->path();
    if (at->path().filename().string().starts_with('.')) {
      at.disable_recursion_pending();
    } else if (at->is_regular_file(error) && (at->path().extension() == ".xml" || is_chart_name(at->path()))) {
      found.push_back(at->path());
    }
    const bool is_endless = ++seen > kGivenEntriesMax;
    if (is_endless || found.size() > kGivenFilesMax) {
      problems.push_back({Severity::kError, "cli.too-many-files",
                          fmt::format("more than {} files{}; name folders below it",
                                      is_endless ? kGivenEntriesMax : kGivenFilesMax, is_endless ? " of any kind" : ""),
                          SourceSpan{folder.string()}});
      return;
    }
  }
  if (error) problems.push_back({Severity::kError, "file.unreadable", error.message(), SourceSpan{last.string()}});
  std::sort(found.begin(), found.end());
  for (path& file : found) all.push_back({std::move(file), false});
}

}  // namespace

std::optional<Diagnostic> other_kind(const path& file) {
  static const std::map<std::string, std::string> kKinds{
      {".mcap", "a recording, and neither a tree nor a chart; `sentree info` and `sentree studio` take it"},
      {".req", "requirements, and neither a tree nor a chart; `sentree check` takes them"},
      {".thrift", "an interface, and neither a tree nor a chart; `sentree check` takes it"}};
  const auto kind = kKinds.find(file.extension().string());
  if (kind == kKinds.end()) return std::nullopt;
  return Diagnostic{Severity::kError, "cli.other-kind", kind->second, SourceSpan{file.string()}};
}

std::vector<GivenFile> given_files(const std::vector<std::string>& names, Diagnostics& problems) {
  std::vector<GivenFile> all;
  for (const std::string& name : names) {
    std::error_code error;
    if (std::filesystem::is_directory(name, error))
      files_below(name, all, problems);
    else if (const auto other = other_kind(name))
      problems.push_back(*other);
    else
      all.push_back({name, true});
  }
  return all;
}

std::string document_kind(const std::string& xml) {
  const auto document = text::XmlDocument::parse(xml, {}, {.lenient = true});
  if (!document) return is_chart_source(xml) ? "chart" : "";
  if (scxml::is_chart(document->root())) return "chart";
  return document->root().local_name() == "root" ? "tree" : "";
}

bool is_well_formed(const std::string& xml) { return text::XmlDocument::parse(xml, {}, {.lenient = true}).has_value(); }

project::FileRef palette_file(const std::string& palette) {
  std::error_code error;
  if (palette == nav2::kPalette && !std::filesystem::exists(palette, error)) return {palette, {}};
  return {std::filesystem::absolute(palette).string(), {}};
}

TreeFiles::TreeFiles(const std::vector<GivenFile>& files, const TreeOptions& options, Diagnostics& problems)
    : packages_(options.packages.begin(), options.packages.end()) {
  for (const std::string& palette : options.palettes) {
    std::error_code error;
    if (palette == nav2::kPalette && !std::filesystem::exists(palette, error)) {
      nav2::add_nodes(registry_);
      library_.add(nav2::models());
      continue;
    }
    const auto source = text::read_file(palette);
    const auto added = source ? library_.add(palette, *source) : tl::unexpected(source.error());
    if (!added) {
      problems.push_back(added.error());
    } else if (library_.files().back().models == 0) {
      problems.push_back({Severity::kError, "bt.no-palette", "there is no <TreeNodesModel> with nodes in this palette",
                          SourceSpan{palette}});
    }
  }
  for (const GivenFile& file : files) {
    if (is_chart_name(file.path)) continue;
    if (const auto source = text::read_file(file.path)) (void)library_.add(file.path, *source);
  }
}

Loaded<bt::Tree> TreeFiles::load(const path& file, const std::string& tree) const {
  bt::LoadOptions options;
  options.registry = &registry_;
  options.partial = true;
  options.main_tree = tree;
  options.find_package = [this](std::string_view package) { return bt::find_ros_package(package, packages_); };
  library_.serve(options);
  return bt::load_file(file, std::move(options));
}

}  // namespace sentree::cli
