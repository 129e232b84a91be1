#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>

#include "sentree/cli/commands.h"

namespace sentree::cli {

void add_trees(CLI::App& sub, TreeOptions& options) {
  sub.add_option("--palette", options.palettes, "Trees: a file whose TreeNodesModel says what nodes are; several times")
      ->type_name("FILE")
      ->allow_extra_args(false);
  sub.add_option("--packages", options.packages,
                 "Trees: a folder with ROS packages, for <include ros_pkg=…>; beside $AMENT_PREFIX_PATH")
      ->type_name("FOLDER")
      ->allow_extra_args(false);
}

CLI::Option* add_allow_plugins(CLI::App& sub, bool& allowed) {
  return sub.add_flag("--allow-plugins", allowed,
                      "Load the plug-ins that this recording brings: their code runs with your rights");
}

}  // namespace sentree::cli
