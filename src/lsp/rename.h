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

}  // namespace sentree::lsp
