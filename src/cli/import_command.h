#pragma once

#include <string>

namespace sentree::cli {

struct ImportCommand {
  std::string system;  ///< Folder, or the main file of an AS2FM system.
  std::string main;    ///< Which main file of the folder.
  std::string output;
  bool force = false;
  bool json = false;
};
int import_project(const ImportCommand& command);

}  // namespace sentree::cli
