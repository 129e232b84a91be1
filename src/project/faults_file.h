#pragma once

#include <filesystem>

#include "sentree/base/diagnostic.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// Reads a file that is written as `faults:` of `verify:` in a sentree.yaml, into a section whose faults it replaces:
/// `{at_most: 1, any_of: [{kill: GoToKitchen}]}`, alone or below `faults:`. What its entries name is checked with the
/// project, as always.
void read_faults(const std::filesystem::path& file, VerifySection& verify, Diagnostics& diagnostics);

}  // namespace sentree::project
