#include "sentree/lsp/detail/server_impl.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "sentree/bt/load.h"
#include "sentree/bt/write.h"
#include "sentree/design/findings.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/lsp/completion.h"
#include "sentree/lsp/describe.h"
#include "sentree/lsp/detail/outline.h"
#include "sentree/lsp/detail/recorded.h"
#include "sentree/lsp/detail/uri.h"
#include "sentree/lsp/detail/xml_cursor.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/rename.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/format.h"

// What editors ask about a place in a text, or about a text.

namespace sentree::lsp {

Value Server::Impl::completion(const Value& params) {
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

Value Server::Impl::hover(const Value& params) {
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

std::string Server::Impl::last_of_port(const Where& at) {
  const IndexedFile* const file = at.index.find(at.file);
  if (file == nullptr || file->kind != FileKind::kTree) return {};
  const XmlCursor cursor = xml_cursor(file->text, at.offset);
  std::string port;
  if (cursor.where == XmlCursor::Where::kAttributeName) port = file->text.substr(cursor.from, cursor.to - cursor.from);
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

std::string Server::Impl::shown(const std::string& what, const Value& value, const Recorded::Last& last) {
  constexpr std::size_t kShownMax = 600;
  std::string text = to_json(value);
  if (text.size() > kShownMax) text = text.substr(0, kShownMax) + "…";
  char time[32];
  std::snprintf(time, sizeof time, "%.3f", last.time_s);
  return fmt::format("last of `{}`, at {} s in {}:\n```json\n{}\n```\n", what, time, last.recording, text);
}

std::string Server::Impl::last_of(const Where& at, const Occurrence& occurrence) {
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

Value Server::Impl::definition(const Value& params) {
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

const Occurrence* Server::Impl::skill_of(const Where& at, const Occurrence& name) {
  const IndexedFile* const file = at.index.find(at.file);
  const Occurrence* skill = nullptr;
  for (const Occurrence& occurrence : file->occurrences) {
    if (occurrence.symbol.kind != SymbolKind::kSkill || occurrence.from > name.from) continue;
    if (file->text.find('>', occurrence.to) > name.from) skill = &occurrence;
  }
  return skill;
}

Value Server::Impl::references(const Value& params) {
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

Value Server::Impl::highlights(const Value& params) {
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

Value Server::Impl::prepare_rename(const Value& params) {
  const Where at = where(params, true);
  const Occurrence* const occurrence = at.index.at(at.file, at.offset);
  if (occurrence == nullptr) throw Refusal{kRequestFailed, "nothing that has a name stands here"};
  if (auto may = may_rename(at.index, occurrence->symbol); !may) throw Refusal{kRequestFailed, may.error().message};
  return Map{{"range", range(at.text.text, at.text.lines, occurrence->from, occurrence->to)},
             {"placeholder", written_name(occurrence->symbol)}};
}

// The answer has no place for it.
void Server::Impl::tell_unfollowed(const Index& index, const Symbol& symbol) {
  std::string places;
  for (const Unfollowed& one : unfollowed(index, symbol)) {
    const auto before = std::string_view(index.find(one.file)->text).substr(0, one.from);
    places += fmt::format("{}{}:{} {}", places.empty() ? "" : ", ",
                          std::filesystem::path(one.file).lexically_relative(index.folder()).generic_string(),
                          1 + std::count(before.begin(), before.end(), '\n'), one.what);
  }
  if (places.empty()) return;
  constexpr std::int64_t kWarning = 2;
  note("window/showMessage",
       Map{{"type", kWarning},
           {"message", fmt::format("{} may be meant here too, which cannot be told and stays as it is: {}",
                                   written_name(symbol), places)}});
}

Value Server::Impl::renamed(const Value& params) {
  const Where at = where(params, true);
  const Occurrence* const occurrence = at.index.at(at.file, at.offset);
  if (occurrence == nullptr) throw Refusal{kRequestFailed, "nothing that has a name stands here"};
  const auto renaming = rename(at.index, occurrence->symbol, text_of(params, "newName"));
  if (!renaming) throw Refusal{kRequestFailed, renaming.error().message};
  if (!renaming->files.empty() && !renames_files)
    throw Refusal{kRequestFailed, "the skill's chart would have to be renamed, which this editor cannot do"};
  tell_unfollowed(at.index, occurrence->symbol);
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
    const Text* const open = text_at(file);
    const Value counted = open != nullptr ? open->version : Value();
    changes.push_back(Map{{"textDocument", Map{{"uri", uri_at(file)}, {"version", counted}}},
                          {"edits", edits_value(indexed.text, indexed.lines, edits)}});
  }
  for (const auto& [from, to] : renaming->files)
    changes.push_back(Map{{"kind", "rename"}, {"oldUri", uri_at(from)}, {"newUri", uri_of(to)}});
  return Map{{"documentChanges", std::move(changes)}};
}

Value Server::Impl::outline_value(const IndexedFile& file, const std::vector<OutlinePart>& parts) const {
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

Value Server::Impl::symbols(const Value& params) {
  const Where at = where(params, false);
  const IndexedFile* const file = at.index.find(at.file);
  return file != nullptr ? outline_value(*file, outline_of(*file)) : Value(List());
}

Value Server::Impl::all_symbols(const Value& params) {
  find_projects();
  const std::string query = text_of(params, "query");
  List list;
  for (auto& [folder, project] : projects) {
    const Index& index = fresh(project);
    for (const auto& [name, file] : index.files()) {
      for (const Occurrence& occurrence : file.occurrences) {
        const std::string symbol = written_name(occurrence.symbol);
        if (!occurrence.defines || symbol.find(query) == std::string::npos || list.size() >= kItemsMax) continue;
        constexpr std::int64_t kVariable = 13;
        list.push_back(Map{{"name", symbol}, {"kind", kVariable}, {"location", location(index, {&name, &occurrence})}});
      }
    }
  }
  return list;
}

Value Server::Impl::formatted(const Value& params) {
  const Where at = where(params, false);
  const IndexedFile* const file = at.index.find(at.file);
  if (file == nullptr || (file->kind != FileKind::kTree && file->kind != FileKind::kChart)) return List();
  const auto text =
      file->kind == FileKind::kChart ? scxml::format(file->text, at.file) : bt::format(file->text, at.file);
  if (!text) throw Refusal{kRequestFailed, text.error().message};
  return edits_value(file->text, file->lines, design::edits_between(file->text, *text));
}

Value Server::Impl::actions(const Value& params) {
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

Value Server::Impl::lens(const IndexedFile& file, std::size_t at, const char* title, const char* command,
                         List arguments) const {
  return Map{{"range", range(file, at, at)},
             {"command", Map{{"title", title}, {"command", command}, {"arguments", std::move(arguments)}}}};
}

Value Server::Impl::lenses(const Value& params) {
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

Value Server::Impl::execute(const Value& params) {
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

}  // namespace sentree::lsp
