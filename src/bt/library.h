#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/load.h"
#include "sentree/bt/palette.h"

namespace sentree::bt {

/// What a file of trees has, without loading them.
struct TreeFile {
  std::filesystem::path path;
  std::vector<std::string> trees;  ///< IDs of its BehaviorTrees, in their order; "" for one without.
  std::string main_tree;           ///< Its main_tree_to_execute; empty: it has none.
  std::size_t models = 0;          ///< Nodes that its TreeNodesModel describes, SubTrees not counted.
};

/// Files of trees that belong together: each is read once to know what is in it, and a load takes from the others what
/// it lacks. For trees that are spread over files without including each other.
class Library {
 public:
  /// Takes note of a file. `path` is what `read_file` of a load will be asked for. Of two BehaviorTrees or models of
  /// one ID the first counts. Errors: xml.*, bt.not-a-tree.
  Result<void> add(std::filesystem::path path, std::string_view xml);
  /// Takes note of nodes alone.
  void add(const std::vector<NodeModel>& models) { palette_.add(models); }

  [[nodiscard]] const std::vector<TreeFile>& files() const { return files_; }
  [[nodiscard]] const Palette& palette() const { return palette_; }
  /// The first file with the BehaviorTree of that ID; nothing if none has it.
  [[nodiscard]] std::optional<std::filesystem::path> find_tree(std::string_view id) const;
  /// Where to begin: the file with the BehaviorTree of that ID; without an ID the first that names a main tree, else
  /// the first with a tree that no other one uses. Null: there is none.
  [[nodiscard]] const TreeFile* main_file(std::string_view tree = {}) const;
  /// Trees that no other one uses: each may be the main one.
  [[nodiscard]] std::vector<std::string> roots() const;
  /// Lets a load look into these files. The library must outlive it.
  void serve(LoadOptions& options) const;

 private:
  std::vector<TreeFile> files_;
  std::map<std::string, std::size_t, std::less<>> by_tree_;  ///< Index of the file.
  std::set<std::string, std::less<>> used_;                  ///< IDs that a SubTree names.
  Palette palette_;
};

}  // namespace sentree::bt
