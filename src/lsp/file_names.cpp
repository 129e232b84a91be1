#include "sentree/lsp/file_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "sentree/base/pattern.h"
#include "sentree/design/findings.h"
#include "sentree/project/interface_file.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::lsp {

namespace {

namespace fs = std::filesystem;

std::string normal(const fs::path& path) { return path.lexically_normal().string(); }

std::string in_project(const Index& index, const std::string& file) {
  return fs::path(file).lexically_relative(index.folder()).generic_string();
}

// A path as a text has it.
struct Written {
  std::string path;
  std::size_t from = 0;
  std::size_t to = 0;
  fs::path below;           // the folder from which it leads
  bool is_pattern = false;  // with '*'
  /// Of a model without a name of its own: where one can be written, and how.
  std::size_t name_at = 0;
  std::string name_begin;
};
using WrittenPaths = std::vector<Written>;

// ---- YAML ----

class PathsInYaml {
 public:
  PathsInYaml(const Index& index, const std::string& file, const IndexedFile& content)
      : index_(index), text_(content.text), own_(fs::path(file).parent_path()) {
    if (const auto root = text::parse_yaml(text_, file)) look(*root, {});
  }

  WrittenPaths found;

 private:
  void look(const text::YamlNode& node, std::string_view key) {
    if (node.is_scalar()) scalar(node, key);
    for (const text::YamlNode& item : node.items) {
      look(item, key);
      if (key == "models") name_of(item);
    }
    for (const auto& [name, value] : node.entries) look(value, name.scalar);
  }

  void scalar(const text::YamlNode& node, std::string_view key) {
    static const std::set<std::string_view> kTexts{"description", "title", "reason"};
    const std::size_t from = design::offset_of(text_, node.span) + (node.quoted ? 1 : 0);
    std::string path = node.scalar;
    // As other texts would read, it is left alone.
    if (path.empty() || kTexts.contains(key) || text_.compare(from, path.size(), path) != 0) return;
    fs::path below = index_.folder();
    if (key == "interface") {
      path = project::interface_name(path).file;
      below /= "interfaces";
      if (path.size() > node.scalar.size()) return;  // of ROS: no text of the project
    } else if (fs::path(path).extension().empty()) {
      return;
    } else if (index_.find(normal(below / path)) == nullptr && index_.find(normal(own_ / path)) != nullptr) {
      below = own_;
    }
    const std::size_t size = path.size();
    const bool is_pattern = path.find('*') != std::string::npos;
    found.push_back({std::move(path), from, from + size, std::move(below), is_pattern, 0, {}});
  }

  // Where a model's entry can say its name.
  void name_of(const text::YamlNode& entry) {
    const text::YamlNode* const file = entry.find("file");
    if (file == nullptr || entry.find("name") != nullptr) return;
    const auto key = std::find_if(entry.entries.begin(), entry.entries.end(),
                                  [](const auto& one) { return one.first.scalar == "file"; });
    const std::size_t from = design::offset_of(text_, file->span) + (file->quoted ? 1 : 0);
    const auto path = std::find_if(found.begin(), found.end(), [&](const Written& one) { return one.from == from; });
    if (path == found.end()) return;
    path->name_at = path->to + (file->quoted ? 1 : 0);
    const std::size_t begin = design::offset_of(text_, entry.span);
    const bool is_flow = begin < text_.size() && text_[begin] == '{';
    path->name_begin =
        is_flow ? ", name: " : "\n" + std::string(static_cast<std::size_t>(key->first.span.column - 1), ' ') + "name: ";
  }

  const Index& index_;
  const std::string& text_;
  const fs::path own_;
};

// ---- All texts ----

WrittenPaths paths_in_xml(const std::string& file, const IndexedFile& content) {
  WrittenPaths found;
  const auto document = text::XmlDocument::parse(content.text, file, {.lenient = true});
  if (!document) return found;
  const fs::path below = fs::path(file).parent_path();
  text::for_each_element(document->root(), [&](const text::XmlElement& element) {
    // An include of a ROS package leads from there.
    const bool is_include = element.local_name() == "include" && !element.attribute("ros_pkg");
    const char* const name = content.kind == FileKind::kTree ? "path" : "src";
    const auto value = element.attribute(name);
    if (!value || (content.kind == FileKind::kTree && !is_include)) return;
    const std::size_t from = element.attribute_value_offset(name);
    if (content.text.compare(from, value->size(), *value) == 0)
      found.push_back({std::string(*value), from, from + value->size(), below, false, 0, {}});
  });
  return found;
}

WrittenPaths paths_in_interface(const std::string& file, const std::string& text) {
  WrittenPaths found;
  constexpr std::string_view kWord = "include";
  for (std::size_t line = 0; line < text.size();) {
    const std::size_t end = std::min(text.find('\n', line), text.size());
    const std::size_t word = text.find_first_not_of(" \t", line);
    if (word < end && text.compare(word, kWord.size(), kWord) == 0) {
      const std::size_t open = text.find_first_of("\"'", word);
      const std::size_t close = open < end ? text.find(text[open], open + 1) : end;
      if (close < end)
        found.push_back(
            {text.substr(open + 1, close - open - 1), open + 1, close, fs::path(file).parent_path(), false, 0, {}});
    }
    line = end + 1;
  }
  return found;
}

WrittenPaths paths_in(const Index& index, const std::string& file, const IndexedFile& content) {
  switch (content.kind) {
    case FileKind::kTree:
    case FileKind::kChart: return paths_in_xml(file, content);
    case FileKind::kProject:
    case FileKind::kScenario:
    case FileKind::kWorld:
    case FileKind::kOther:
      if (file.ends_with(".yaml") || file.ends_with(".yml")) return PathsInYaml(index, file, content).found;
      return {};
    case FileKind::kInterface: return paths_in_interface(file, content.text);
    case FileKind::kRequirements: break;
  }
  return {};
}

// '*' stands for text without a slash.
bool fits_pattern(const fs::path& pattern, const fs::path& file) {
  return std::equal(pattern.begin(), pattern.end(), file.begin(), file.end(),
                    [](const fs::path& a, const fs::path& b) { return matches_pattern(a.string(), b.string()); });
}

bool names_file(const Written& path, const std::string& file) {
  const std::string full = normal(path.below / path.path);
  return path.is_pattern ? fits_pattern(full, file) : full == file;
}

// The path of `file` as it is written where `old` stood.
std::string written_as(const Written& old, const std::string& file) {
  std::string path = fs::path(file).lexically_relative(old.below).generic_string();
  return old.path.starts_with("./") ? "./" + path : path;
}

std::string stem_of(const std::string& file) { return fs::path(file).stem().string(); }

// The skill whose leaves find the file by their ID; empty: none does.
std::string skill_by_name(const Index& index, const std::string& file) {
  if (normal(fs::path(file).parent_path()) != normal(index.folder() / "skills") || !file.ends_with(".scxml")) return {};
  const Symbol skill{SymbolKind::kSkill, stem_of(file)};
  // Leaves whose chart sentree.yaml names do not look for this one.
  if (index.project() != nullptr) {
    for (const project::SkillEntry& entry : index.project()->skills) {
      if (entry.leaf == skill.name && !entry.file.path.empty()) return {};
    }
  }
  return index.places_of(skill).empty() ? std::string() : skill.name;
}

// The monitor that has its name from the file; nothing where an entry gives it one.
std::string monitor_by_name(const Index& index, const std::string& file) {
  const std::string name = stem_of(file);
  const auto known = index.names().monitors.find(name);
  return file.ends_with(".scxml") && known != index.names().monitors.end() && known->second == file ? name
                                                                                                    : std::string();
}

std::vector<Index::Place> places_by_name(const Index& index, const std::string& file) {
  std::vector<Index::Place> places;
  if (const std::string skill = skill_by_name(index, file); !skill.empty())
    places = index.places_of({SymbolKind::kSkill, skill});
  if (const std::string monitor = monitor_by_name(index, file); !monitor.empty()) {
    for (const Index::Place& place : index.places_of({SymbolKind::kRequirement, monitor})) {
      // What defines it is the path of the file, or a name, which stays.
      if (!place.occurrence->defines) places.push_back(place);
    }
  }
  return places;
}

Result<void> may_rename_file(const Index& index, const std::string& file, const std::string& to) {
  const auto refuse = [](std::string why) { return fail("lsp.rename", std::move(why)); };
  if (file == normal(index.folder() / "sentree.yaml")) return refuse("sentree.yaml is the project; its name is fixed");
  if (index.find(file) == nullptr) return refuse(in_project(index, file) + " is no file of this project");
  if (fs::path(file).extension() != fs::path(to).extension())
    return refuse(
        fmt::format("a file like {} ends in \"{}\"", in_project(index, file), fs::path(file).extension().string()));
  if (index.find(to) != nullptr) return refuse(in_project(index, to) + " is there already; choose another name");
  // What it cannot say is found.
  const std::string name = fs::path(file).filename().string();
  for (const auto& [other, content] : index.files()) {
    if (!content.readable && content.text.find(name) != std::string::npos)
      return refuse(in_project(index, other) + " may name it and cannot be read; mend it first");
  }
  if (!skill_by_name(index, file).empty() && fs::path(file).parent_path() != fs::path(to).parent_path())
    return refuse(
        fmt::format("leaves find {} by its name in skills/; say \"file\" for it under \"skills\" of "
                    "sentree.yaml first",
                    in_project(index, file)));
  return {};
}

}  // namespace

std::vector<FileUse> uses_of_file(const Index& index, const std::string& file) {
  std::vector<FileUse> uses;
  for (const auto& [other, content] : index.files()) {
    if (other == file) continue;
    for (const Written& path : paths_in(index, other, content)) {
      if (names_file(path, file))
        uses.push_back({other, path.from, path.to, path.is_pattern ? std::string() : path.path});
    }
  }
  std::vector<Index::Place> places = places_by_name(index, file);
  // What is defined in it, and goes with it.
  if (const IndexedFile* const content = index.find(file); content != nullptr) {
    for (const Occurrence& defined : content->occurrences) {
      if (!defined.defines ||
          (defined.symbol.kind != SymbolKind::kRequirement && defined.symbol.kind != SymbolKind::kTree))
        continue;
      for (const Index::Place& place : index.places_of(defined.symbol)) {
        if (!place.occurrence->defines) places.push_back(place);
      }
    }
  }
  for (const Index::Place& place : places) {
    if (*place.file != file) uses.push_back({*place.file, place.occurrence->from, place.occurrence->to, {}});
  }
  std::sort(uses.begin(), uses.end(),
            [](const FileUse& a, const FileUse& b) { return std::tie(a.file, a.from) < std::tie(b.file, b.from); });
  return uses;
}

Result<Renaming> rename_file(const Index& index, const std::string& file, const std::string& to) {
  Renaming renaming;
  if (file == to) return renaming;
  if (auto may = may_rename_file(index, file, to); !may) return tl::unexpected(may.error());
  const std::string stem = stem_of(to);
  const bool has_other_stem = stem != stem_of(file);
  if (const std::string skill = skill_by_name(index, file); has_other_stem && !skill.empty()) {
    auto with_skill = rename(index, {SymbolKind::kSkill, skill}, stem);
    if (!with_skill) return with_skill;
    renaming.edits = std::move(with_skill->edits);
  }
  if (const std::string monitor = monitor_by_name(index, file); has_other_stem && !monitor.empty()) {
    if (index.names().monitors.contains(stem))
      return fail("lsp.rename", fmt::format("there is a monitor \"{}\" already", stem));
    for (const Index::Place& place : places_by_name(index, file))
      renaming.edits[*place.file].push_back({place.occurrence->from, place.occurrence->to, stem});
  }
  for (const auto& [other, content] : index.files()) {
    design::TextEdits& edits = renaming.edits[other];
    for (const Written& path : paths_in(index, other, content)) {
      if (path.is_pattern) {
        if (names_file(path, file) && !names_file(path, to))
          return fail("lsp.rename", fmt::format("{} finds it as \"{}\", which {} would not be",
                                                in_project(index, other), path.path, in_project(index, to)));
        continue;
      }
      if (other == file) {
        // From its new place.
        const std::string named = normal(path.below / path.path);
        Written there = path;
        if (path.below == fs::path(file).parent_path()) there.below = fs::path(to).parent_path();
        const std::string now = written_as(there, named);
        if (now != path.path && index.find(named) != nullptr) edits.push_back({path.from, path.to, now});
        continue;
      }
      if (!names_file(path, file)) continue;
      edits.push_back({path.from, path.to, written_as(path, to)});
      if (has_other_stem && !path.name_begin.empty())
        edits.push_back({path.name_at, path.name_at, path.name_begin + stem_of(file)});
    }
    std::sort(edits.begin(), edits.end(),
              [](const design::TextEdit& a, const design::TextEdit& b) { return a.from < b.from; });
    // The project may say of a skill's leaf what its file is: both are of one place.
    edits.erase(std::unique(edits.begin(), edits.end()), edits.end());
    if (edits.empty())
      renaming.edits.erase(other);
    else if (!other.starts_with(index.folder().string() + "/"))
      return fail("lsp.rename", other + " names it and is no file of this project");
  }
  renaming.files = {{file, to}};
  return renaming;
}

}  // namespace sentree::lsp
