#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::import {

/// Files that a system may have, folders inside folders, and bytes of one file. What is larger is refused.
inline constexpr std::size_t kFilesMax = 20'000;
inline constexpr int kFolderDepthMax = 32;
inline constexpr std::size_t kFileBytesMax = 4U << 20U;
/// Statements inside statements of a C++ snippet, and elements inside elements of a chart.
inline constexpr int kNestingMax = 64;

/// What became of a place of the original that is not simply the same in the new project.
enum class Fate {
  kByHand,     ///< Has no counterpart; it stands as a comment at its place, and somebody must decide.
  kReview,     ///< Translated with an assumption that a person should confirm.
  kNotNeeded,  ///< Left out, because Sentree does it by itself.
};

struct Finding {
  Fate fate = Fate::kByHand;
  SourceSpan span;       ///< In the original.
  std::string original;  ///< As written, shortened to one line; may be empty.
  std::string reason;    ///< Why, and the way out.
};

struct ProjectFile {
  std::string path;  ///< Relative to the project's folder.
  std::string content;
};

/// Forms of systems.
inline constexpr const char* kTreeForm = "behavior-tree";

/// A Sentree project made of somebody else's system; nothing has been written yet.
struct Imported {
  std::string form;  ///< "yarp-skills", "as2fm" or "behavior-tree".
  std::vector<ProjectFile> files;
  std::vector<Finding> findings;  ///< By file and line.
  /// IDs of nodes of the tree that only a plug-in can give it: until then it does not run.
  std::vector<std::string> plug_in_nodes;
};

/// Reads a system: the mission of a BehaviorTree.CPP program, a folder with Behavior Trees and Qt SCXML skills with C++
/// snippets, or an AS2FM system; the first and the last by the folder or the main file. Of a folder with several main
/// files, `main` (a path inside it) says which. Only what lies in the folder (of a main file: its own) is read; links
/// are not followed.
///
/// Errors: import.unknown-form, import.ambiguous, import.too-large, import.outside (an <include> of what is not read,
/// with the call that reads it), and those of the files without which there is no
/// system. What is wrong with one part is a finding, not an error. The same input gives the same files.
[[nodiscard]] Loaded<Imported> import_system(const std::filesystem::path& path, const std::string& main = {});

/// Writes the files and IMPORT.md below `folder`. Unless `force`, a folder that is not empty is an error,
/// import.exists; with it, files of the same names are replaced and no other is touched, nor one that has been edited
/// since it was imported (IMPORT.md has a sum of each; where it has none, skills that differ count as edited). Those
/// are given back. Error: file.unwritable.
[[nodiscard]] Result<std::vector<std::string>> write_project(const Imported& imported,
                                                             const std::filesystem::path& folder, bool force);

/// The text of IMPORT.md: what was made of what, and what is left to do, with places.
[[nodiscard]] std::string report_of(const Imported& imported, const std::string& name);

[[nodiscard]] std::string_view to_string(Fate fate);  ///< "by hand", "review", "not needed".

}  // namespace sentree::import
