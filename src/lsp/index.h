#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/palette.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/symbols.h"
#include "sentree/project/project.h"
#include "sentree/text/overlay.h"

namespace sentree::lsp {

enum class FileKind : std::uint8_t { kTree, kChart, kRequirements, kProject, kScenario, kWorld, kInterface, kOther };

/// A file of a project as it is edited, and what it says.
struct IndexedFile {
  std::string text;
  Lines lines;
  FileKind kind = FileKind::kOther;
  /// Of the newest text that could be read; empty: the text cannot be read now, see `readable`.
  Occurrences occurrences;
  bool readable = true;
  std::vector<bt::NodeModel> models;  ///< That a tree's TreeNodesModel has.
  std::set<std::string> entries;      ///< Of the blackboard, that a tree names.
  std::set<std::string> node_names;
  std::set<std::string> skill_ids;
  std::set<std::string> tree_ids;
  std::map<std::string, std::string> leaves;  ///< Of a tree: names that leaves are given, and their IDs.
  struct Data {
    std::string id;
    bool has_value = false;
  };
  std::vector<Data> data;               ///< Of a chart.
  std::vector<std::string> outputs;     ///< Of a chart: params of <donedata>.
  std::vector<std::string> own_events;  ///< That a chart sends and raises.
  bool is_action = false;               ///< A chart that is ticked or halted.
};

/// What the files of a project name, kept while they are edited: what has not changed is not read again.
class Index {
 public:
  /// @param folder  Absolute; that of a sentree.yaml.
  explicit Index(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Looks at the files as they are now, those in `open` (borrowed for the call) as they are edited.
  /// Cost: a look at each file's time of change, and reading of what has changed.
  void refresh(const text::Overlay& open);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// By absolute path; with the interfaces outside of the folder that services are of.
  [[nodiscard]] const std::map<std::string, IndexedFile>& files() const { return files_; }
  [[nodiscard]] const IndexedFile* find(const std::string& file) const;
  [[nodiscard]] const Names& names() const { return names_; }
  [[nodiscard]] const project::Project* project() const { return project_ ? &*project_ : nullptr; }
  /// What nodes are: built in, declared in a TreeNodesModel, or told by a skill's chart.
  [[nodiscard]] const bt::Palette& palette() const { return palette_; }
  /// By absolute file.
  [[nodiscard]] const idl::Schema* schema(const std::string& file) const;
  /// The absolute file of a skill's chart; empty: none.
  [[nodiscard]] std::string chart_of(std::string_view skill) const;
  [[nodiscard]] const std::string& world_file() const { return world_file_; }

  struct Place {
    const std::string* file = nullptr;
    const Occurrence* occurrence = nullptr;
  };
  /// What stands at a byte; null: nothing that is known.
  [[nodiscard]] const Occurrence* at(const std::string& file, std::size_t offset) const;
  [[nodiscard]] std::vector<Place> places_of(const Symbol& symbol) const;

 private:
  struct Stamp {
    std::filesystem::file_time_type changed;
    std::uintmax_t size = 0;
    friend bool operator==(const Stamp&, const Stamp&) = default;
  };
  void read_files(const text::Overlay& open, std::set<std::string>& changed);
  void read_project();
  void read_interfaces(const std::set<std::string>& changed);
  void gather();
  void gather_answering(const text::YamlNode& node);
  void name_all(const std::set<std::string>& changed, bool all);

  std::filesystem::path folder_;
  std::map<std::string, IndexedFile> files_;
  std::map<std::string, Stamp> stamps_;  // of files that are read from disk
  std::map<std::string, std::shared_ptr<const text::XmlDocument>> documents_;
  std::map<std::string, text::YamlNode> yaml_;
  std::map<std::string, idl::Schema> schemas_;
  std::optional<project::Project> project_;
  std::string world_file_;
  Names names_;
  bt::Palette palette_;
};

/// The folder of the sentree.yaml that a file belongs to: its own, or the nearest above; empty: none.
[[nodiscard]] std::filesystem::path project_of(const std::filesystem::path& file);

[[nodiscard]] FileKind kind_of(const std::filesystem::path& file, std::string_view text);

}  // namespace sentree::lsp
