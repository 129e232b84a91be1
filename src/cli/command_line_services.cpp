#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"

// Services of others, and parts of missions in processes of their own.

namespace sentree::cli {

namespace {

void add_call(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("call", "Call a service of a running mission, or of any address");
  CallCommand& command = options_for<CallCommand>(sub, commands, call);
  sub->footer(
      "Examples:\n"
      "  sentree call                                          what the running mission offers\n"
      "  sentree call battery getBatteryState\n"
      "  sentree call simulation setBatteryCharge percent=10   experiment 1, by hand\n"
      "  sentree call tcp://127.0.0.1:9090/battery getBatteryState --interface robot.thrift/Battery\n"
      "  sentree call ros:/spin send_goal target_yaw=1.57 --interface nav2_msgs/action/Spin\n"
      "A goal of an action is waited for, as ros2 action send_goal does: its result is shown, and Ctrl-C cancels it.");
  sub->add_option("service", command.service, "Name in the running mission, or an address");
  sub->add_option("method", command.method);
  sub->add_option("arguments", command.arguments, "name=value …, or one JSON object");
  sub->add_option("--interface", command.interface, "FILE.thrift/SERVICE, when calling an address");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(whole_number(1));
  sub->add_option("--deadline", command.deadline, "Until there is an answer; a goal of an action may take longer")
      ->capture_default_str();
  sub->add_flag("--feedback", command.feedback, "Show the feedback of the goal that is sent to an action");
}

void add_services(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("services", "List the services of a running mission");
  ServicesCommand& command = options_for<ServicesCommand>(sub, commands, services);
  sub->footer(
      "Examples:\n"
      "  sentree services\n"
      "  sentree services --on yarp:        the ports that the name server of YARP knows\n"
      "  sentree services --on ros:         topics, services and actions of ROS 2");
  sub->add_option("--on", command.on, "A network instead of a run: yarp: or ros:, or yarp:/robot for what is named so");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(whole_number(1));
  sub->add_flag("--json", command.json, "Print the list as JSON");
}

void add_ping(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("ping", "Ask whether a running mission, its services, or an address answer");
  PingCommand& command = options_for<PingCommand>(sub, commands, ping);
  sub->footer(
      "Examples:\n"
      "  sentree ping                                  the run and every service elsewhere\n"
      "  sentree ping navigation\n"
      "  sentree ping tcp://127.0.0.1:9090/battery\n"
      "  sentree ping yarp:/battery/rpc:i\n"
      "Exit code: 0 all answer, 4 one does not.");
  sub->add_option("target", command.target, "Service or address; default: all");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(whole_number(1));
  sub->add_flag("--json", command.json, "Print the round trips as JSON");
}

void add_echo(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("echo", "Show the observations of a running mission as they come");
  EchoCommand& command = options_for<EchoCommand>(sub, commands, echo);
  sub->footer(
      "Examples:\n"
      "  sentree echo\n"
      "  sentree echo 'battery.*'\n"
      "  sentree echo yarp:/battery/state:o            what a port of YARP sends\n"
      "  sentree echo ros:/battery_state               what is published on a topic of ROS 2\n"
      "  sentree echo '*.tick.reply' --json -n 10");
  sub->add_option("pattern", command.pattern, "Of names; * stands for any characters")->capture_default_str();
  sub->add_option("--count,-n", command.count, "End after so many");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(whole_number(1));
  sub->add_flag("--json", command.json, "A line of JSON for each");
}

void add_skill(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("skill", "Run one skill in a process of its own");
  SkillCommand& command = options_for<SkillCommand>(sub, commands, skill);
  sub->footer(
      "Example:\n"
      "  sentree skill examples/recharge GoToLocation --listen unix:/tmp/goto.sock --at "
      "navigation=tcp://127.0.0.1:9090");
  sub->add_option("project", command.project)->required();
  sub->add_option("leaf", command.leaf, "ID or name of the leaves that it runs")->required();
  sub->add_option("--listen", command.listen, "unix:PATH, tcp:// or tls://HOST:PORT (port 0: any), yarp:/PORT")
      ->required();
  sub->add_option("--of-run", command.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  sub->add_option("--observer", command.observer, "Where the run listens for what is observed here");
  sub->add_option("--at", command.at, "SERVICE=ADDRESS, instead of what sentree.yaml says");
  sub->add_option("--factor", command.factor, "Run seconds per wall second")->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed)->check(whole_number(0));
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

void add_monitor(CLI::App& app, Commands& commands) {
  struct Wanted {
    MonitorServeCommand serve;
    MonitorCheckCommand check;
    SynthCommand synth;
  };
  const auto kept = std::make_shared<Wanted>();
  auto* sub = app.add_subcommand("monitor",
                                 "Make monitors of requirements; check a recording; run one in a process of its own");
  sub->footer(
      "Examples:\n"
      "  sentree monitor synth examples/recharge/requirements/recharge.req -o charts\n"
      "  sentree monitor check RUN.mcap --req requirements/new.req\n"
      "  sentree monitor check RUN.mcap --monitor monitors/battery.scxml --violated failure\n"
      "  sentree monitor --project examples/recharge --name battery --listen unix:/tmp/battery.sock");
  auto* synth = sub->add_subcommand("synth", "Write one state chart for each requirement of a .req file");
  synth->footer(
      "Example:\n  sentree monitor synth examples/requirements/requirements/twelve.req -o charts\n"
      "The language is in docs/requirements.md. Exit code: 3 for what is wrong with the requirements.");
  synth->add_option("file", kept->synth.file, "Requirements (.req)")->required();
  synth->add_option("--output,-o", kept->synth.output, "Folder for the charts, NAME.scxml each")->required();
  synth->add_option("--project", kept->synth.project,
                    "Whose services, leaves and units they are about (default: the sentree.yaml above the file)");
  sub->add_option("--project", kept->serve.project, "Project or scenario");
  sub->add_option("--name", kept->serve.name, "Which of its monitors");
  sub->add_option("--listen", kept->serve.listen, "unix:PATH, tcp://HOST:PORT (port 0: any)");
  sub->add_option("--of-run", kept->serve.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  auto* on = sub->add_subcommand("check", "Say what monitors make of a recording");
  on->footer(
      "Examples:\n"
      "  sentree monitor check runs/recharge-20260102-101500.mcap\n"
      "  sentree monitor check RUN.mcap --project my_robot\n"
      "  sentree monitor check RUN.mcap --monitor monitors/battery.scxml --violated failure\n"
      "Exit code: 0 none is violated, 1 one is, 3 not a recording.");
  on->add_option("recording", kept->check.file, "MCAP file of sentree run")->required();
  on->add_option("--project", kept->check.project, "Its monitors, instead of the recorded project's");
  on->add_option("--monitor", kept->check.monitors, "Charts, instead of a project's monitors");
  on->add_option("--req", kept->check.requirements, "Requirement files, instead of a project's monitors");
  on->add_option("--violated", kept->check.violated, "States of the charts whose entry is a violation");
  on->add_flag("--json", kept->check.json, "Print verdicts and witnesses as JSON");
  add_allow_plugins(*on, kept->check.recorded_code);
  sub->add_flag("--insecure", kept->serve.insecure, "Allow other machines to connect without TLS");
  commands.push_back({synth, [kept] { return monitor_synth(kept->synth); }});
  commands.push_back({on, [kept] { return monitor_check(kept->check); }});
  commands.push_back({sub, [kept] {
                        const MonitorServeCommand& serve = kept->serve;
                        if (!serve.project.empty() && !serve.name.empty() && !serve.listen.empty())
                          return monitor_serve(serve);
                        say("sentree monitor needs --project, --name and --listen, or the subcommand check or synth");
                        return kUsage;
                      }});
}

void add_component(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("component", "Serve a component from a process of its own");
  ComponentCommand& command = options_for<ComponentCommand>(sub, commands, component);
  sub->footer(
      "Example:\n  sentree component sim --world examples/recharge/world/world.yaml --listen tcp://127.0.0.1:9090");
  sub->add_option("name", command.name, "sim: the simulated robot")->required();
  sub->add_option("--project", command.project, "Project or scenario whose simulated services to serve");
  sub->add_option("--world", command.world, "World file; all services are served");
  sub->add_option("--listen", command.listen,
                  "unix:PATH, tcp:// or tls://HOST:PORT (port 0: any), yarp:/PREFIX/, ros:/PREFIX/")
      ->required();
  sub->add_option("--of-run", command.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  sub->add_option("--factor", command.factor, "Run seconds per wall second")->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed)->check(whole_number(0));
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

void add_sim(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("sim", "Run the simulated robot alone, and show it");
  SimCommand& command = options_for<SimCommand>(sub, commands, sim);
  sub->footer(
      "Examples:\n"
      "  sentree sim --world examples/recharge/world/world.yaml        then, in another terminal:\n"
      "    sentree call navigation gotoTargetByLocationName name=kitchen\n"
      "    sentree call simulation setPaused paused=true\n"
      "    sentree call simulation step seconds=10\n"
      "  sentree sim --world W.yaml --speed 20 --goto kitchen --goto station\n"
      "  sentree sim --world W.yaml --speed 0 --goto kitchen --json    as fast as the machine allows\n"
      "  sentree sim --world W.yaml --at tcp://127.0.0.1:9090          also for other programs\n"
      "  sentree sim --world W.yaml --yarp                             as ports of YARP: /battery/rpc:i ...\n"
      "  sentree sim --world W.yaml --ros                              in ROS 2: /battery/getBatteryState ...\n"
      "Exit code: 0 ok, 1 a place was not reached, 3 invalid world, 4 environment (port taken), 130 interrupted\n"
      "before --duration was over.");
  sub->add_option("--world", command.world, "World file")->required();
  sub->add_option("--at", command.at,
                  "Serve it here too: unix:PATH, tcp://HOST:PORT (port 0: any), yarp:/PREFIX/, ros:/PREFIX/");
  sub->add_flag("--yarp", command.yarp,
                "Serve it as ports of YARP, too; with a name server on board where none answers");
  sub->add_flag("--ros", command.ros, "Serve it as services of ROS 2, too");
  sub->add_option("--speed", command.speed, "Simulated seconds per second; 0: as fast as the machine allows")
      ->check(CLI::Range(0.0, 1000.0));
  sub->add_option("--seed", command.seed, "Of all that is random")->check(whole_number(0));
  sub->add_option("--duration", command.duration, "Of simulated time, e.g. 90 s; else until Ctrl-C");
  sub->add_option("--goto", command.stops, "Send a robot there, PLACE or ROBOT=PLACE; several in their order");
  sub->add_flag("--json", command.json, "Print a line of JSON every simulated second");
  sub->add_flag("--headless", command.headless, "Print lines instead of the map");
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

}  // namespace

void add_service_commands(CLI::App& app, Commands& commands) {
  add_call(app, commands);
  add_services(app, commands);
  add_ping(app, commands);
  add_echo(app, commands);
  add_skill(app, commands);
  add_monitor(app, commands);
  add_component(app, commands);
  add_sim(app, commands);
}

}  // namespace sentree::cli
