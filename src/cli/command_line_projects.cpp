#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "sentree/cli/commands.h"
#include "sentree/cli/import_command.h"
#include "sentree/cli/output.h"

// Projects: what begins, extends and checks them.

namespace sentree::cli {

namespace {

void add_init(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("init", "Start a new project: small, and it runs");
  InitCommand& command = options_for<InitCommand>(sub, commands, init);
  sub->footer("Example:\n  sentree init my_robot && sentree run my_robot --clock virtual");
  sub->add_option("folder", command.folder)->required();
}

void add_add(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("add", "Add a part to a project: files to begin with, and what sentree.yaml needs");
  AddCommand& command = options_for<AddCommand>(sub, commands, add);
  sub->footer(
      "Examples:\n"
      "  sentree add skill FetchCup                     skills/FetchCup.scxml\n"
      "  sentree add monitor one_at_a_time              a state chart that watches\n"
      "  sentree add requirement answers                a sentence that becomes a monitor\n"
      "  sentree add scenario door_closed               what happens, and what to expect\n"
      "  sentree add component gripper --project robot  an interface, and a chart that stands in for it\n"
      "What is there already is never written over. Exit code: 0, 3 the project is invalid or has such a part.");
  sub->add_option("kind", command.kind, "skill, monitor, requirement, scenario or component")
      ->required()
      ->check(CLI::IsMember({"skill", "monitor", "requirement", "scenario", "component"}));
  sub->add_option("name", command.name, "Letters, digits and _")->required();
  sub->add_option("--project", command.project, "Folder with a sentree.yaml")->capture_default_str();
}

void add_import(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("import", "Make a project of somebody else's system");
  ImportCommand& command = options_for<ImportCommand>(sub, commands, import_project);
  sub->footer(
      "Examples:\n"
      "  sentree import main_tree.xml -o my_robot           a mission of BehaviorTree.CPP: its leaves get skills\n"
      "  sentree import ~/bt-implementation -o my_robot     Behavior Trees, Qt SCXML skills with C++ snippets, YARP\n"
      "  sentree import museum/main.xml -o museum_project   an AS2FM system; or its folder, if files lie beside "
      "main.xml\n"
      "  sentree import museum --main Main/main.xml -o museum_project\n"
      "What has no counterpart stays as a comment at its place, and is listed here and in IMPORT.md with file and "
      "line.\n"
      "Exit code: 0 everything was translated, 1 something is left to do by hand, 3 no such system, or the output is\n"
      "not empty, 4 it cannot be written.");
  sub->add_option("system", command.system, "Folder of the system, or its main file")->required();
  sub->add_option("--output,-o", command.output, "Folder of the new project")->required();
  sub->add_option("--main", command.main, "Of a folder with several systems: the main file");
  sub->add_flag(
      "--force", command.force,
      "Replace files of the same names in a folder that is not empty, but for those that have been edited since");
  sub->add_flag("--json", command.json, "Print files and findings as JSON");
}

void add_check(CLI::App& app, Commands& commands) {
  auto* sub =
      app.add_subcommand("check", "Find everything that is wrong with a project or with files, without running them");
  CheckCommand& command = options_for<CheckCommand>(sub, commands, check);
  sub->footer(
      "Examples:\n"
      "  sentree check examples/recharge                     the project and all its scenarios\n"
      "  sentree check examples/recharge/mission.xml         a tree, as far as it stands alone\n"
      "  sentree check trees/ vendor/docking.xml             trees and charts; SubTrees are found in each other's "
      "files\n"
      "  sentree check --palette nodes.xml trees/            what nodes are that the trees do not declare\n"
      "  sentree check examples/recharge/skills/WaitForUser.scxml    a chart, also of other engines and data models\n"
      "  sentree check examples/recharge/world/world.yaml\n"
      "  sentree check interfaces/robot.thrift               an interface with what it includes\n"
      "  sentree check examples/recharge/requirements/recharge.req    against the project that it lies in\n"
      "What a tree alone lacks (a SubTree, an <include>, a node that nobody declares) is a warning; in a project, "
      "which\n"
      "must run, an error. Exit code: 0 nothing, 1 warnings, 3 errors.");
  sub->add_option(
      "project", command.files,
      "Folder with a sentree.yaml; tree, chart, requirement, interface, scenario or world files; folders of "
      "trees and charts. Default: .");
  add_trees(*sub, command.trees);
  sub->add_flag("--json", command.json, "Print the findings as JSON");
}

}  // namespace

void add_project_commands(CLI::App& app, Commands& commands) {
  add_init(app, commands);
  add_add(app, commands);
  add_import(app, commands);
  add_check(app, commands);
}

}  // namespace sentree::cli
