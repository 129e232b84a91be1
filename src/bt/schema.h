#pragma once

#include <string>
#include <vector>

#include "sentree/bt/write.h"

namespace sentree::bt {

/// An XML schema (XSD 1.0) of files of format 4 that use these nodes, for editors that complete and check while one
/// types: `write_schema(models(registry, true))`. What a schema cannot say (whether a script compiles, whether a
/// SubTree exists) is what `load` is for.
[[nodiscard]] std::string write_schema(const std::vector<NodeModel>& models);

}  // namespace sentree::bt
