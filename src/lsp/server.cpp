#include "sentree/lsp/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <optional>
#include <set>
#include <stdexcept>

#include "sentree/bt/load.h"
#include "sentree/bt/write.h"
#include "sentree/design/findings.h"
#include "sentree/design/workspace.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/lsp/completion.h"
#include "sentree/lsp/describe.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/outline.h"
#include "sentree/lsp/recorded.h"
#include "sentree/lsp/rename.h"
#include "sentree/lsp/uri.h"
#include "sentree/lsp/xml_cursor.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/check.h"
#include "sentree/scxml/format.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"
#include "sentree/text/overlay.h"

namespace sentree::lsp {

namespace {

namespace fs = std::filesystem;

enum Code : int {
  kParseError = -32700,
  kInvalidRequest = -32600,
  kMethodNotFound = -32601,
  kInvalidParams = -32602,
  kInternalError = -32603,
  kServerNotInitialized = -32002,
  kRequestFailed = -32803,
  kServerCancelled = -32802,
  kRequestCancelled = -32800,
};

/// Why a request cannot be answered; thrown inside of this file and answered by `Server::handle`.
struct Refusal {
  int code;
  std::string message;
};

const Value& member(const Value& value, std::string_view name) {
  static const Value kNone;
  const Value* const found = value.find(name);
  return found != nullptr ? *found : kNone;
}

std::string text_of(const Value& value, std::string_view name) { return std::string(member(value, name).text()); }

const List& list_of(const Value& value) {
  static const List kNone;
  return value.as_list() != nullptr ? *value.as_list() : kNone;
}

bool flag_at(const Value& value, std::initializer_list<std::string_view> path) {
  const Value* const found = value.at(path);
  return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
}

std::uint64_t count_of(const Value& value) {
  const std::int64_t* const number = value.as_int();
  if (number == nullptr || *number < 0) throw Refusal{kInvalidParams, "a position has a line and a character from 0"};
  return static_cast<std::uint64_t>(*number);
}

Position position_of(const Value& value) {
  return {count_of(member(value, "line")), count_of(member(value, "character"))};
}

Value to_value(const Position& position) {
  return Map{{"line", static_cast<std::int64_t>(position.line)},
             {"character", static_cast<std::int64_t>(position.character)}};
}

}  // namespace

struct Server::Impl {
  struct Text {
    std::string uri;  // as the editor writes it
    fs::path path;    // empty: no file
    std::string text;
    Lines lines;
  };
  struct Project {
    explicit Project(const fs::path& folder) : index(folder) {}
    Index index;
    project::PartCache cache;
    bool is_outdated = true;  // texts have changed since the index saw them
    bool is_unchecked = true;
    std::uint64_t used = 0;
    std::map<std::string, std::vector<design::Finding>> findings;  // by absolute file
    std::map<std::string, std::string> told;                       // URI, by absolute file
  };

  explicit Impl(std::string program_version) : version(std::move(program_version)) {}

  std::string version;
  Units units = Units::kUtf16;
  bool renames_files = false;
  bool watches = false;
  std::map<std::string, Text> texts;     // by URI
  std::map<fs::path, Project> projects;  // by folder; "": texts of no project
  std::uint64_t uses = 0;
  Recorded recorded;
  std::vector<std::string> notes;
  std::int64_t requests = 0;  // of ours

  // ---- Texts ----

  [[nodiscard]] const Text* text_at(const fs::path& path) const {
    for (const auto& [uri, text] : texts) {
      if (text.path == path) return &text;
    }
    return nullptr;
  }
  [[nodiscard]] std::string uri_at(const fs::path& path) const {
    const Text* const open = text_at(path);
    return open != nullptr ? open->uri : uri_of(path);
  }

  // What the editor has open of a project, by file.
  [[nodiscard]] text::Overlay overlay(const fs::path& folder) const {
    text::Overlay overlay;
    for (const auto& [uri, text] : texts) {
      if (!text.path.empty() && text.text.size() <= design::kDocumentBytesMax && project_of(text.path) == folder)
        overlay[text.path] = text.text;
    }
    return overlay;
  }

  Project& project_at(const fs::path& folder) {
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

  void changed(const fs::path& path) {
    if (path.empty()) return;
    Project& project = project_at(project_of(path));
    project.is_outdated = project.is_unchecked = true;
  }

  const Index& fresh(Project& project) {
    if (project.is_outdated) {
      project.is_outdated = false;
      project.index.refresh(overlay(project.index.folder()));
    }
    return project.index;
  }

  // ---- Where a request is about ----

  struct Where {
    const Text& text;
    Project& project;
    const Index& index;
    std::string file;
    std::size_t offset = 0;
  };
  Where where(const Value& params, bool has_position) {
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

  Value range(const std::string& text, const Lines& lines, std::size_t from, std::size_t to) const {
    return Map{{"start", to_value(lines.position(text, from, units))},
               {"end", to_value(lines.position(text, to, units))}};
  }
  Value range(const IndexedFile& file, std::size_t from, std::size_t to) const {
    return range(file.text, file.lines, from, to);
  }
  Value location(const Index& index, const Index::Place& place) const {
    return Map{{"uri", uri_at(*place.file)},
               {"range", range(*index.find(*place.file), place.occurrence->from, place.occurrence->to)}};
  }
  Value edits_value(const std::string& text, const Lines& lines, const design::TextEdits& edits) const {
    List list;
    for (const design::TextEdit& edit : edits)
      list.push_back(Map{{"range", range(text, lines, edit.from, edit.to)}, {"newText", edit.text}});
    return list;
  }

  // ---- Notes to the editor ----

  void note(std::string_view method, Value params) {
    notes.push_back(to_json(Value(Map{{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}})));
  }

  // Nothing is wrong with its files any more, as far as the editor is told.
  void clear(Project& project) {
    for (const auto& [file, uri] : project.told)
      note("textDocument/publishDiagnostics", Map{{"uri", uri}, {"diagnostics", List()}});
    project.told.clear();
  }

  void publish(Project& project) {
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
      for (const design::Finding& finding : project.findings[file])
        list.push_back(finding_value(project, file, finding));
      note("textDocument/publishDiagnostics", Map{{"uri", uri}, {"diagnostics", std::move(list)}});
    }
    project.told = std::move(told);
  }

  Value finding_value(const Project& project, const std::string& name, const design::Finding& finding) const {
    const IndexedFile* const file = project.index.find(name);
    const Value place = file != nullptr ? range(*file, finding.from, finding.to) : range(std::string(), Lines(), 0, 0);
    constexpr std::int64_t kSeverities[] = {1, 2, 3};
    return Map{{"range", place},
               {"severity", kSeverities[static_cast<std::size_t>(finding.diagnostic.severity)]},
               {"code", finding.diagnostic.code},
               {"source", "sentree"},
               {"message", finding.diagnostic.message}};
  }

  // ---- Checking ----

  [[nodiscard]] Project* unchecked() {
    for (auto& [folder, project] : projects) {
      if (project.is_unchecked) return &project;
    }
    return nullptr;
  }

  // A file by itself, as far as it can be told without a project.
  static Diagnostics check_alone(const std::string& name, const IndexedFile& file) {
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

  void check(Project& project) {
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

  // ---- Requests ----

  Value initialize(const Value& params) {
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
    List triggers;
    for (const char* trigger : {"<", "\"", " ", ".", "'", "(", "{", "/"}) triggers.emplace_back(trigger);
    return Map{
        {"capabilities",
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

  void initialized() {
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

  void opened(const Value& params) {
    const Value& document = member(params, "textDocument");
    Text text;
    text.uri = text_of(document, "uri");
    if (texts.size() >= kOpenTextsMax && !texts.contains(text.uri)) return;
    text.text = text_of(document, "text");
    text.lines = Lines(text.text);
    text.path = path_of(text.uri).value_or(fs::path());
    changed(text.path);
    texts[text.uri] = std::move(text);
  }

  void edited(const Value& params) {
    const auto found = texts.find(text_of(member(params, "textDocument"), "uri"));
    if (found == texts.end()) return;
    Text& text = found->second;
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

  void closed(const Value& params) {
    const auto found = texts.find(text_of(member(params, "textDocument"), "uri"));
    if (found == texts.end()) return;
    const fs::path path = found->second.path;
    texts.erase(found);
    changed(path);
  }

  void files_changed(const Value& params) {
    for (const Value& change : list_of(member(params, "changes"))) {
      const auto path = path_of(text_of(change, "uri"));
      if (!path) continue;
      // Only of what somebody looks at.
      const auto project = projects.find(project_of(*path));
      if (project != projects.end() && design::is_project_text(*path))
        project->second.is_outdated = project->second.is_unchecked = true;
    }
  }

  Value completion(const Value& params) {
    const Where at = where(params, true);
    const Completion found = complete(at.index, at.file, at.offset);
    const Value place = range(at.text.text, at.text.lines, found.from, found.to);
    List items;
    for (const Item& item : found.items) {
      Map value{{"label", item.label},
                {"kind", static_cast<std::int64_t>(item.kind)},
                {"textEdit", Map{{"range", place}, {"newText", item.insert.empty() ? item.label : item.insert}}}};
      if (!item.detail.empty()) value.append("detail", item.detail);
      if (!item.documentation.empty()) value.append("documentation", item.documentation);
      items.push_back(std::move(value));
    }
    return Map{{"isIncomplete", found.items.size() >= kItemsMax}, {"items", std::move(items)}};
  }

  Value hover(const Value& params) {
    const Where at = where(params, true);
    std::size_t from = at.offset;
    std::size_t to = at.offset;
    std::string text = hover_at(at.index, at.file, at.offset, from, to);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    if (occurrence != nullptr && occurrence->symbol.kind == SymbolKind::kMethod) text += last_of(at, *occurrence);
    text += last_of_port(at);
    if (text.empty()) return {};
    return Map{{"contents", Map{{"kind", "markdown"}, {"value", std::move(text)}}},
               {"range", range(at.text.text, at.text.lines, from, to)}};
  }

  // What the newest recording has of the port of a leaf that is hovered over.
  std::string last_of_port(const Where& at) {
    const IndexedFile* const file = at.index.find(at.file);
    if (file == nullptr || file->kind != FileKind::kTree) return {};
    const XmlCursor cursor = xml_cursor(file->text, at.offset);
    std::string port;
    if (cursor.where == XmlCursor::Where::kAttributeName)
      port = file->text.substr(cursor.from, cursor.to - cursor.from);
    if (cursor.where == XmlCursor::Where::kAttributeValue) port = cursor.attribute;
    const std::string leaf(cursor.tag.attribute("name").empty() ? cursor.tag.name : cursor.tag.attribute("name"));
    if (port.empty() || port == "name") return {};
    for (const auto& [kind, values] : {std::pair(".tick.reply", "outputs"), std::pair(".tick.request", "inputs")}) {
      const auto last = recorded.last(at.index.folder(), leaf + kind);
      const Value* const value = last ? last->data.at({values, port}) : nullptr;
      if (value != nullptr) return "\n\n" + shown(fmt::format("{}.{}", leaf, port), *value, *last);
    }
    return {};
  }

  static std::string shown(const std::string& what, const Value& value, const Recorded::Last& last) {
    constexpr std::size_t kShownMax = 600;
    std::string text = to_json(value);
    if (text.size() > kShownMax) text = text.substr(0, kShownMax) + "…";
    char time[32];
    std::snprintf(time, sizeof time, "%.3f", last.time_s);
    return fmt::format("last of `{}`, at {} s in {}:\n```json\n{}\n```\n", what, time, last.recording, text);
  }

  // What the newest recording has of a method, of each service that has it.
  std::string last_of(const Where& at, const Occurrence& occurrence) {
    std::string out;
    for (const auto& [name, service] : at.index.names().services) {
      if (!service.service) continue;
      const idl::Method* const method = service.service->find(written_name(occurrence.symbol));
      if (method == nullptr || method_symbol(*method, service.file) != occurrence.symbol) continue;
      const std::string call = fmt::format("{}.{}", name, method->name);
      auto last = recorded.last(at.index.folder(), call + ".reply");
      if (!last && method->oneway) last = recorded.last(at.index.folder(), call + ".request");
      if (!last) continue;
      const Value* const result = last->data.find("result");
      out += "\n\n" + shown(call, result != nullptr ? *result : last->data, *last);
    }
    return out;
  }

  Value definition(const Value& params) {
    const Where at = where(params, true);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    List list;
    if (occurrence == nullptr) return list;
    for (const Index::Place& place : at.index.places_of(occurrence->symbol)) {
      if (place.occurrence->defines) list.push_back(location(at.index, place));
    }
    const auto monitor = at.index.names().monitors.find(occurrence->symbol.name);
    if (occurrence->symbol.kind == SymbolKind::kRequirement && monitor != at.index.names().monitors.end() &&
        !monitor->second.empty()) {
      const Position begin;
      list = {
          Map{{"uri", uri_at(monitor->second)}, {"range", Map{{"start", to_value(begin)}, {"end", to_value(begin)}}}}};
    }
    // A leaf's chart is more than its name.
    if (occurrence->symbol.kind == SymbolKind::kNode && occurrence->defines) {
      if (const Occurrence* skill = skill_of(at, *occurrence)) {
        for (const Index::Place& place : at.index.places_of(skill->symbol)) {
          if (place.occurrence->defines) list.insert(list.begin(), location(at.index, place));
        }
      }
    }
    return list;
  }

  // The skill that the element with this name runs: the last one named before it, in the same tag.
  static const Occurrence* skill_of(const Where& at, const Occurrence& name) {
    const IndexedFile* const file = at.index.find(at.file);
    const Occurrence* skill = nullptr;
    for (const Occurrence& occurrence : file->occurrences) {
      if (occurrence.symbol.kind != SymbolKind::kSkill || occurrence.from > name.from) continue;
      if (file->text.find('>', occurrence.to) > name.from) skill = &occurrence;
    }
    return skill;
  }

  Value references(const Value& params) {
    const Where at = where(params, true);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    List list;
    if (occurrence == nullptr) return list;
    const bool with_definition = flag_at(params, {"context", "includeDeclaration"});
    for (const Index::Place& place : at.index.places_of(occurrence->symbol)) {
      if (with_definition || !place.occurrence->defines) list.push_back(location(at.index, place));
    }
    return list;
  }

  Value highlights(const Value& params) {
    const Where at = where(params, true);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    List list;
    if (occurrence == nullptr) return list;
    const IndexedFile& file = *at.index.find(at.file);
    for (const Occurrence& other : file.occurrences) {
      if (other.symbol == occurrence->symbol) list.push_back(Map{{"range", range(file, other.from, other.to)}});
    }
    return list;
  }

  Value prepare_rename(const Value& params) {
    const Where at = where(params, true);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    if (occurrence == nullptr) throw Refusal{kRequestFailed, "nothing that has a name stands here"};
    if (auto may = may_rename(at.index, occurrence->symbol); !may) throw Refusal{kRequestFailed, may.error().message};
    return Map{{"range", range(at.text.text, at.text.lines, occurrence->from, occurrence->to)},
               {"placeholder", written_name(occurrence->symbol)}};
  }

  Value renamed(const Value& params) {
    const Where at = where(params, true);
    const Occurrence* const occurrence = at.index.at(at.file, at.offset);
    if (occurrence == nullptr) throw Refusal{kRequestFailed, "nothing that has a name stands here"};
    const auto renaming = rename(at.index, occurrence->symbol, text_of(params, "newName"));
    if (!renaming) throw Refusal{kRequestFailed, renaming.error().message};
    if (!renaming->files.empty() && !renames_files)
      throw Refusal{kRequestFailed, "the skill's chart would have to be renamed, which this editor cannot do"};
    if (!renames_files) {
      Map changes;
      for (const auto& [file, edits] : renaming->edits) {
        const IndexedFile& indexed = *at.index.find(file);
        changes.append(uri_at(file), edits_value(indexed.text, indexed.lines, edits));
      }
      return Map{{"changes", std::move(changes)}};
    }
    List changes;
    for (const auto& [file, edits] : renaming->edits) {
      const IndexedFile& indexed = *at.index.find(file);
      changes.push_back(Map{{"textDocument", Map{{"uri", uri_at(file)}, {"version", nullptr}}},
                            {"edits", edits_value(indexed.text, indexed.lines, edits)}});
    }
    for (const auto& [from, to] : renaming->files)
      changes.push_back(Map{{"kind", "rename"}, {"oldUri", uri_at(from)}, {"newUri", uri_of(to)}});
    return Map{{"documentChanges", std::move(changes)}};
  }

  Value outline_value(const IndexedFile& file, const std::vector<OutlinePart>& parts) const {
    List list;
    for (const OutlinePart& part : parts) {
      list.push_back(Map{{"name", part.name},
                         {"detail", part.detail},
                         {"kind", static_cast<std::int64_t>(part.kind)},
                         {"range", range(file, part.from, part.to)},
                         {"selectionRange", range(file, part.name_from, part.name_to)},
                         {"children", outline_value(file, part.children)}});
    }
    return list;
  }

  Value symbols(const Value& params) {
    const Where at = where(params, false);
    const IndexedFile* const file = at.index.find(at.file);
    return file != nullptr ? outline_value(*file, outline_of(*file)) : Value(List());
  }

  Value all_symbols(const Value& params) {
    const std::string query = text_of(params, "query");
    List list;
    for (auto& [folder, project] : projects) {
      const Index& index = fresh(project);
      for (const auto& [name, file] : index.files()) {
        for (const Occurrence& occurrence : file.occurrences) {
          const std::string symbol = written_name(occurrence.symbol);
          if (!occurrence.defines || symbol.find(query) == std::string::npos || list.size() >= kItemsMax) continue;
          constexpr std::int64_t kVariable = 13;
          list.push_back(
              Map{{"name", symbol}, {"kind", kVariable}, {"location", location(index, {&name, &occurrence})}});
        }
      }
    }
    return list;
  }

  Value formatted(const Value& params) {
    const Where at = where(params, false);
    const IndexedFile* const file = at.index.find(at.file);
    if (file == nullptr || (file->kind != FileKind::kTree && file->kind != FileKind::kChart)) return List();
    const auto text =
        file->kind == FileKind::kChart ? scxml::format(file->text, at.file) : bt::format(file->text, at.file);
    if (!text) throw Refusal{kRequestFailed, text.error().message};
    return edits_value(file->text, file->lines, design::edits_between(file->text, *text));
  }

  Value actions(const Value& params) {
    const Where at = where(params, false);
    if (at.project.is_unchecked) check(at.project);
    const Value& asked = member(params, "range");
    const std::size_t from = at.text.lines.offset(at.text.text, position_of(member(asked, "start")), units);
    const std::size_t to = at.text.lines.offset(at.text.text, position_of(member(asked, "end")), units);
    List list;
    const auto findings = at.project.findings.find(at.file);
    if (findings == at.project.findings.end()) return list;
    for (const design::Finding& finding : findings->second) {
      const auto touches = [&](std::size_t begin, std::size_t end) { return begin <= to && end >= from; };
      for (const design::Fix& fix : finding.fixes) {
        if (!touches(finding.from, finding.to) && !touches(fix.edit.from, fix.edit.to)) continue;
        list.push_back(
            Map{{"title", fmt::format("write \"{}\"", fix.title)},
                {"kind", "quickfix"},
                {"isPreferred", finding.fixes.size() == 1},
                {"diagnostics", List{finding_value(at.project, at.file, finding)}},
                {"edit", Map{{"changes", Map{{at.text.uri, edits_value(at.text.text, at.text.lines, {fix.edit})}}}}}});
      }
    }
    return list;
  }

  Value lens(const IndexedFile& file, std::size_t at, const char* title, const char* command, List arguments) const {
    return Map{{"range", range(file, at, at)},
               {"command", Map{{"title", title}, {"command", command}, {"arguments", std::move(arguments)}}}};
  }

  Value lenses(const Value& params) {
    const Where at = where(params, false);
    List list;
    const IndexedFile* const file = at.index.find(at.file);
    if (file == nullptr) return list;
    const std::string folder = at.index.folder().string();
    if (file->kind == FileKind::kScenario && at.text.path.parent_path().filename() == "scenarios") {
      list.push_back(lens(*file, 0, "run this scenario", "sentree.run", {folder, at.text.path.stem().string()}));
      list.push_back(lens(*file, 0, "test this scenario", "sentree.test", {at.file}));
    } else if (file->kind == FileKind::kProject) {
      list.push_back(lens(*file, 0, "run", "sentree.run", {folder}));
      list.push_back(lens(*file, 0, "test all scenarios", "sentree.test", {folder}));
      list.push_back(lens(*file, 0, "open the studio", "sentree.studio", {folder}));
    } else if (file->kind == FileKind::kChart) {
      list.push_back(lens(*file, 0, "show this chart", "sentree.show", {at.text.uri, ""}));
    } else if (file->kind == FileKind::kTree) {
      for (const Occurrence& occurrence : file->occurrences) {
        if (occurrence.symbol.kind == SymbolKind::kTree && occurrence.defines)
          list.push_back(
              lens(*file, occurrence.from, "show this tree", "sentree.show", {at.text.uri, occurrence.symbol.name}));
      }
    }
    return list;
  }

  // sentree.draw(URI, tree): a picture of a tree or a chart, as SVG.
  Value execute(const Value& params) {
    if (text_of(params, "command") != "sentree.draw")
      throw Refusal{kInvalidParams, fmt::format("the server has no command \"{}\"", text_of(params, "command"))};
    const List& arguments = list_of(member(params, "arguments"));
    if (arguments.empty()) throw Refusal{kInvalidParams, "sentree.draw needs the URI of a tree or a chart"};
    const Where at = where(Map{{"textDocument", Map{{"uri", arguments[0].text()}}}}, false);
    const IndexedFile* const file = at.index.find(at.file);
    if (file != nullptr && file->kind == FileKind::kChart) {
      scxml::LoadOptions options;
      options.to_run = false;
      options.read = [](std::string_view) -> Result<std::string> { return std::string(); };
      const auto chart = scxml::load(file->text, at.file, options);
      if (!chart.value) throw Refusal{kRequestFailed, "the chart cannot be read"};
      return draw::to_svg(graph::drawing_of(*chart.value));
    }
    if (file == nullptr || file->kind != FileKind::kTree)
      throw Refusal{kRequestFailed, "only trees and charts can be drawn"};
    bt::LoadOptions options;
    options.partial = true;
    options.palette = &at.index.palette();
    if (arguments.size() > 1) options.main_tree = std::string(arguments[1].text());
    const auto tree = bt::load(file->text, options, at.file);
    if (!tree.value) throw Refusal{kRequestFailed, "the tree cannot be read"};
    draw::Tree picture = graph::drawing_of(*tree.value);
    picture.direction = draw::best_direction(picture);
    return draw::to_svg(picture);
  }

  /// Of one text that is edited bit by bit.
  static constexpr std::size_t kTextBytesMax = std::size_t{16} << 20U;

  using Request = Value (Impl::*)(const Value&);
  static Request request(std::string_view method) {
    static const std::map<std::string_view, Request> kRequests{{"textDocument/completion", &Impl::completion},
                                                               {"textDocument/hover", &Impl::hover},
                                                               {"textDocument/definition", &Impl::definition},
                                                               {"textDocument/references", &Impl::references},
                                                               {"textDocument/documentHighlight", &Impl::highlights},
                                                               {"textDocument/prepareRename", &Impl::prepare_rename},
                                                               {"textDocument/rename", &Impl::renamed},
                                                               {"textDocument/documentSymbol", &Impl::symbols},
                                                               {"workspace/symbol", &Impl::all_symbols},
                                                               {"textDocument/formatting", &Impl::formatted},
                                                               {"textDocument/codeAction", &Impl::actions},
                                                               {"textDocument/codeLens", &Impl::lenses},
                                                               {"workspace/executeCommand", &Impl::execute}};
    const auto found = kRequests.find(method);
    return found != kRequests.end() ? found->second : nullptr;
  }

  void notified(const std::string& method, const Value& params) {
    if (method == "initialized") return initialized();
    if (method == "textDocument/didOpen") return opened(params);
    if (method == "textDocument/didChange") return edited(params);
    if (method == "textDocument/didClose") return closed(params);
    if (method == "textDocument/didSave") {
      const auto path = path_of(text_of(member(params, "textDocument"), "uri"));
      return changed(path.value_or(fs::path()));
    }
    if (method == "workspace/didChangeWatchedFiles") return files_changed(params);
    // Others are passed over, as the protocol wants it of those that begin with $/.
  }
};

Server::Server(std::string version) : impl_(std::make_unique<Impl>(std::move(version))) {}
Server::~Server() = default;

void Server::answer(const Value& id, Value result) {
  answers_.push_back(to_json(Value(Map{{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}})));
}

void Server::answer_error(const Value& id, int code, std::string message) {
  answers_.push_back(to_json(
      Value(Map{{"jsonrpc", "2.0"}, {"id", id}, {"error", Map{{"code", code}, {"message", std::move(message)}}}})));
}

void Server::refuse(const std::string& problem) { answer_error({}, kParseError, problem); }

void Server::receive(std::string_view content) {
  auto message = text::parse_json(content);
  if (!message) return answer_error({}, kParseError, "that is no JSON: " + message.error().message);
  const Value* const id = message->find("id");
  const Value* const method = message->find("method");
  const bool is_id = id != nullptr && (id->as_int() != nullptr || id->as_string() != nullptr);
  if (message->as_map() == nullptr || (id != nullptr && !is_id && !id->is_null()) ||
      (method != nullptr && method->as_string() == nullptr) ||
      (method == nullptr && message->find("result") == nullptr && message->find("error") == nullptr))
    return answer_error(is_id ? *id : Value(), kInvalidRequest,
                        "a message is a request or a notification of JSON-RPC 2.0");
  if (method == nullptr) return;  // the answer to a request of ours, of which nothing follows
  Waiting waiting;
  waiting.is_request = is_id;
  if (is_id) waiting.id = *id;
  waiting.method = *method->as_string();
  if (Value* params = message->as_map()->find("params")) waiting.params = std::move(*params);
  if (waiting.method == "$/cancelRequest") {
    const Value& cancelled = member(waiting.params, "id");
    for (Waiting& other : waiting_)
      other.is_cancelled = other.is_cancelled || (other.is_request && other.id == cancelled);
    return;
  }
  if (waiting.is_request && !has_room())
    return answer_error(waiting.id, kServerCancelled, fmt::format("more than {} requests wait", kWaitingMax));
  waiting_.push_back(std::move(waiting));
}

bool Server::has_work() const { return !is_over_ && (!waiting_.empty() || impl_->unchecked() != nullptr); }

void Server::work() {
  if (!waiting_.empty()) {
    Waiting message = std::move(waiting_.front());
    waiting_.pop_front();
    handle(message);
  } else if (Impl::Project* const project = impl_->unchecked()) {
    try {
      impl_->check(*project);
    } catch (const std::exception& error) {
      impl_->note("window/logMessage", Map{{"type", 1}, {"message", std::string("checking failed: ") + error.what()}});
    }
  }
  for (std::string& note : impl_->notes) answers_.push_back(std::move(note));
  impl_->notes.clear();
}

void Server::handle(Waiting& message) {
  const auto refuse_request = [&](int code, std::string why) {
    if (message.is_request) answer_error(message.id, code, std::move(why));
  };
  if (message.is_cancelled) return refuse_request(kRequestCancelled, "cancelled");
  if (message.method == "exit") {
    is_over_ = true;
    return;
  }
  if (message.method != "initialize" && !is_initialized_)
    return refuse_request(kServerNotInitialized, "the first request is \"initialize\"");
  if (is_shut_down_) return refuse_request(kInvalidRequest, "the server has been shut down");
  try {
    if (message.method == "initialize") {
      if (is_initialized_) return refuse_request(kInvalidRequest, "it has been initialized");
      if (!message.is_request) return;
      Value result = impl_->initialize(message.params);
      is_initialized_ = true;
      return answer(message.id, std::move(result));
    }
    if (message.method == "shutdown") {
      is_shut_down_ = message.is_request;
      if (message.is_request) answer(message.id, {});
      return;
    }
    if (!message.is_request) return impl_->notified(message.method, message.params);
    const auto request = Impl::request(message.method);
    if (request == nullptr)
      return refuse_request(kMethodNotFound, fmt::format("there is no request \"{}\"", message.method));
    answer(message.id, (impl_.get()->*request)(message.params));
  } catch (const Refusal& refusal) {
    refuse_request(refusal.code, refusal.message);
  } catch (const std::exception& error) {
    refuse_request(kInternalError, std::string("the request failed: ") + error.what());
  }
}

std::vector<std::string> Server::take_answers() { return std::exchange(answers_, {}); }

}  // namespace sentree::lsp
