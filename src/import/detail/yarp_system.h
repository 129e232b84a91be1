#pragma once

#include "sentree/import/detail/source_folder.h"
#include "sentree/import/import.h"

namespace sentree::import {

/// Whether the folder holds Qt SCXML charts with C++ in them.
[[nodiscard]] bool holds_yarp_skills(const SourceFolder& folder);

/// A system of Behavior Trees in XML, skills as Qt SCXML charts with C++ snippets, files of options (`conf/*.ini`),
/// applications of yarpmanager, and Thrift interfaces, as a Sentree project.
[[nodiscard]] Loaded<Imported> import_yarp_skills(const SourceFolder& folder);

}  // namespace sentree::import
