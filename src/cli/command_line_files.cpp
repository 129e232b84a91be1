#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"

// Single files.

namespace sentree::cli {

namespace {

void add_graph(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("graph", "Draw a tree, a state chart, or a world with its robots");
  GraphCommand& command = options_for<GraphCommand>(sub, commands, graph);
  sub->footer(
      "Examples:\n"
      "  sentree graph examples/recharge -o mission.svg\n"
      "  sentree graph examples/recharge/skills/GoToLocation.scxml --to mermaid\n"
      "  sentree graph trees/ --tree Docking -o docking.svg       SubTrees of all files below the folder\n"
      "  sentree graph examples/recharge/world/world.yaml -o house.png\n"
      "  sentree graph examples/recharge/world/world.yaml --goto kitchen --after '20 s' -o on-its-way.svg");
  sub->add_option(
         "file", command.files,
         "Project, state chart (.scxml), world (.yaml), or trees (.xml) and folders of trees that belong together")
      ->required();
  add_trees(*sub, command.trees);
  sub->add_option("--to", command.format, "Default: by the ending of the output, else svg")
      ->check(CLI::IsMember({"svg", "png", "dot", "mermaid", "plantuml"}));
  sub->add_option("--output,-o", command.output, "Default: standard output");
  sub->add_option("--tree", command.tree, "Which BehaviorTree");
  sub->add_option("--direction", command.direction, "Of a tree: down, or right, which suits wide ones; auto chooses")
      ->check(CLI::IsMember({"auto", "down", "right"}))
      ->capture_default_str();
  sub->add_option("--goto", command.stops, "World: send a robot there first, PLACE or ROBOT=PLACE");
  sub->add_option("--after", command.after, "World: simulated time at which it is drawn, e.g. 20 s");
  sub->add_option("--seed", command.seed, "World: of all that is random")->check(whole_number(0));
}

void add_fmt(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("fmt", "Write trees and state charts in canonical form");
  FmtCommand& command = options_for<FmtCommand>(sub, commands, sentree::cli::fmt);
  sub->footer(
      "Examples:\n"
      "  sentree fmt mission.xml skills/GoTo.scxml   rewrites them in place, and says which it changed\n"
      "  sentree fmt examples/recharge               every tree and chart below a folder\n"
      "  sentree fmt --check .                       changes nothing, lists what is not in form\n"
      "  sentree fmt - <mission.xml                  from standard input to standard output\n"
      "Comments, unknown attributes and the order of nodes stay. Exit code: 0, with --check 1 if a file would change,\n"
      "3 a file is not readable as XML, 4 one cannot be written.");
  sub->add_option("file", command.files, "Trees (.xml), charts (.scxml), folders; - for standard input")->required();
  add_trees(*sub, command.trees);
  sub->add_flag("--check", command.check, "Change nothing, list what is not in canonical form");
  sub->add_flag("--json", command.json, "Print which files change (with -, instead of the formatted text)");
}

void add_diff(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("diff", "Say how two trees, or two state charts, differ in meaning");
  DiffCommand& command = options_for<DiffCommand>(sub, commands, diff);
  sub->footer(
      "Examples:\n"
      "  sentree diff old.xml new.xml\n"
      "  sentree diff release/trees trees          folders: file by file\n"
      "  sentree diff skills/GoTo.scxml ~/other/GoTo.scxml\n"
      "  git show HEAD:mission.xml | sentree diff - mission.xml\n"
      "  git difftool --no-prompt --extcmd 'sentree diff' -- mission.xml\n"
      "Nodes, states, transitions, content and data added, removed, moved and changed; white space, comments, the "
      "order\n"
      "of attributes and the layout of editors do not count. A file is told by its root element, whatever its name.\n"
      "Exit code: 0 the same, 1 different, 3 not readable.");
  sub->add_option("before", command.before, "Tree, state chart, folder, or - for standard input")->required();
  sub->add_option("after", command.after, "Tree, state chart, folder, or - for standard input")->required();
  add_trees(*sub, command.trees);
  sub->add_flag("--json", command.json, "Print the differences as JSON");
}

void add_model(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("model", "Describe a project's skills for the palette of a tree editor");
  ModelCommand& command = options_for<ModelCommand>(sub, commands, model);
  sub->footer(
      "Examples:\n"
      "  sentree model my_robot -o skills_model.xml               to be imported in Groot\n"
      "  sentree model my_robot --into my_robot/mission.xml       the TreeNodesModel that the mission itself has\n"
      "  sentree model trees/ --palette nodes.xml                 what nodes the trees of somebody else use\n"
      "Ports come from the charts: top-level <data> without a value are inputs, <donedata> are outputs.");
  sub->add_option(
      "project", command.files,
      "Folder with a sentree.yaml; or trees, and folders of trees, with skills/ beside the first. Default: .");
  add_trees(*sub, command.trees);
  auto* output = sub->add_option("--output,-o", command.output, "Default: standard output");
  sub->add_option("--into", command.into, "Bring the TreeNodesModel of this tree up to date; all else stays")
      ->excludes(output);
  sub->add_flag("--json", command.json, "Print the models as JSON");
}

void add_chart(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("chart", "Run one state chart by hand: type events, look inside, step back");
  ChartCommand& command = options_for<ChartCommand>(sub, commands, chart);
  sub->footer(
      "Examples:\n"
      "  sentree chart examples/recharge/skills/BatteryLevelAbove.scxml --data threshold=30\n"
      "  printf 'tick\\nwait 2s\\nstate\\n' | sentree chart examples/recharge/skills/WaitForUser.scxml\n"
      "Type help for the commands. Exit code: 0, or 1 if a command of a script failed, 3 invalid chart.");
  sub->add_option("file", command.file, "State chart (.scxml)")->required();
  sub->add_option("--data,-d", command.data, "NAME=VALUE: initial value of a <data>");
  sub->add_option("--seed", command.seed, "Of Math.random")->check(whole_number(0))->capture_default_str();
  sub->add_option("--script-max", command.script_max, "Processor time that one command may take")
      ->capture_default_str();
  sub->add_flag("--json", command.json, "Answer each command with one line of JSON");
}

}  // namespace

void add_file_commands(CLI::App& app, Commands& commands) {
  add_graph(app, commands);
  add_fmt(app, commands);
  add_diff(app, commands);
  add_model(app, commands);
  add_chart(app, commands);
}

}  // namespace sentree::cli
