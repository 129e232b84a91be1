#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/palette.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// Bounds of what a file may ask for; a file beyond them is refused with bt.too-large or bt.too-deep.
inline constexpr std::size_t kNodesMax = 4'000'000;          ///< After expanding SubTrees.
inline constexpr std::size_t kDepthMax = 4'000;              ///< Nodes inside nodes, SubTrees expanded.
inline constexpr std::size_t kIncludesMax = 1'000;           ///< Files read through <include>, all together.
inline constexpr std::size_t kIncludeDepthMax = 64;          ///< Files that include files.
inline constexpr std::size_t kIncludeBytesMax = 64U << 20U;  ///< Included files together; also the main file alone.
inline constexpr std::size_t kPortBytesMax = 1U << 20U;      ///< The text of one port.
inline constexpr std::size_t kFindingsMax = 10'000;          ///< More problems of one load are not listed.

/// Replaces nodes when the tree is made, e.g. by something that needs no robot.
struct Substitution {
  std::string filter;  ///< Path with '/' or '.', or registration ID; '*' and '?' as in a shell.
  std::string id;      ///< Registration ID to use instead; or, if empty, `test`:
  struct TestNode {
    Status return_status = Status::kSuccess;
    std::string return_status_script;  ///< Its value gives the status; wins over `return_status`.
    Duration async_delay{0};           ///< RUNNING for that long first.
    std::string success_script, failure_script, post_script;
    std::function<Status()> complete;  ///< Called for the status when given.
  } test;
};

/// Reads the rules of BehaviorTree.CPP's JSON: {"TestNodeConfigs": {…}, "SubstitutionRules": {…}}.
[[nodiscard]] Result<std::vector<Substitution>> parse_substitutions(std::string_view json,
                                                                    const std::string& file = {});

/// An entry of the main tree's blackboard that is there before the first tick, as one that a script has written.
struct StartEntry {
  std::string name;
  Value value;
  SourceSpan span;  ///< Where it is given.
};

struct LoadOptions {
  /// C++ nodes and script enums; null: only what is built in.
  const Registry* registry = nullptr;
  /// Nodes that other files describe; null: none. What a tree's own files say goes before.
  const Palette* palette = nullptr;
  /// The tree is looked at, not run, and may be a part of something that is not here: SubTrees, includes and nodes that
  /// nobody declares are warnings, and `Tree::is_unknown` where they have no meaning of their own.
  bool partial = false;
  /// Which BehaviorTree to run; empty: `main_tree_to_execute`, else the only one.
  std::string main_tree;
  /// Whether somebody can run the external leaf of that ID and name. Null: every declared leaf is accepted.
  std::function<bool(std::string_view id, std::string_view name)> has_skill;
  /// IDs and names that `has_skill` knows, for "did you mean".
  std::vector<std::string> skills;
  /// What the external leaf of that ID and name is, where no file declares it; nothing: nobody knows. Null: the same.
  std::function<std::optional<Category>(std::string_view id, std::string_view name)> skill_kind;
  /// The file with the BehaviorTree of that ID, for one that is in none of the files read so far; nothing: there is
  /// none. It is read by `read_file`, as if it were included. Null: nothing.
  std::function<std::optional<std::filesystem::path>(std::string_view id)> find_tree;
  /// Behind the message that there is no BehaviorTree of that ID: where there is one, "; trees/charge.xml has it; …",
  /// or nothing. Null: nothing.
  std::function<std::string(std::string_view id)> where_tree;
  /// Errors: bt.entry-type, where ports have the entry as another type. Warnings: bt.unused-entry.
  std::vector<StartEntry> entries;
  /// Reads an included file by the path as resolved against the including file. Null: <include> is refused.
  std::function<Result<std::string>(const std::filesystem::path&)> read_file;
  /// Where a ROS package is, for <include ros_pkg=…>; null: refused.
  std::function<Result<std::filesystem::path>(std::string_view package)> find_package;
  std::vector<Substitution> substitutions;
};

/// Looks a ROS package up in folders: those given, then $AMENT_PREFIX_PATH and $ROS_PACKAGE_PATH. Of a folder F, the
/// package P is F/share/P or F/P. For `LoadOptions::find_package`. Error: bt.no-package, with the paths tried.
[[nodiscard]] Result<std::filesystem::path> find_ros_package(std::string_view package,
                                                             const std::vector<std::filesystem::path>& folders = {});

/// Reads, checks and compiles a tree. Reports every problem at once, in the order of the file.
///
/// A file that describes nodes and has no tree is no error where the tree is only looked at: there is a note bt.palette
/// and no value.
///
/// @param file  Name for messages, and what includes are relative to.
/// Codes: xml.*, bt.* (docs/bt.md lists them).
[[nodiscard]] Loaded<Tree> load(std::string xml, const LoadOptions& options = {}, const std::string& file = {});

/// The same from a file; includes are read from the file system, those of ROS packages through `find_ros_package`.
[[nodiscard]] Loaded<Tree> load_file(const std::filesystem::path& path, LoadOptions options = {});

}  // namespace sentree::bt
