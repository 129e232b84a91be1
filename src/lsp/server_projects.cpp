#include "sentree/lsp/detail/server_impl.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "sentree/bt/load.h"
#include "sentree/design/findings.h"
#include "sentree/design/workspace.h"
#include "sentree/lsp/detail/uri.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/rename.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/check.h"
#include "sentree/text/file.h"
#include "sentree/text/overlay.h"

// The texts that are open, their projects, and what is wrong with them.

namespace sentree::lsp {

const Server::Impl::Text* Server::Impl::text_at(const fs::path& path) const {
  for (const auto& [uri, text] : texts) {
    if (text.path == path) return &text;
  }
  return nullptr;
}

std::string Server::Impl::uri_at(const fs::path& path) const {
  const Text* const open = text_at(path);
  return open != nullptr ? open->uri : uri_of(path);
}

text::Overlay Server::Impl::overlay(const fs::path& folder) const {
  text::Overlay overlay;
  for (const auto& [uri, text] : texts) {
    if (!text.path.empty() && text.text.size() <= design::kDocumentBytesMax && project_of(text.path) == folder)
      overlay[text.path] = text.text;
  }
  return overlay;
}

Server::Impl::Project& Server::Impl::project_at(const fs::path& folder) {
  auto found = projects.find(folder);
  if (found == projects.end()) {
    if (projects.size() >= kProjectsMax) {
      auto oldest = std::min_element(projects.begin(), projects.end(),
                                     [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
      clear(oldest->second);
      projects.erase(oldest);
    }
    found = projects.emplace(folder, Project(folder)).first;
  }
  found->second.used = ++uses;
  return found->second;
}

void Server::Impl::find_projects() {
  constexpr std::size_t kEntriesMax = 20'000;
  constexpr int kDepthMax = 4;
  if (std::exchange(is_looked_through, true)) return;
  std::size_t seen = 0;
  for (const fs::path& root : roots) {
    std::error_code error;
    const auto look_at = [&](const fs::path& folder) {
      if (projects.size() < kProjectsMax && !projects.contains(folder) && fs::exists(folder / "sentree.yaml", error))
        project_at(folder).is_unchecked = false;
    };
    look_at(root);
    for (fs::recursive_directory_iterator at(root, fs::directory_options::skip_permission_denied, error), end;
         !error && at != end && ++seen < kEntriesMax; at.increment(error)) {
      if (!at->is_directory(error)) continue;
      if (at->path().filename().string().starts_with('.') || at.depth() + 1 >= kDepthMax)
        at.disable_recursion_pending();
      look_at(at->path());
    }
  }
}

void Server::Impl::changed(const fs::path& path) {
  if (path.empty()) return;
  Project& project = project_at(project_of(path));
  project.is_outdated = project.is_unchecked = true;
}

const Index& Server::Impl::fresh(Project& project) {
  if (project.is_outdated) {
    project.is_outdated = false;
    project.index.refresh(overlay(project.index.folder()));
  }
  return project.index;
}

Server::Impl::Where Server::Impl::where(const Value& params, bool has_position) {
  const std::string uri = text_of(member(params, "textDocument"), "uri");
  const auto found = texts.find(uri);
  if (found == texts.end()) throw Refusal{kInvalidParams, fmt::format("\"{}\" is not open", uri)};
  const Text& text = found->second;
  if (text.path.empty()) throw Refusal{kRequestFailed, fmt::format("only files are known: \"{}\"", uri)};
  Project& project = project_at(project_of(text.path));
  Where where{text, project, fresh(project), text.path.string()};
  if (has_position) where.offset = text.lines.offset(text.text, position_of(member(params, "position")), units);
  return where;
}

Value Server::Impl::range(const std::string& text, const Lines& lines, std::size_t from, std::size_t to) const {
  return Map{{"start", to_value(lines.position(text, from, units))},
             {"end", to_value(lines.position(text, to, units))}};
}

Value Server::Impl::range(const IndexedFile& file, std::size_t from, std::size_t to) const {
  return range(file.text, file.lines, from, to);
}

Value Server::Impl::location(const Index& index, const Index::Place& place) const {
  return Map{{"uri", uri_at(*place.file)},
             {"range", range(*index.find(*place.file), place.occurrence->from, place.occurrence->to)}};
}

Value Server::Impl::edits_value(const std::string& text, const Lines& lines, const design::TextEdits& edits) const {
  List list;
  for (const design::TextEdit& edit : edits)
    list.push_back(Map{{"range", range(text, lines, edit.from, edit.to)}, {"newText", edit.text}});
  return list;
}

void Server::Impl::note(std::string_view method, Value params) {
  notes.push_back(to_json(Value(Map{{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}})));
}

void Server::Impl::clear(Project& project) {
  for (const auto& [file, uri] : project.told)
    note("textDocument/publishDiagnostics", Map{{"uri", uri}, {"diagnostics", List()}});
  project.told.clear();
}

void Server::Impl::publish(Project& project) {
  std::map<std::string, std::string> told;
  for (const auto& [file, findings] : project.findings) {
    if (!findings.empty()) told[file] = uri_at(file);
  }
  for (const auto& [file, uri] : project.told) {
    if (!told.contains(file) || told[file] != uri)
      note("textDocument/publishDiagnostics", Map{{"uri", uri}, {"diagnostics", List()}});
  }
  for (const auto& [file, uri] : told) {
    List list;
    for (const design::Finding& finding : project.findings[file]) list.push_back(finding_value(project, file, finding));
    note("textDocument/publishDiagnostics", Map{{"uri", uri}, {"diagnostics", std::move(list)}});
  }
  project.told = std::move(told);
}

Value Server::Impl::finding_value(const Project& project, const std::string& name,
                                  const design::Finding& finding) const {
  const IndexedFile* const file = project.index.find(name);
  const Value place = file != nullptr ? range(*file, finding.from, finding.to) : range(std::string(), Lines(), 0, 0);
  constexpr std::int64_t kSeverities[] = {1, 2, 3};
  return Map{{"range", place},
             {"severity", kSeverities[static_cast<std::size_t>(finding.diagnostic.severity)]},
             {"code", finding.diagnostic.code},
             {"source", "sentree"},
             {"message", finding.diagnostic.message}};
}

Server::Impl::Project* Server::Impl::unchecked() {
  for (auto& [folder, project] : projects) {
    if (project.is_unchecked) return &project;
  }
  return nullptr;
}

Diagnostics Server::Impl::check_alone(const std::string& name, const IndexedFile& file) {
  if (file.kind == FileKind::kChart) {
    scxml::LoadOptions options;
    options.to_run = false;
    options.read = [&](std::string_view uri) {
      return text::read_file(fs::path(name).parent_path() / std::string(uri));
    };
    auto loaded = scxml::load(file.text, name, options);
    if (loaded.value) {
      const Diagnostics found = scxml::check(*loaded.value);
      loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
    }
    return loaded.diagnostics;
  }
  if (file.kind == FileKind::kTree) {
    bt::LoadOptions options;
    options.partial = true;
    options.read_file = [](const fs::path& path) { return text::read_file(path); };
    auto loaded = bt::load(file.text, options, name);
    return loaded.diagnostics;
  }
  if (file.kind == FileKind::kRequirements) return monitor::parse_requirements(file.text, name).diagnostics;
  if (file.kind == FileKind::kInterface) return project::load_interface(name, name).diagnostics;
  return {};
}

void Server::Impl::check(Project& project) {
  project.is_unchecked = false;
  const fs::path folder = project.index.folder();
  const text::Overlay edited = overlay(folder);
  const Index& index = fresh(project);
  // Nobody looks at it any more.
  if (edited.empty()) {
    project.findings.clear();
    clear(project);
    return;
  }
  const text::ReadThrough through(edited);
  Diagnostics all;
  std::set<std::string> seen;
  if (!folder.empty()) {
    const text::ReadLog log;
    all = project::check_project(folder, project.cache);
    for (const text::ReadFile& file : log.files()) seen.insert(file.path.lexically_normal().string());
  }
  for (const auto& [path, text] : edited) {
    const IndexedFile* const file = index.find(path.string());
    if (file == nullptr || seen.contains(path.string())) continue;
    const Diagnostics found = check_alone(path.string(), *file);
    all.insert(all.end(), found.begin(), found.end());
  }
  project.findings.clear();
  for (Diagnostic& diagnostic : all) {
    const fs::path file = folder / fs::path(diagnostic.span.file);
    std::string name =
        diagnostic.span.file.empty() ? (folder / "sentree.yaml").string() : file.lexically_normal().string();
    const IndexedFile* const indexed = index.find(name);
    const std::string text = indexed != nullptr ? indexed->text : std::string();
    project.findings[name].push_back(
        design::locate(std::move(diagnostic), folder.empty() ? fs::path("/") : folder, text));
  }
  publish(project);
}

Value Server::Impl::initialize(const Value& params) {
  const Value* const encodings = params.at({"capabilities", "general", "positionEncodings"});
  bool is_utf8 = false;
  if (encodings != nullptr) {
    for (const Value& encoding : list_of(*encodings)) is_utf8 = is_utf8 || encoding.text() == "utf-8";
  }
  units = is_utf8 ? Units::kUtf8 : Units::kUtf16;
  watches = flag_at(params, {"capabilities", "workspace", "didChangeWatchedFiles", "dynamicRegistration"});
  const Value* const operations = params.at({"capabilities", "workspace", "workspaceEdit", "resourceOperations"});
  if (operations != nullptr && flag_at(params, {"capabilities", "workspace", "workspaceEdit", "documentChanges"})) {
    for (const Value& operation : list_of(*operations)) renames_files = renames_files || operation.text() == "rename";
  }
  for (const Value& folder : list_of(member(params, "workspaceFolders"))) {
    if (const auto path = path_of(text_of(folder, "uri"))) roots.push_back(*path);
  }
  if (const auto path = path_of(text_of(params, "rootUri")); roots.empty() && path) roots.push_back(*path);
  List triggers;
  for (const char* trigger : {"<", "\"", " ", ".", "'", "(", "{", "/"}) triggers.emplace_back(trigger);
  return Map{{"capabilities",
              Map{{"positionEncoding", is_utf8 ? "utf-8" : "utf-16"},
                  {"textDocumentSync", Map{{"openClose", true}, {"change", 2}, {"save", Map{{"includeText", false}}}}},
                  {"completionProvider", Map{{"triggerCharacters", std::move(triggers)}, {"resolveProvider", false}}},
                  {"hoverProvider", true},
                  {"definitionProvider", true},
                  {"referencesProvider", true},
                  {"documentHighlightProvider", true},
                  {"renameProvider", Map{{"prepareProvider", true}}},
                  {"documentSymbolProvider", true},
                  {"workspaceSymbolProvider", true},
                  {"documentFormattingProvider", true},
                  {"codeActionProvider", Map{{"codeActionKinds", List{"quickfix"}}}},
                  {"codeLensProvider", Map{{"resolveProvider", false}}},
                  {"executeCommandProvider", Map{{"commands", List{"sentree.draw"}}}}}},
             {"serverInfo", Map{{"name", "sentree"}, {"version", version}}}};
}

void Server::Impl::initialized() {
  if (!watches) return;
  notes.push_back(to_json(Value(Map{
      {"jsonrpc", "2.0"},
      {"id", fmt::format("sentree/{}", ++requests)},
      {"method", "client/registerCapability"},
      {"params", Map{{"registrations",
                      List{Map{{"id", "sentree.files"},
                               {"method", "workspace/didChangeWatchedFiles"},
                               {"registerOptions",
                                Map{{"watchers", List{Map{{"globPattern",
                                                           "**/*.{xml,scxml,req,yaml,yml,thrift,mcap}"}}}}}}}}}}}})));
}

void Server::Impl::opened(const Value& params) {
  const Value& document = member(params, "textDocument");
  Text text;
  text.uri = text_of(document, "uri");
  if (texts.size() >= kOpenTextsMax && !texts.contains(text.uri)) return;
  text.text = text_of(document, "text");
  text.lines = Lines(text.text);
  text.path = path_of(text.uri).value_or(fs::path());
  text.version = member(document, "version");
  changed(text.path);
  texts[text.uri] = std::move(text);
}

void Server::Impl::edited(const Value& params) {
  const auto found = texts.find(text_of(member(params, "textDocument"), "uri"));
  if (found == texts.end()) return;
  Text& text = found->second;
  text.version = member(member(params, "textDocument"), "version");
  for (const Value& change : list_of(member(params, "contentChanges"))) {
    const Value& place = member(change, "range");
    std::string with = text_of(change, "text");
    if (place.is_null()) {
      text.text = std::move(with);
    } else {
      const std::size_t from = text.lines.offset(text.text, position_of(member(place, "start")), units);
      const std::size_t to = text.lines.offset(text.text, position_of(member(place, "end")), units);
      if (to < from) throw Refusal{kInvalidParams, "a range ends before it begins"};
      if (text.text.size() - (to - from) + with.size() > kTextBytesMax)
        throw Refusal{kInvalidParams, fmt::format("a text has at most {} bytes", kTextBytesMax)};
      text.text.replace(from, to - from, with);
    }
    text.lines = Lines(text.text);
  }
  changed(text.path);
}

void Server::Impl::closed(const Value& params) {
  const auto found = texts.find(text_of(member(params, "textDocument"), "uri"));
  if (found == texts.end()) return;
  const fs::path path = found->second.path;
  texts.erase(found);
  changed(path);
}

void Server::Impl::files_changed(const Value& params) {
  for (const Value& change : list_of(member(params, "changes"))) {
    const auto path = path_of(text_of(change, "uri"));
    if (!path) continue;
    if (path->filename() == "sentree.yaml") is_looked_through = false;
    // Only of what somebody looks at.
    const auto project = projects.find(project_of(*path));
    if (project != projects.end() && design::is_project_text(*path))
      project->second.is_outdated = project->second.is_unchecked = true;
  }
}

}  // namespace sentree::lsp
