#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
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
[[nodiscard]] Result<std::vector<Substitution>> parse_substitutions(std::string_view json, std::string file = {});

struct LoadOptions {
  /// C++ nodes and script enums; null: only what is built in.
  const Registry* registry = nullptr;
  /// Which BehaviorTree to run; empty: `main_tree_to_execute`, else the only one.
  std::string main_tree;
  /// Whether somebody can run the external leaf of that ID and name. Null: every declared leaf is accepted.
  std::function<bool(std::string_view id, std::string_view name)> has_skill;
  /// IDs and names that `has_skill` knows, for "did you mean".
  std::vector<std::string> skills;
  /// Reads an included file by the path as resolved against the including file. Null: <include> is refused.
  std::function<Result<std::string>(const std::filesystem::path&)> read_file;
  /// Where a ROS package is, for <include ros_pkg=…>; null: refused.
  std::function<Result<std::filesystem::path>(std::string_view package)> find_package;
  std::vector<Substitution> substitutions;
};

/// Reads, checks and compiles a tree. Reports every problem at once, in the order of the file.
///
/// @param file  Name for messages, and what includes are relative to.
/// Codes: xml.*, bt.* (docs/bt.md lists them).
[[nodiscard]] Loaded<Tree> load(std::string xml, const LoadOptions& options = {}, std::string file = {});

/// The same from a file; includes are read from the file system.
[[nodiscard]] Loaded<Tree> load_file(const std::filesystem::path& path, LoadOptions options = {});

}  // namespace sentree::bt
