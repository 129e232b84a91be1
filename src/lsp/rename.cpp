#include "sentree/lsp/rename.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "sentree/text/yaml.h"

namespace sentree::lsp {

namespace {

namespace fs = std::filesystem;

bool is_name(std::string_view name, SymbolKind kind) {
  // Nodes may have any name; what their names become in observations is one rule of the project.
  const bool is_free = kind == SymbolKind::kNode || kind == SymbolKind::kTree;
  return !name.empty() && std::all_of(name.begin(), name.end(), [&](char c) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) != 0 || c == '_' || u >= 0x80) return true;
    return is_free ? c == ' ' || c == '-' : c == '-' && kind == SymbolKind::kState;
  }) && (is_free || std::isdigit(static_cast<unsigned char>(name.front())) == 0);
}

std::string shown(const Index& index, const std::string& file) {
  return fs::path(file).lexically_relative(index.folder()).generic_string();
}

// The symbol of another name beside this one.
Symbol renamed(const Symbol& symbol, const std::string& name) {
  const std::size_t hash = symbol.name.find('#');
  return {symbol.kind, hash == std::string::npos ? name : symbol.name.substr(0, hash + 1) + name};
}

// What else of the project has that name, so that a text could mean either; empty: nothing.
std::string another_meaning(const Index& index, const std::string& name) {
  const Names& names = index.names();
  if (names.services.contains(name)) return "a service";
  if (names.nodes.contains(name) || names.skills.contains(name) || names.builtins.contains(name)) return "a node";
  const auto has_it = [&](const idl::Enum& one) { return one.find(name) != nullptr; };
  for (const auto& [file, content] : index.files()) {
    const idl::Schema* const schema = index.schema(file);
    if (schema != nullptr && std::any_of(schema->enumerations().begin(), schema->enumerations().end(), has_it))
      return "a value of the interface " + fs::path(file).filename().string();
  }
  const IndexedFile* const world = index.find(index.world_file());
  const auto root = world == nullptr ? Result<text::YamlNode>() : text::parse_yaml(world->text, index.world_file());
  for (const char* section : {"robots", "stations", "doors", "obstacles", "people"}) {
    const text::YamlNode* const things = root ? root->find(section) : nullptr;
    if (things != nullptr && things->find(name) != nullptr) return fmt::format("one of the world's {}", section);
  }
  return {};
}

// A place is named by texts, which have to mean it and nothing else.
Result<void> may_rename_place(const Index& index, const Symbol& symbol, const std::string& name) {
  const auto places = index.places_of(symbol);
  if (std::all_of(places.begin(), places.end(), [&](const auto& place) { return *place.file == index.world_file(); }))
    return {};
  for (const std::string& one : {symbol.name, name}) {
    if (const std::string other = another_meaning(index, one); !other.empty())
      return fail(
          "lsp.rename",
          fmt::format("\"{}\" is the name of {} too, and texts do not tell which of them they mean", one, other));
  }
  return {};
}

}  // namespace

Result<void> may_rename(const Index& index, const Symbol& symbol) {
  switch (symbol.kind) {
    case SymbolKind::kSkill:
    case SymbolKind::kNode:
    case SymbolKind::kTree:
    case SymbolKind::kService:
    case SymbolKind::kState:
    case SymbolKind::kDefinition:
    case SymbolKind::kLocation: return {};
    case SymbolKind::kRequirement:
      for (const Index::Place& place : index.places_of(symbol)) {
        if (place.occurrence->defines && place.file->ends_with(".req")) return {};
      }
      return fail("lsp.rename", "a monitor is named after its file; rename that, or give it a \"name\"");
    case SymbolKind::kInterface:
    case SymbolKind::kMethod:
    case SymbolKind::kType: return fail("lsp.rename", "programs in other languages use this name of the interface too");
    case SymbolKind::kData: break;
  }
  return fail("lsp.rename", "not every place that names this can be told");
}

Result<Renaming> rename(const Index& index, const Symbol& symbol, const std::string& name) {
  if (auto may = may_rename(index, symbol); !may) return tl::unexpected(may.error());
  const std::string old = written_name(symbol);
  if (!is_name(name, symbol.kind)) return fail("lsp.rename", fmt::format("\"{}\" is no name for it", name));
  Renaming renaming;
  if (name == old) return renaming;
  if (!index.places_of(renamed(symbol, name)).empty())
    return fail("lsp.rename", fmt::format("\"{}\" is there already", name));
  const Names& names = index.names();
  const bool is_observed =
      symbol.kind == SymbolKind::kSkill || symbol.kind == SymbolKind::kNode || symbol.kind == SymbolKind::kService;
  if (is_observed && (names.services.contains(name) || names.nodes.contains(name) || names.skills.contains(name) ||
                      names.builtins.contains(name)))
    return fail("lsp.rename",
                fmt::format("\"{}\" is the name of something else, and their messages would look alike", name));
  if (symbol.kind == SymbolKind::kLocation) {
    if (auto may = may_rename_place(index, symbol, name); !may) return tl::unexpected(may.error());
  }
  for (const auto& [file, content] : index.files()) {
    if (!content.readable && content.text.find(old) != std::string::npos)
      return fail("lsp.rename", shown(index, file) + " may name it and cannot be read; mend it first");
    design::TextEdits edits;
    for (const Occurrence& occurrence : content.occurrences) {
      if (occurrence.symbol != symbol ||
          content.text.compare(occurrence.from, occurrence.to - occurrence.from, old) != 0)
        continue;
      if (edits.empty() || edits.back().to <= occurrence.from) edits.push_back({occurrence.from, occurrence.to, name});
    }
    if (edits.empty()) continue;
    if (!file.starts_with(index.folder().string() + "/"))
      return fail("lsp.rename", file + " names it and is no file of this project");
    renaming.edits[file] = std::move(edits);
  }
  if (symbol.kind == SymbolKind::kSkill) {
    const fs::path chart = index.chart_of(old);
    if (!chart.empty() && chart.stem() == old) {
      const fs::path to = chart.parent_path() / (name + chart.extension().string());
      std::error_code error;
      if (fs::exists(to, error)) return fail("lsp.rename", shown(index, to.string()) + " is there already");
      renaming.files.emplace_back(chart.string(), to.string());
    }
  }
  return renaming;
}

}  // namespace sentree::lsp
