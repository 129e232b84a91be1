#pragma once

#include "sentree/project/project.h"

namespace sentree::project {

/// Folders inside folders of a project that are looked into.
inline constexpr int kNamedDepthMax = 4;

/// Files in requirements/, monitors/, models/, skills/ and scenarios/ of a project that nothing in it names, so that
/// they do nothing. A file is named by any text of the project (.yaml, .xml, .scxml) in which its name stands, a
/// skill's chart also by its leaf; comments count, so that what is left out on purpose can be written down.
///
/// Warnings: check.unnamed of requirements (with what is wrong with them, as far as they stand in this project),
/// monitors, models and scenarios, and of skills that are called like a built-in node; note: of other skills. Each is
/// told at the file that nothing names. Cost: the files of those five folders are listed; texts are read until each of
/// them has been named.
void check_unnamed(const Project& project, Diagnostics& diagnostics);

}  // namespace sentree::project
