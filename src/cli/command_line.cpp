#include "sentree/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>

#include "sentree/base/shown.h"
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

CLI::Option* add_allow_plugins(CLI::App& sub, replay::RecordedCode& code) {
  return sub.add_flag_callback(
      "--allow-plugins", [&code] { code = replay::RecordedCode::kLoaded; },
      "Load the plug-ins that this recording brings: their code runs with your rights");
}

CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
  const auto refusal = [least, most](std::string& text) {
    std::int64_t number = 0;
    const char* const end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, number);
    if (error == std::errc() && stopped == end && number >= least && number <= most) return std::string();
    return fmt::format("{} is no whole number from {} to {}", shown_in_short(text), least, most);
  };
  return {refusal, least > 0 ? "POSITIVE" : "NONNEGATIVE"};
}

}  // namespace sentree::cli
