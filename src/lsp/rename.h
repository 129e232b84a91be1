#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/design/text_edit.h"
#include "sentree/lsp/index.h"

namespace sentree::lsp {

/// What a renaming changes, by absolute file.
struct Renaming {
  std::map<std::string, design::TextEdits> edits;
  std::vector<std::pair<std::string, std::string>> files;  ///< From, to; after the edits.
};

/// Whether there is a renaming of such symbols. Error: lsp.rename, why there is none.
[[nodiscard]] Result<void> may_rename(const Index& index, const Symbol& symbol);

/// Every place that names the symbol, in all files of the project, gets another name; everything else stays byte for
/// byte. A skill's chart is renamed with it. A place of the world is also named by what calls, constants, ports and the
/// blackboard are given, by texts in charts and requirements, and by what objects in charts keep by its name.
/// Errors: lsp.rename (no such name can be given, it is taken, texts could mean something else of that name, or a file
/// that may name it cannot be read).
[[nodiscard]] Result<Renaming> rename(const Index& index, const Symbol& symbol, const std::string& name);

/// A place that a renaming leaves as it is, though it may mean the symbol.
struct Unfollowed {
  std::string file;      ///< Absolute.
  std::size_t from = 0;  ///< Byte of its text.
  std::string what;      ///< "In(…) of an expression", "'moving'".
};
/// What scripts and expressions of charts have that may mean a state, a node, a skill or a service and of which that
/// cannot be told: texts that have its name, alone or between dots, and, of a state, every `In` of an expression in its
/// chart. Of other symbols nothing.
/// Cost: the charts that have the name are read.
[[nodiscard]] std::vector<Unfollowed> unfollowed(const Index& index, const Symbol& symbol);

}  // namespace sentree::lsp
