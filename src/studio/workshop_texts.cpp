#include <fmt/format.h>

#include <algorithm>

#include "sentree/lsp/completion.h"
#include "sentree/lsp/describe.h"
#include "sentree/lsp/file_names.h"
#include "sentree/lsp/rename.h"
#include "sentree/studio/detail/workshop.h"

namespace sentree::studio {

namespace fs = std::filesystem;

namespace {

// As pages show them.
std::string_view name_of_item(lsp::ItemKind kind) {
  switch (kind) {
    case lsp::ItemKind::kMethod:
    case lsp::ItemKind::kFunction: return "method";
    case lsp::ItemKind::kField:
    case lsp::ItemKind::kProperty: return "property";
    case lsp::ItemKind::kVariable:
    case lsp::ItemKind::kReference: return "variable";
    case lsp::ItemKind::kClass: return "class";
    case lsp::ItemKind::kInterface: return "interface";
    case lsp::ItemKind::kKeyword:
    case lsp::ItemKind::kUnit: return "keyword";
    case lsp::ItemKind::kEnumMember:
    case lsp::ItemKind::kValue: return "constant";
    case lsp::ItemKind::kEvent:
    case lsp::ItemKind::kFile:
    case lsp::ItemKind::kText: return "text";
  }
  return "text";
}

}  // namespace

Result<Value> Workshop::Impl::help_with(const std::string& file, std::uint64_t byte, bool complete) {
  const design::Document* document = workspace.find(file);
  if (document == nullptr) return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
  const auto at = static_cast<std::size_t>(std::min<std::uint64_t>(byte, document->text.size()));
  index.refresh(workspace.overlay());
  const std::string path = (folder / file).string();
  const auto number = [](std::size_t value) { return Value(static_cast<std::int64_t>(value)); };
  if (!complete) {
    std::size_t from = at;
    std::size_t to = at;
    const std::string text = lsp::hover_at(index, path, at, from, to);
    if (text.empty()) return Value();
    return Value(Map{{"from", number(from)}, {"to", number(to)}, {"text", text}});
  }
  const lsp::Completion found = lsp::complete(index, path, at);
  List items;
  for (const lsp::Item& item : found.items) {
    items.push_back(Map{{"label", item.label},
                        {"kind", name_of_item(item.kind)},
                        {"detail", item.detail},
                        {"documentation", item.documentation},
                        {"insert", item.insert.empty() ? item.label : item.insert}});
  }
  return Value(Map{{"from", number(found.from)}, {"to", number(found.to)}, {"items", std::move(items)}});
}

Result<Workshop::Impl::Renamed> Workshop::Impl::renamed_texts(const lsp::Renaming& renaming) const {
  Renamed renamed;
  for (const auto& [path, edits] : renaming.edits) {
    const std::string file = design::file_inside(folder, path);
    const design::Document* document = workspace.find(file);
    if (document == nullptr) return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
    auto text = design::with_edits(document->text, edits);
    if (!text) return tl::unexpected(text.error());
    renamed.texts.push_back({file, std::move(*text)});
    renamed.occurrences += edits.size();
  }
  return renamed;
}

List Workshop::Impl::unfollowed_by(const lsp::Symbol& symbol) const {
  List left;
  for (const lsp::Unfollowed& one : lsp::unfollowed(index, symbol)) {
    const auto before = std::string_view(index.find(one.file)->text).substr(0, one.from);
    left.push_back(Map{{"file", design::file_inside(folder, one.file)},
                       {"line", 1 + static_cast<std::int64_t>(std::count(before.begin(), before.end(), '\n'))},
                       {"text", one.what}});
  }
  return left;
}

Result<Value> Workshop::Impl::uses_of(const std::string& file) {
  if (workspace.find(file) == nullptr)
    return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
  index.refresh(workspace.overlay());
  List uses;
  for (const lsp::FileUse& use : lsp::uses_of_file(index, (folder / file).string())) {
    const lsp::IndexedFile* const content = index.find(use.file);
    if (content == nullptr) continue;
    const auto before = std::string_view(content->text).substr(0, use.from);
    uses.push_back(Map{{"file", design::file_inside(folder, use.file)},
                       {"line", 1 + static_cast<std::int64_t>(std::count(before.begin(), before.end(), '\n'))},
                       {"text", content->text.substr(use.from, use.to - use.from)}});
  }
  return Value(Map{{"uses", std::move(uses)}});
}

Result<Value> Workshop::Impl::rename_file(const std::string& file, const std::string& to) {
  index.refresh(workspace.overlay());
  const auto renaming = lsp::rename_file(index, (folder / file).string(), (folder / to).lexically_normal().string());
  if (!renaming) return tl::unexpected(renaming.error());
  auto renamed = renamed_texts(*renaming);
  if (!renamed) return tl::unexpected(renamed.error());
  List named;
  std::vector<std::string> files{file, to};
  for (const auto& text : renamed->texts) {
    if (text.file == file) continue;
    named.emplace_back(text.file);
    files.push_back(text.file);
  }
  std::vector<std::string> saved;
  if (file != to) {
    auto done = workspace.rename(file, to, renamed->texts);
    if (!done) {
      changed({file});
      return tl::unexpected(done.error());
    }
    saved = std::move(*done);
    const fs::path other(to);
    if (file == fmt::format("scenarios/{}.yaml", scenario) && other.parent_path() == "scenarios")
      scenario = other.stem().string();
    saved_beside(saved, files);
    changed(files);
  }
  return Value(Map{{"file", to},
                   {"files", std::move(named)},
                   {"places", static_cast<std::int64_t>(renamed->occurrences)},
                   {"saved", List(saved.begin(), saved.end())}});
}

Result<Value> Workshop::Impl::rename(const lsp::Symbol& symbol, const std::string& name, const std::string& to) {
  index.refresh(workspace.overlay());
  const auto found = index.places_of(symbol);
  switch (symbol.kind) {
    case lsp::SymbolKind::kLocation:
      if (index.names().locations.contains(name)) break;
      return fail("studio.request", fmt::format("the world has no location or area \"{}\"", name));
    case lsp::SymbolKind::kNode: {
      // One of several that are called so, or one that nobody names, is called otherwise where it stands.
      const auto defining =
          std::count_if(found.begin(), found.end(), [](const auto& place) { return place.occurrence->defines; });
      if (defining == 1 && found.size() > 1) break;
      return Value(Map{{"files", List()}, {"places", 0}, {"left", unfollowed_by(symbol)}});
    }
    default:
      if (!found.empty()) break;
      return fail("studio.request",
                  fmt::format("there is no {} \"{}\"", symbol.kind == lsp::SymbolKind::kTree ? "tree" : "state", name));
  }
  const auto renaming = lsp::rename(index, symbol, to);
  if (!renaming) return tl::unexpected(renaming.error());
  auto renamed = renamed_texts(*renaming);
  if (!renamed) return tl::unexpected(renamed.error());
  List left = unfollowed_by(symbol);
  auto& [texts, occurrences] = *renamed;
  std::vector<std::string> files;
  for (const auto& text : texts) files.push_back(text.file);
  if (!texts.empty()) {
    if (auto put = workspace.put(texts, fmt::format("rename {} to {}", name, to)); !put)
      return tl::unexpected(put.error());
    changed(files);
  }
  List named;
  for (const std::string& file : files) named.emplace_back(file);
  return Value(
      Map{{"files", std::move(named)}, {"places", static_cast<std::int64_t>(occurrences)}, {"left", std::move(left)}});
}

}  // namespace sentree::studio
