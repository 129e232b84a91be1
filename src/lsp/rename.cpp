#include "sentree/lsp/rename.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "sentree/bt/tree.h"
#include "sentree/design/workspace.h"
#include "sentree/lsp/file_names.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/mission_tree.h"
#include "sentree/scxml/edit.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"
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
    if (c == '.') return kind == SymbolKind::kDefinition || kind == SymbolKind::kEvent || kind == SymbolKind::kState;
    return is_free ? c == ' ' || c == '-' : c == '-' && kind == SymbolKind::kState;
  }) && (is_free || std::isdigit(static_cast<unsigned char>(name.front())) == 0);
}

// Of a node, as far as XML and messages can have it.
bool is_any_name(std::string_view name) {
  return !name.empty() && std::none_of(name.begin(), name.end(),
                                       [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; });
}

// What stands for something else in the paths and patterns by which nodes are named.
constexpr std::string_view kOfPaths = ".*/{}";

// In the quotes of the attribute that it becomes the value of.
std::string in_attribute(const std::string& name, char quote) {
  std::string out;
  for (const char c : text::xml_escape(name)) out += c == '\'' && quote == '\'' ? "&apos;" : std::string(1, c);
  return out;
}

std::string shown(const Index& index, const std::string& file) {
  return fs::path(file).lexically_relative(index.folder()).generic_string();
}

// The symbol of another name beside this one.
Symbol renamed(const Symbol& symbol, const std::string& name) {
  const std::size_t hash = symbol.name.rfind('#');
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

// Charts that come with Sentree are no files of the project, and call services by their names. Empty: none calls it.
std::string foreign_caller(const Index& index, const std::string& service) {
  if (index.project() == nullptr) return {};
  const project::Project& project = *index.project();
  for (const std::string& skill : index.names().skills) {
    const auto entry =
        std::find_if(project.skills.begin(), project.skills.end(), [&](const auto& one) { return one.leaf == skill; });
    const auto* const own = entry != project.skills.end() ? &*entry : nullptr;
    const fs::path file = (index.folder() / project::skill_file(project, own, skill).path).lexically_normal();
    if (index.find(file.string()) != nullptr) continue;
    const auto text = text::read_file(file, {}, design::kDocumentBytesMax);
    if (text && text->find(fmt::format("\"{}\"", service)) != std::string::npos) return file.filename().string();
  }
  return {};
}

// What a final state of that name says of a skill or a monitor; empty: nothing.
std::string meaning_of_state(const Index& index, const Symbol& symbol) {
  const std::string name = written_name(symbol);
  const std::string file = symbol.name.substr(0, symbol.name.size() - name.size() - 1);
  const auto is_its = [&](const auto& entry) { return entry.second == file; };
  const Names& names = index.names();
  const bool is_skill = names.charts.contains(file) || std::any_of(names.leaves.begin(), names.leaves.end(), is_its);
  if (is_skill && names.answering.contains(name)) return "what a protocol of the project waits for";
  if (is_skill && (name == "success" || name == "failure" || name == "halted")) return "an outcome of a skill";
  const bool is_monitor = std::any_of(names.monitors.begin(), names.monitors.end(), is_its);
  return is_monitor && (name == "violated" || name == "satisfied") ? "a verdict of a monitor" : "";
}

bool is_final(const std::string& text, const Occurrence& state) {
  const std::size_t tag = text.rfind('<', state.from);
  return state.defines && tag != std::string::npos && text.find("final", tag) < state.from;
}

// A skill that the project has: other programs and palettes keep their names.
bool has_skill(const Index& index, const std::string& skill) {
  if (!index.chart_of(skill).empty()) return true;
  if (index.project() == nullptr) return false;
  const auto& entries = index.project()->skills;
  return std::any_of(entries.begin(), entries.end(), [&](const auto& entry) { return entry.leaf == skill; });
}

// Requirements mean with the new name what they meant before: it is neither a word of theirs nor something else there.
Result<void> may_be_called(const Index& index, const std::string& file, const std::string& text,
                           const std::string& edited, const Symbol& symbol, const std::string& name) {
  const auto parsed = monitor::parse_requirements(edited, shown(index, file));
  if (!parsed.value && monitor::parse_requirements(text, file).value) {
    const auto wrong = std::find_if(parsed.diagnostics.begin(), parsed.diagnostics.end(),
                                    [](const Diagnostic& one) { return one.severity == Severity::kError; });
    return fail("lsp.rename", fmt::format("with \"{}\" {} could not be read: {}", name, shown(index, file),
                                          wrong != parsed.diagnostics.end() ? to_string(*wrong) : ""));
  }
  const bool is_own = symbol.kind == SymbolKind::kDefinition || symbol.kind == SymbolKind::kEvent;
  if (!is_own && symbol.kind != SymbolKind::kLocation) return {};
  Names names = index.names();
  if (symbol.kind == SymbolKind::kLocation) {
    names.locations.erase(symbol.name);
    names.locations.insert(name);
  }
  const auto symbols = [](const Occurrences& occurrences) {
    std::vector<Symbol> found;
    for (const Occurrence& occurrence : occurrences) found.push_back(occurrence.symbol);
    return found;
  };
  std::vector<Symbol> before = symbols(occurrences_in_requirements(text, file, index.names()));
  std::replace(before.begin(), before.end(), symbol, renamed(symbol, name));
  if (before != symbols(occurrences_in_requirements(edited, file, names)))
    return fail("lsp.rename", fmt::format("\"{}\" stands for something else in {}", name, shown(index, file)));
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
      if (has_skill(index, symbol.name)) return {};
      return fail("lsp.rename", "no chart of this project is called so, nor an entry of \"skills\" in sentree.yaml");
    case SymbolKind::kNode:
    case SymbolKind::kTree: return {};
    case SymbolKind::kService: {
      const std::string caller = foreign_caller(index, symbol.name);
      if (caller.empty()) return {};
      return fail("lsp.rename", fmt::format("{}, which comes with Sentree, calls it so", caller));
    }
    case SymbolKind::kDefinition:
    case SymbolKind::kEvent:
    case SymbolKind::kLocation: return {};
    case SymbolKind::kState: {
      const std::string meaning = meaning_of_state(index, symbol);
      if (meaning.empty()) return {};
      for (const Index::Place& place : index.places_of(symbol)) {
        if (index.names().answering.contains(written_name(symbol)) ||
            is_final(index.find(*place.file)->text, *place.occurrence))
          return fail("lsp.rename",
                      fmt::format("\"{}\" is {}: called otherwise, it says nothing", written_name(symbol), meaning));
      }
      return {};
    }
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
  const bool is_plain = is_name(name, symbol.kind);
  if (!is_plain && !(symbol.kind == SymbolKind::kNode && is_any_name(name)))
    return fail("lsp.rename", fmt::format("\"{}\" is no name for it", name));
  Renaming renaming;
  if (name == old) return renaming;
  if (const std::size_t sign = name.find_first_of(kOfPaths); !is_plain && sign != std::string::npos)
    return fail(
        "lsp.rename",
        fmt::format("\"{}\" is no name for it: \"{}\" has a meaning in paths, patterns or entries", name, name[sign]));
  const bool is_own = symbol.kind == SymbolKind::kDefinition || symbol.kind == SymbolKind::kEvent;
  if ((is_own || symbol.kind == SymbolKind::kRequirement) && is_word_of_requirements(name))
    return fail("lsp.rename", fmt::format("\"{}\" is a word of the language; choose another name", name));
  if (!index.places_of(renamed(symbol, name)).empty())
    return fail("lsp.rename", fmt::format("\"{}\" is there already", name));
  const Names& names = index.names();
  const std::string old_in_messages = bt::event_name(old);
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
      const std::string& now = occurrence.in_message ? old_in_messages : old;
      if (occurrence.symbol != symbol ||
          (!occurrence.escaped && content.text.compare(occurrence.from, occurrence.to - occurrence.from, now) != 0))
        continue;
      const bool is_value = content.kind == FileKind::kTree && occurrence.from > 0;
      // What stands for any other sign there is written nowhere else.
      if (!is_plain && !is_value && !occurrence.in_message)
        return fail("lsp.rename",
                    fmt::format("{} names it, where it cannot be called \"{}\"", shown(index, file), name));
      const std::string written = occurrence.in_message ? bt::event_name(name)
                                  : is_value            ? in_attribute(name, content.text[occurrence.from - 1])
                                                        : name;
      if (edits.empty() || edits.back().to <= occurrence.from)
        edits.push_back({occurrence.from, occurrence.to, written});
    }
    if (edits.empty()) continue;
    if (content.kind == FileKind::kRequirements) {
      const auto edited = design::with_edits(content.text, edits);
      if (!edited) return tl::unexpected(edited.error());
      if (auto may = may_be_called(index, file, content.text, *edited, symbol, name); !may)
        return tl::unexpected(may.error());
    }
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
      // What names the file.
      for (const FileUse& use : uses_of_file(index, chart.string())) {
        if (use.path.empty()) continue;
        design::TextEdits& edits = renaming.edits[use.file];
        edits.push_back({use.from, use.to, (fs::path(use.path).parent_path() / to.filename()).generic_string()});
        std::sort(edits.begin(), edits.end(), [](const auto& a, const auto& b) { return a.from < b.from; });
      }
    }
  }
  return renaming;
}

namespace {

// Between dots, as in "done.state.moving"; a name may have dots itself.
bool has_part(std::string_view text, std::string_view name) {
  for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || text[at - 1] == '.') && (end == text.size() || text[end] == '.')) return true;
  }
  return false;
}

}  // namespace

std::vector<Unfollowed> unfollowed(const Index& index, const Symbol& symbol) {
  std::vector<Unfollowed> found;
  const bool is_state = symbol.kind == SymbolKind::kState;
  if (!is_state && symbol.kind != SymbolKind::kNode && symbol.kind != SymbolKind::kSkill &&
      symbol.kind != SymbolKind::kService)
    return found;
  const std::string name = written_name(symbol);
  const std::string in_messages = is_state ? name : bt::event_name(name);
  for (const auto& [file, content] : index.files()) {
    if (content.kind != FileKind::kChart || (is_state && symbol.name != fmt::format("{}#{}", file, name))) continue;
    const auto document = text::XmlDocument::parse(content.text, file, {.lenient = true});
    if (!document) continue;
    const auto is_followed = [&, &occurrences = content.occurrences](const scxml::TextInScript& text) {
      return std::any_of(occurrences.begin(), occurrences.end(),
                         [&](const Occurrence& one) { return one.from >= text.from && one.to <= text.to; });
    };
    text::for_each_element(document->root(), [&, &path = file](const text::XmlElement& element) {
      for (const scxml::TextInScript& text : scxml::texts_in_scripts(*document, element)) {
        if (text.computed && is_state)
          found.push_back({path, text.from, "In(…) of an expression"});
        else if (!text.computed && (has_part(text.text, name) || has_part(text.text, in_messages)) &&
                 !is_followed(text))
          found.push_back({path, text.from, fmt::format("'{}'", text.text)});
      }
    });
  }
  return found;
}

}  // namespace sentree::lsp
