#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/design/tree_edit.h"

namespace sentree::studio {

/// How long git may take to say what it has, and how much that may be.
inline constexpr int kGitPatience_ms = 20'000;
inline constexpr std::size_t kGitBytesMax = std::size_t{256} << 20U;

/// Texts of a project at one time, by path inside it.
using ProjectTexts = std::map<std::string, std::string>;

/// What `sentree studio --diff` can compare: the texts of a folder, those of the project that a recording (.mcap)
/// holds, or one file; a device as git gives it for a file that is not there is nothing.
/// Errors: file.*, record.*, design.too-many-files.
[[nodiscard]] Result<ProjectTexts> texts_at(const std::filesystem::path& path);

/// The texts of a folder in a commit of the git repository that it is in. Nothing of the repository is executed, and
/// nothing in it changes. Errors: git.failed (no git, no repository, no such commit), git.too-large.
[[nodiscard]] Result<ProjectTexts> texts_of_commit(const std::filesystem::path& folder, const std::string& commit);

/// Two states of a project, or of one file.
struct Sides {
  ProjectTexts before;
  ProjectTexts after;
};

/// Leaves to a folder beside a recording what its run read: what the recording does not hold goes, and what the run had
/// of the interfaces and skills that come with Sentree stands where the project has none of its own.
void keep_what_was_read(const ProjectTexts& recorded, ProjectTexts& folder);

/// The files that differ: [{file, change}], change being "added", "removed" or "changed".
[[nodiscard]] Value changed_files(const Sides& sides);

/// One file of both, as the pages of docs/studio-protocol.md have it. Errors: design.no-such-file.
[[nodiscard]] Result<Value> comparison_of(const Sides& sides, const std::string& file, const design::Kinds& kinds);

}  // namespace sentree::studio
