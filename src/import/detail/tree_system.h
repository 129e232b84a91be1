#pragma once

#include <filesystem>
#include <string>

#include "sentree/import/detail/source_folder.h"
#include "sentree/import/import.h"

namespace sentree::import {

/// Whether a file holds Behavior Trees of BehaviorTree.CPP: by its root element.
[[nodiscard]] bool is_tree_file(const std::filesystem::path& file);

/// The mission of a BehaviorTree.CPP program as a Sentree project: its files as they are, and for each of its leaves a
/// skill to begin with, which has the leaf's ports and succeeds. What Nav2 has comes with Sentree. C++ nodes with
/// children are findings.
///
/// SubTrees and models of nodes that the file and what it includes lack are found in the files beside it; what lies
/// outside its folder is not copied, and is a finding. A SubTree that is nowhere becomes one that succeeds.
[[nodiscard]] Loaded<Imported> import_tree(const std::filesystem::path& file);
/// The same of a folder: SubTrees and models of nodes are found in all of its files. `main` is the path in it of the
/// file to begin with; empty: the one whose tree no other uses. Errors: import.ambiguous, import.no-tree.
[[nodiscard]] Loaded<Imported> import_trees(const SourceFolder& folder, const std::string& main);

}  // namespace sentree::import
