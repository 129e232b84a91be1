#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/library.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/cli/commands.h"
#include "sentree/project/project.h"

namespace sentree::cli {

/// Files that one command looks at, at most.
inline constexpr std::size_t kGivenFilesMax = 20'000;
/// Files and folders of any kind below one that is given, that are looked at.
inline constexpr std::size_t kGivenEntriesMax = 400'000;

struct GivenFile {
  std::filesystem::path path;
  bool named = true;  ///< By the user; else found in a folder, where not every .xml is a tree.
};

/// Nothing, or that a file is neither a tree nor a chart by its ending, and which command takes it: cli.other-kind.
[[nodiscard]] std::optional<Diagnostic> other_kind(const std::filesystem::path& file);

/// The files that a command line names. A folder stands for the .xml and .scxml files below it, hidden ones left out,
/// sorted. Errors: file.not-found, file.unreadable, cli.too-many-files, cli.other-kind.
[[nodiscard]] std::vector<GivenFile> given_files(const std::vector<std::string>& names, Diagnostics& problems);

/// "tree" or "chart" by the root element; empty for any other document, also one that is not well-formed.
[[nodiscard]] std::string document_kind(const std::string& xml);

/// Whether XML can be read, whatever it is about.
[[nodiscard]] bool is_well_formed(const std::string& xml);

/// A palette of the command line for a project, whose own paths are relative to its folder.
[[nodiscard]] project::FileRef palette_file(const std::string& palette);

/// Trees that are looked at together, with the palettes and packages that the command line names.
class TreeFiles {
 public:
  /// Reads the palettes, and those of the files that are trees. What is wrong with a palette goes to `problems`; what
  /// is wrong with a tree is told by `load`.
  TreeFiles(const std::vector<GivenFile>& files, const TreeOptions& options, Diagnostics& problems);
  TreeFiles(const TreeFiles&) = delete;
  TreeFiles& operator=(const TreeFiles&) = delete;

  [[nodiscard]] const bt::Library& library() const { return library_; }
  /// The tree as it can be looked at: what is missing is told, and is no error.
  [[nodiscard]] Loaded<bt::Tree> load(const std::filesystem::path& file, const std::string& tree = {}) const;

 private:
  bt::Registry registry_;
  bt::Library library_;
  std::vector<std::filesystem::path> packages_;
};

}  // namespace sentree::cli
