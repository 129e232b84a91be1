#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "sentree/cli/command_line.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/completion.h"
#include "sentree/cli/manual.h"
#include "sentree/cli/output.h"
#include "sentree/cli/ros_network.h"
#include "sentree/cli/version.h"
#include "sentree/ros/middleware.h"
#include "sentree/rpc/middleware.h"
#include "sentree/yarp/middleware.h"

namespace {

using namespace sentree::cli;

/// What one wants of a help text is an example; the options follow.
class ExamplesFirst final : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    if (mode == CLI::AppFormatMode::Sub || app->get_footer().empty()) return CLI::Formatter::make_help(app, name, mode);
    return fmt::format("{}{}\n\n{}{}{}{}", make_description(app), app->get_footer(), make_usage(app, name),
                       make_positionals(app), make_groups(app, mode), make_subcommands(app, mode));
  }
};

std::vector<std::string> names_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands(nullptr)) names.push_back(sub->get_name());
  return names;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

// The first word that is neither a command nor an option where it stands, with the nearest that is. Empty: no such.
std::string unknown_word(const CLI::App& app, int argc, char** argv) {
  const CLI::App* at = &app;
  std::string of = "sentree";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") return {};
    if (word.size() > 2 && word.starts_with("--")) {
      const std::vector<std::string> known = options_of(*at);
      const std::string name = word.substr(0, word.find('='));
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      return fmt::format("{} has no option {}{}; see {} --help", of, name, sentree::did_you_mean(name, known), of);
    }
    const std::vector<std::string> commands = names_of(*at);
    if (word.starts_with("-") || commands.empty()) continue;
    const auto sub = std::find(commands.begin(), commands.end(), word);
    if (sub != commands.end()) {
      at = at->get_subcommand(word);
      of += " " + word;
    } else if (at == &app) {
      return fmt::format("sentree has no command \"{}\"{}; see sentree --help", word,
                         sentree::did_you_mean(word, commands));
    }
  }
  return {};
}

int command_line(int argc, char** argv) {
  CLI::App app{"Sentree: design, execute, monitor and verify robot behaviours", "sentree"};
  app.set_version_flag("--version", version_text, "Print version, commit, compiler and libraries, and exit");
  app.require_subcommand(1);
  app.formatter(std::make_shared<ExamplesFirst>());
  Commands commands;
  for (const auto add :
       {add_project_commands, add_run_commands, add_file_commands, add_service_commands, add_machine_commands})
    add(app, commands);
  if (argc > 1 && std::string_view(argv[1]) == "__complete") {
    print(to_lines(complete(app, {argv + 2, argv + argc})));
    return kOk;
  }
  if (argc == 3 && std::string_view(argv[1]) == "__manual") return write_manual(app, argv[2]);
  if (argc == 1) {
    print(app.help());
    return kOk;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are answers, not errors.
    const bool answer = error.get_exit_code() == 0;
    if (const std::string unknown = answer ? std::string() : unknown_word(app, argc, argv); !unknown.empty()) {
      say(unknown);
      return kUsage;
    }
    std::ostringstream out;
    const int code = app.exit(error, out, std::cerr);
    if (answer) print(out.str());
    return code == 0 ? kOk : kUsage;
  }
  const auto named =
      std::find_if(commands.begin(), commands.end(), [](const Command& one) { return one.app->parsed(); });
  return named->work();  // one is required
}

}  // namespace

int main(int argc, char** argv) {
  sentree::rpc::register_middleware(sentree::yarp::make_middleware());
  sentree::rpc::register_middleware(sentree::ros::make_middleware(
      {.find = sentree::cli::ros_interface, .warn = [](const std::string& what) { sentree::cli::say("! " + what); }}));
  return finished(command_line(argc, argv));
}
