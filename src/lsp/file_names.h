#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/rename.h"

namespace sentree::lsp {

/// A place that names a file of the project, or that goes with it: bytes of a text.
struct FileUse {
  std::string file;  ///< Whose text it is, absolute.
  std::size_t from = 0;
  std::size_t to = 0;
  /// How the path is written there; empty: it is a name of what the file is or defines, or a pattern.
  std::string path;
};

/// Where a file is used: named by sentree.yaml, scenarios, trees, charts and interfaces, found by a pattern or by the
/// ID of a skill's leaves, or by the name of a monitor, requirement or tree that it is or defines. `file` is absolute.
/// By file and place.
[[nodiscard]] std::vector<FileUse> uses_of_file(const Index& index, const std::string& file);

/// The file gets another place in the project, and all that uses it says so; everything else stays byte for byte. What
/// is called after it is renamed with it: a skill, a monitor. A model keeps its name, which is written then. Paths in
/// the file itself are those from its new place. `to` is absolute.
/// Errors: lsp.rename (another kind of file, a name that is taken or cannot be given, a text that may name it and
/// cannot be read, the project's own file, a skill out of skills/, a tree out of its pattern).
[[nodiscard]] Result<Renaming> rename_file(const Index& index, const std::string& file, const std::string& to);

}  // namespace sentree::lsp
