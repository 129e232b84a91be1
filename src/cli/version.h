#pragma once

#include <string>

#include "sentree/base/value.h"

namespace sentree::cli {

/// What this program was made of, for `--version`, reports of errors and recordings of them: version, commit, compiler,
/// and libraries. Shared libraries are those that the process has loaded, by the names of their files.
[[nodiscard]] Value version_facts();
/// The same as lines of text; the first is "sentree 1.2.3".
[[nodiscard]] std::string version_text();

/// The commit of the sources, "+changes" behind it where they differ from it; "unknown" outside of a clone. Found while
/// building (cmake/Commit.cmake).
[[nodiscard]] const char* commit();

}  // namespace sentree::cli
