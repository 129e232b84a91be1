#pragma once

#include <algorithm>
#include <string>

#include "sentree/import/import.h"

namespace sentree::import {

/// For tests: what a file holds that an import made, or that there is none.
inline std::string made_file(const Imported& imported, const std::string& name) {
  const auto found = std::find_if(imported.files.begin(), imported.files.end(),
                                  [&](const ProjectFile& file) { return file.path == name; });
  return found != imported.files.end() ? found->content : "there is no " + name;
}

}  // namespace sentree::import
