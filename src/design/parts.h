#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/plan.h"

namespace sentree::design {

/// A part as it comes into a project: files, and entries of sentree.yaml.
struct Part {
  std::vector<std::pair<std::string, std::string>> files;    ///< Path inside the project, and text.
  std::vector<std::pair<std::string, std::string>> entries;  ///< Section and line.
  std::string next;  ///< What to do with it; {project} and {mission} stand for their names.
};

inline constexpr const char* kPartKinds[] = {"skill", "monitor", "requirement", "scenario", "component"};

/// A part that runs as it is, to begin with. It calls nothing: of calls, one of `plan` if it has any, a skill has a
/// comment. Null: the project does not load.
/// Errors: design.bad-name (letters, digits and _, with a letter first), design.name-taken (in `plan`),
/// design.no-such-part.
[[nodiscard]] Result<Part> new_part(const std::string& kind, const std::string& name, const project::Plan* plan);

/// Writes a small project that runs into a folder, which is made if it is missing; the files, inside the folder.
/// Errors: design.not-empty (there is anything but .git and .sentree), design.not-installed, file.*.
[[nodiscard]] Result<std::vector<std::filesystem::path>> begin_project(const std::filesystem::path& folder);

}  // namespace sentree::design
