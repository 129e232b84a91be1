#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "sentree/cli/campaign_command.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/completion.h"
#include "sentree/cli/coverage_command.h"
#include "sentree/cli/import_command.h"
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

void add_add(CLI::App& app, AddCommand& command) {
  auto* sub = app.add_subcommand("add", "Add a part to a project: files to begin with, and what sentree.yaml needs");
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

void add_run(CLI::App& app, RunCommand& command, std::string& vary) {
  auto* sub = app.add_subcommand("run", "Execute a mission");
  sub->footer(
      "Examples:\n"
      "  sentree run examples/recharge --scenario recharge --clock virtual\n"
      "  sentree run examples/recharge --scenario experiment1 --clock virtual --seed 7 --json\n"
      "  sentree run examples/recharge --clock real --factor 8 --live\n"
      "  sentree run examples/recharge --scenario experiment1 --factor 4 --studio --open\n"
      "  sentree run examples/recharge --scenario experiment2 --processes --factor 20\n"
      "  sentree run examples/recharge --scenario experiment1 --factor 4 --groot\n"
      "  sentree run examples/recharge --scenario recharge --durable   and when it was killed: sentree run --resume\n"
      "Exit code: 0 the mission did as expected, 1 it did not or a monitor is violated, 3 invalid project,\n"
      "4 environment (port taken), 124 time limit, 130 interrupted.");
  auto* project = sub->add_option("project", command.project, "Folder with a sentree.yaml, or a scenario file");
  project->capture_default_str();
  auto* scenario = sub->add_option("--scenario", command.scenario, "Name of a file in the project's scenarios/");
  sub->add_option("--vary", vary, "The run of that campaign with this --seed, as a scenario file in campaign/")
      ->excludes(scenario);
  sub->add_option_function<std::string>(
         "--clock", [&](const std::string& clock) { command.virtual_clock = clock == "virtual"; },
         "virtual: as fast as the machine allows, the same every time; real")
      ->check(CLI::IsMember({"virtual", "real"}));
  sub->add_option("--factor", command.factor,
                  "Run seconds per wall second, with the real clock, --studio, --groot or --foxglove")
      ->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed, "Of all that is random; same seed, same run in virtual time");
  sub->add_option(
         "--choose", command.choose,
         "What if: a model's choice comes out otherwise, MODEL#NUMBER=VALUE as `verify --explain` numbers them")
      ->allow_extra_args(false);
  sub->add_option("--duration", command.duration, "Time limit of the run, e.g. 90 s");
  sub->add_option("--listen", command.listen, "Where skills on other machines publish what they do: tcp://HOST:PORT");
  sub->add_flag("--insecure", command.insecure, "Let other machines connect without TLS");
  sub->add_flag("--processes", command.processes,
                "Each skill and component in a process of its own, restarted when it ends");
  auto* studio = sub->add_flag("--studio", command.studio,
                               "Show the run in a web page, at http://127.0.0.1:4711 or the next free port; "
                               "--studio=PORT or --studio=HOST:PORT elsewhere. The page stays until Ctrl-C");
  sub->add_flag("--studio-exit", command.studio_exit, "The page ends with the run")->needs(studio);
  sub->add_flag("--open", command.open, "Open the page in a browser")->needs(studio);
  sub->add_flag("--paused", command.paused, "Begin paused; the page lets the run go on")->needs(studio);
  sub->add_flag(
      "--yarp-server", command.yarp_server,
      "A name server of YARP on board, where yarp.conf says, else at 127.0.0.1:10000; --yarp-server=HOST:PORT "
      "elsewhere");
  sub->add_flag("--groot", command.groot,
                "Show the run to Groot 2 at 127.0.0.1:1667 and to Groot 1 at the ports 1666 and 1669; --groot=PORT or "
                "--groot=HOST:PORT elsewhere");
  sub->add_flag("--foxglove", command.foxglove,
                "Show the run in Foxglove, at ws://127.0.0.1:8765; --foxglove=PORT or --foxglove=HOST:PORT elsewhere");
  sub->add_flag("--live", command.live, "Show map, tree and monitors in the terminal");
  sub->add_flag("--headless", command.headless, "Print the log and the summary (default)");
  sub->add_flag("--verbose,-v", command.verbose, "Print every observation");
  sub->add_flag("--json", command.json, "Print the report as JSON, with the witness of every verdict");
  auto* record = sub->add_option("--record", command.record,
                                 "Recording to write (MCAP); default: a new one in runs/, or in $SENTREE_RUNS");
  auto* unrecorded = sub->add_flag("--no-record", command.no_record, "Record nothing")->excludes(record);
  auto* durable = sub->add_flag("--durable", command.durable,
                                "Keep a journal beside the recording, so that the run can be resumed when its process "
                                "is killed; --durable=never, =interval (each second, default) or =each says when it "
                                "reaches the disk itself, and so outlives the machine too")
                      ->excludes(unrecorded);
  auto* resume =
      sub->add_option_function<std::vector<std::string>>(
             "--resume",
             [&](const std::vector<std::string>& run) { command.resume = run.empty() ? std::string() : run.front(); },
             "Go on with the durable run of this recording; default: the last one that was killed")
          ->expected(0, 1)
          ->type_name("RUN.mcap")
          ->excludes(project)
          ->excludes(scenario)
          ->excludes(durable)
          ->excludes(unrecorded);
  sub->add_option_function<std::string>(
         "--project",
         // A folder that is named is another one than the folder that nobody named.
         [&](const std::string& other) { command.project = std::filesystem::absolute(other).string(); },
         "With --resume: the project or scenario with which the mission goes on, instead of its own")
      ->needs(resume);
}

void add_allow_plugins(CLI::App& sub, bool& allowed) {
  sub.add_flag("--allow-plugins", allowed,
               "Load the plug-ins that this recording brings: their code runs with your rights");
}

void add_studio(CLI::App& app, StudioCommand& command) {
  auto* sub =
      app.add_subcommand("studio", "Design a project, or show a recording or a run that goes on, in a web page");
  sub->footer(
      "Examples:\n"
      "  sentree studio my_robot --open                  edit a project, and see what each edit changes\n"
      "  sentree studio runs/recharge-20260102-101500.mcap --open\n"
      "  sentree studio RUN.mcap --at 8080\n"
      "  sentree studio RUN.mcap --groot --factor 4      also played to Groot, when it connects\n"
      "  sentree studio --attach --open                  the run that goes on, started without --studio\n"
      "  sentree studio --attach 4242                    of several, that of this process\n"
      "  sentree studio --attach http://robot:4711/#token=…   a page elsewhere\n"
      "  sentree studio --diff old.xml new.xml --open     two trees or charts as one picture; folders and recordings, "
      "too\n"
      "  git difftool -y -x 'sentree studio --open --diff' HEAD~1   the same of each file that changed\n"
      "A recording's page stays until Ctrl-C. That of a run is the run's own and ends with it, unless it was started "
      "with\n"
      "sentree run PROJECT --studio. With --diff the program ends when its page is closed.\n"
      "Exit code: 0, 3 neither a project nor a recording, 4 port taken, or nothing to attach to.");
  auto* recording = sub->add_option("recording", command.recording,
                                    "A project's folder or sentree.yaml, or an MCAP file of sentree run");
  sub->add_option_function<std::vector<std::string>>(
         "--attach",
         [&](const std::vector<std::string>& to) { command.attach = to.empty() ? std::string() : to.front(); },
         "Open the page of a run that goes on: process id, or HOST:PORT of a page; default: the only run there is")
      ->expected(0, 1)
      ->type_name("[PID|ADDR]")
      ->excludes(recording);
  sub->add_option("--diff", command.diff, "Show what differs between two files, folders or recordings' projects")
      ->expected(2)
      ->type_name("BEFORE AFTER")
      ->excludes(recording);
  sub->add_option("--at", command.at, "PORT or HOST:PORT; default: http://127.0.0.1:4711 or the next free port");
  sub->add_flag("--insecure", command.insecure, "Let other machines look, without TLS");
  auto* groot =
      sub->add_flag("--groot", command.groot,
                    "Play the recording to Groot, at the ports of sentree run --groot; --groot=PORT elsewhere")
          ->needs(recording);
  sub->add_option("--factor", command.factor, "Recorded seconds per second, for --groot")
      ->check(CLI::Range(0.01, 1000.0))
      ->needs(groot);
  add_allow_plugins(*sub, command.allow_plugins);
  sub->add_flag("--open", command.open, "Open the page in a browser");
}

void add_watch(CLI::App& app, WatchCommand& command) {
  auto* sub = app.add_subcommand("watch", "Watch a program with BehaviorTree.CPP that runs, and record it");
  sub->footer(
      "Examples:\n"
      "  sentree watch zmq://robot:1667                  in the terminal, recorded in runs/\n"
      "  sentree watch zmq://localhost:1667 --studio --open   tree, timeline and breakpoints in a web page\n"
      "The program needs a Groot2Publisher, BehaviorTree.CPP 4.1 or later. Ends with Ctrl-C.\n"
      "Exit code: 0, 3 a tree that cannot be read, 4 nobody answers, or a port is taken.");
  sub->add_option("address", command.address, "zmq://HOST:PORT of its publisher; the port is 1667 unless given")
      ->required();
  auto* studio = sub->add_flag("--studio", command.studio,
                               "Show it in a web page, at http://127.0.0.1:4711 or the next free port; --studio=PORT "
                               "or --studio=HOST:PORT elsewhere");
  sub->add_flag("--open", command.open, "Open the page in a browser")->needs(studio);
  sub->add_flag("--insecure", command.insecure, "Let other machines look at the page, without TLS");
  auto* record = sub->add_option("--record", command.record,
                                 "Recording to write (MCAP); default: a new one in runs/, or in $SENTREE_RUNS");
  sub->add_flag("--no-record", command.no_record, "Record nothing")->excludes(record);
  sub->add_option("--duration", command.duration, "How long, e.g. 90 s; else until Ctrl-C");
  sub->add_flag("--verbose,-v", command.verbose, "Print every observation");
}

void add_info(CLI::App& app, InfoCommand& command) {
  auto* sub = app.add_subcommand("info", "Say what a recording holds");
  sub->footer(
      "Examples:\n  sentree info runs/recharge-20260102-101500.mcap\n  sentree info RUN.mcap --json\n"
      "Any MCAP file can be asked. Exit code: 0, 3 not a recording.");
  sub->add_option("recording", command.file, "MCAP file")->required();
  sub->add_flag("--json", command.json, "Print it as JSON");
}

void add_export(CLI::App& app, ExportCommand& command) {
  auto* sub = app.add_subcommand("export", "Turn a recording into another format");
  sub->footer(
      "Examples:\n"
      "  sentree export RUN.mcap --to csv -o run.csv           the observations, one a row\n"
      "  sentree export RUN.mcap --to ndjson                   every message of every topic, one a line\n"
      "  sentree export RUN.mcap --to scenario -o scenarios/again.yaml   what was done, to do it again: sentree test\n"
      "  sentree export RUN.mcap --to perfetto -o run.json     for https://ui.perfetto.dev and chrome://tracing\n"
      "  sentree export RUN.mcap --to btlog -o run.btlog       the tree and its statuses, for Groot 2\n"
      "  sentree export RUN.mcap --to fbl -o run.fbl           the same for Groot 1");
  sub->add_option("recording", command.file, "MCAP file of sentree run")->required();
  sub->add_option("--to", command.format)
      ->required()
      ->check(CLI::IsMember({"csv", "ndjson", "scenario", "perfetto", "btlog", "fbl"}));
  sub->add_option("--output,-o", command.output, "Default: standard output");
  add_allow_plugins(*sub, command.allow_plugins);
}

void add_report(CLI::App& app, ReportCommand& command) {
  auto* sub =
      app.add_subcommand("report", "Tell a recorded run on one web page: verdicts, witness, timeline, coverage");
  sub->footer("Example:\n  sentree report RUN.mcap -o report.html");
  sub->add_option("recording", command.file, "MCAP file of sentree run")->required();
  sub->add_option("--output,-o", command.output, "Default: standard output");
  add_allow_plugins(*sub, command.allow_plugins);
}

void add_replay(CLI::App& app, ReplayCommand& command) {
  auto* sub = app.add_subcommand("replay", "Run a recorded mission again against the replies that it got then");
  sub->footer(
      "Examples:\n"
      "  sentree replay runs/recharge-20260102-101500.mcap\n"
      "  sentree replay RUN.mcap --project my_robot              a changed skill on yesterday's failure\n"
      "  sentree replay RUN.mcap --project my_robot --continue   and on, in the simulator, where it does something "
      "else\n"
      "  sentree replay RUN.mcap --from '52 s'                    and on, in the simulator, from that moment\n"
      "  sentree replay RUN.mcap --at '52 s'                      what everything was like at that moment\n"
      "Exit code: 0 it behaves as recorded (with --continue: no monitor is violated), 1 it does not, 3 not a "
      "recording.");
  sub->add_option("recording", command.file, "MCAP file of sentree run")->required();
  sub->add_option("--project", command.project, "Run this project instead of the recorded one");
  auto* go_on =
      sub->add_flag("--continue", command.go_on, "Go on in the simulator at the first request that was not recorded");
  auto* from = sub->add_option("--from", command.from, "Go on in the simulator from this moment of the run");
  sub->add_option("--at", command.at, "Print tree, skills, monitors and world as they were at this moment of the run")
      ->excludes(go_on)
      ->excludes(from);
  sub->add_flag("--verbose,-v", command.verbose, "Print every observation");
  sub->add_flag("--json", command.json, "Print what differs as JSON");
  add_allow_plugins(*sub, command.allow_plugins);
}

// What is asked of `test` beside the scenarios.
struct CoverageOptions {
  bool wanted = false;
  std::string min;
};

void add_test(CLI::App& app, TestCommand& command, CoverageOptions& coverage) {
  auto* sub = app.add_subcommand("test", "Run scenarios and say which expectations held");
  sub->footer(
      "Examples:\n"
      "  sentree test examples/recharge                                  every scenario of the project\n"
      "  sentree test examples/recharge --scenario experiment1 --json\n"
      "  sentree test examples/recharge/scenarios/experiment1.yaml       one file, wherever it lies\n"
      "  sentree test examples/recharge --coverage --min 80%             what no scenario has reached\n"
      "Exit code: 0 every expectation held, 1 one did not, 3 a project or scenario is invalid.");
  sub->add_option("project", command.paths, "Folders with a sentree.yaml, and scenario files")->capture_default_str();
  sub->add_option("--scenario", command.scenarios, "Only these of the folders");
  sub->add_flag("--strict", command.strict,
                "A monitor that got none of its events, or was never triggered, is a failure too");
  sub->add_flag(
      "--coverage", coverage.wanted,
      "Say what the scenarios have reached: statuses of nodes, states and transitions of skills, outcomes of calls, "
      "requirements");
  sub->add_option("--min", coverage.min, "Less of it is a failure, e.g. 90%");
  sub->add_flag("--json", command.json, "Print the results as JSON");
}

void add_verify(CLI::App& app, VerifyCommand& command) {
  auto* sub = app.add_subcommand(
      "verify", "Prove or refute requirements over every behaviour of a mission with models of its components");
  sub->footer(
      "Examples:\n"
      "  sentree verify examples/recharge                         every requirement, every behaviour\n"
      "  sentree verify . --only never_empty --explain            the story of its counterexample, tick by tick\n"
      "  sentree verify . --scenario scenarios/storm.yaml         with that scenario's overrides and timeline\n"
      "  sentree verify . --runs 10000 --confidence 99%           how often, where not everything can be tried\n"
      "  sentree verify . --model                                 a model to begin with, of each service without one\n"
      "  sentree verify . --against runs/today.mcap               which replies of that run the models do not allow\n"
      "  sentree test verify/never_empty.yaml                     a counterexample, run again\n"
      "Exit code: 0 everything holds, 1 something is refuted or holds vacuously, 3 the project is invalid or cannot "
      "be\n"
      "explored, 124 a limit ended it and nothing is refuted, 130 interrupted. See docs/verification.md.");
  sub->add_option("project", command.project, "Folder with a sentree.yaml")->capture_default_str();
  sub->add_option("--scenario", command.scenario, "A scenario whose overrides and timeline apply");
  sub->add_option("--only", command.only, "Only these requirements or monitors")->allow_extra_args(false);
  sub->add_option("--order", command.order, "Of what happens at one instant: any, or as in virtual time")
      ->check(CLI::IsMember({"any", "virtual"}))
      ->capture_default_str();
  sub->add_flag("--all-orders", command.all_orders, "Try also orders that no monitor and no part can tell apart");
  sub->add_option("--faults", command.faults,
                  "none: without the faults of `verify:`; FILE: with those of a file that is written as its `faults:`");
  sub->add_flag("--fair", command.fair, "What is offered again and again is taken again and again");
  sub->add_option("--ticks", command.ticks, "Stop behind so many ticks");
  sub->add_option("--states", command.states, "Stop behind so many states");
  sub->add_option("--memory", command.memory, "Stop when about so much is used, e.g. \"2 GB\"");
  sub->add_option("--time", command.time, "Stop after that time, e.g. \"30 s\"");
  sub->add_option("--out", command.out, "Folder of counterexamples (default: verify/ in the project)");
  sub->add_option("--graph", command.graph, "Write the graph of the mission: FILE.aut (Aldebaran) or FILE.dot");
  CLI::Option* const runs =
      sub->add_option("--runs", command.runs, "Statistics: so many runs, drawn, instead of every behaviour")
          ->check(CLI::PositiveNumber);
  sub->add_option("--confidence", command.confidence, "Of intervals and decisions")->capture_default_str();
  CLI::Option* const at_least = sub->add_option(
      "--at-least", command.at_least,
      "Statistics: decide, in as few runs as will do, whether it holds in that share of them, e.g. 99%");
  CLI::Option* const split =
      sub->add_option(
             "--split", command.split,
             "Statistics of what is rare: runs in which MODEL.DATA is greatest are split (or \"owed\": in which "
             "a bound is nearest); --runs are those that begin")
          ->excludes(at_least);
  sub->add_option("--seed", command.seed, "Of the runs")->capture_default_str();
  sub->add_option("--threads", command.threads,
                  "Explore, judge requirements or make runs in so many threads; the result is the same")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  sub->add_flag("--no-memo", command.no_memory, "Execute every step, also those that are known");
  sub->add_flag("--exact", command.exact,
                "Compare states, not 128 bits of their hashes, and execute every step; with --against, compare replies "
                "as they are, not as the mission tells them apart");
  CLI::Option* const model =
      sub->add_flag("--model", command.model, "Write models/SERVICE.scxml for services without a model: any reply");
  CLI::Option* const mutate =
      sub->add_flag("--mutate", command.mutate, "Tell which small changes of the mission no requirement notices");
  CLI::Option* const against =
      sub->add_option("--against", command.against, "A recording: tell which of its replies the models do not allow");
  // One thing at a time.
  for (CLI::Option* const one : {model, mutate, against}) {
    for (CLI::Option* const other : {runs, at_least, split}) one->excludes(other);
  }
  model->excludes(mutate)->excludes(against);
  mutate->excludes(against);
  sub->add_option("--tolerance", command.tolerance,
                  "With --against: how much earlier or later than the model a reply may be (default: the period)")
      ->needs(against);
  sub->add_flag("--explain", command.explain, "Tell counterexamples tick by tick");
  sub->add_flag("--json", command.json, "Print the results as JSON");
}

// Returns its subcommand `merge`.
const CLI::App* add_campaign(CLI::App& app, CampaignCommand& command) {
  auto* sub = app.add_subcommand(
      "campaign", "Run a mission thousands of times with what varies, and say how often which requirement breaks");
  sub->footer(
      "Examples:\n"
      "  sentree campaign examples/recharge -n 10000              what campaign.yaml of the project varies\n"
      "  sentree campaign . --vary storm.yaml --precision 1% --confidence 99%     ends when rates are known so well\n"
      "  sentree campaign . --expect 'never_empty violated < 1e-3'                ends when that is decided\n"
      "  sentree campaign . --search                              looks for runs that reach what none before did\n"
      "  sentree campaign . --resume                              goes on where it was interrupted\n"
      "  sentree campaign . --shard 2/4 --out part2               a part of it, on another machine\n"
      "  mpirun -n 8 sentree campaign . --mpi                     parts for each rank, merged by the first\n"
      "  sentree campaign merge part1 part2 part3 part4           the same result, byte for byte\n"
      "  sentree run . --vary campaign.yaml --seed 1000042        one of its runs again\n"
      "Exit code: 0 nothing is violated, or what is expected holds; 1 something is, or does not; 124 an expectation "
      "is\n"
      "undecided; 3 invalid input; 130 interrupted. See docs/campaigns.md.");
  sub->add_option("project", command.project, "Folder with a sentree.yaml")->capture_default_str();
  sub->add_option("--vary", command.vary, "What is varied (default: campaign.yaml in the project, if it is there)");
  sub->add_option("--runs,-n", command.runs,
                  "Most runs (default: as the file says; else 1000, or 100000 that end early)");
  sub->add_option("--seed", command.seed, "Of everything that is drawn; run N has the seed S000000 + N");
  sub->add_option("--jobs,-j", command.jobs, "Processes at a time (default: one a core); the result is the same");
  auto* precision = sub->add_option("--precision", command.precision,
                                    "End when half of every rate's interval is at most this, e.g. 1%");
  auto* expect = sub->add_option("--expect", command.expect,
                                 "Decide by a sequential test: \"REQUIREMENT violated < 1e-3\"; several times")
                     ->allow_extra_args(false);
  auto* shard = sub->add_option("--shard", command.shard, "Run the I-th of N parts, I/N");
  auto* mpi = sub->add_flag("--mpi", command.mpi,
                            "One of the ranks that mpirun or srun has started together: each runs its part, the first "
                            "merges them")
                  ->excludes(shard);
  auto* resume = sub->add_flag("--resume", command.resume, "Go on behind the runs that the folder has");
  // Both are of the runs of one process and its children.
  for (CLI::Option* of_all :
       {sub->add_flag("--coverage", command.coverage, "Say what of the project the runs have reached"),
        sub->add_flag("--search", command.search,
                      "Look for runs that reach what none before did; not for how often something happens")
            ->excludes(precision)
            ->excludes(expect)})
    of_all->excludes(shard)->excludes(mpi)->excludes(resume);
  auto* merge = sub->add_subcommand("merge", "The result of a campaign's shards");
  merge->add_option("folder", command.merged, "Folders of the shards")->required();
  for (CLI::App* with : {sub, merge}) {
    with->add_option("--confidence", command.confidence, "Of intervals and decisions")->capture_default_str();
    with->add_option("--out", command.out, "Folder of what is written (default: campaign/ in the project)");
    with->add_flag("--json", command.json, "Print the result as JSON");
    with->add_flag("--no-shrink", command.no_shrink, "Write no least scenarios");
  }
  return merge;
}

void add_trees(CLI::App& sub, TreeOptions& options) {
  sub.add_option("--palette", options.palettes, "Trees: a file whose TreeNodesModel says what nodes are; several times")
      ->type_name("FILE")
      ->allow_extra_args(false);
  sub.add_option("--packages", options.packages,
                 "Trees: a folder with ROS packages, for <include ros_pkg=…>; beside $AMENT_PREFIX_PATH")
      ->type_name("FOLDER")
      ->allow_extra_args(false);
}

void add_check(CLI::App& app, CheckCommand& command) {
  auto* sub =
      app.add_subcommand("check", "Find everything that is wrong with a project or with files, without running them");
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

void add_graph(CLI::App& app, GraphCommand& command) {
  auto* sub = app.add_subcommand("graph", "Draw a tree, a state chart, or a world with its robots");
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
  sub->add_option("--seed", command.seed, "World: of all that is random");
}

void add_fmt(CLI::App& app, FmtCommand& command) {
  auto* sub = app.add_subcommand("fmt", "Write trees and state charts in canonical form");
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

void add_diff(CLI::App& app, DiffCommand& command) {
  auto* sub = app.add_subcommand("diff", "Say how two trees, or two state charts, differ in meaning");
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

void add_model(CLI::App& app, ModelCommand& command) {
  auto* sub = app.add_subcommand("model", "Describe a project's skills for the palette of a tree editor");
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

void add_completion(CLI::App& app, std::string& shell) {
  auto* sub = app.add_subcommand("completion", "Print the script by which a shell completes commands, files and names");
  sub->footer(
      "Examples:\n"
      "  source <(sentree completion bash)                        in ~/.bashrc\n"
      "  source <(sentree completion zsh)                         in ~/.zshrc, behind compinit\n"
      "  sentree completion fish | source                         in ~/.config/fish/config.fish");
  sub->add_option("shell", shell)->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

void add_chart(CLI::App& app, ChartCommand& command) {
  auto* sub = app.add_subcommand("chart", "Run one state chart by hand: type events, look inside, step back");
  sub->footer(
      "Examples:\n"
      "  sentree chart examples/recharge/skills/BatteryLevelAbove.scxml --data threshold=30\n"
      "  printf 'tick\\nwait 2s\\nstate\\n' | sentree chart examples/recharge/skills/WaitForUser.scxml\n"
      "Type help for the commands. Exit code: 0, or 1 if a command of a script failed, 3 invalid chart.");
  sub->add_option("file", command.file, "State chart (.scxml)")->required();
  sub->add_option("--data,-d", command.data, "NAME=VALUE: initial value of a <data>");
  sub->add_option("--seed", command.seed, "Of Math.random")->capture_default_str();
  sub->add_option("--script-max", command.script_max, "Processor time that one command may take")
      ->capture_default_str();
  sub->add_flag("--json", command.json, "Answer each command with one line of JSON");
}

void add_call(CLI::App& app, CallCommand& command) {
  auto* sub = app.add_subcommand("call", "Call a service of a running mission, or of any address");
  sub->footer(
      "Examples:\n"
      "  sentree call                                          what the running mission offers\n"
      "  sentree call battery getBatteryState\n"
      "  sentree call simulation setBatteryCharge percent=10   experiment 1, by hand\n"
      "  sentree call tcp://127.0.0.1:9090/battery getBatteryState --interface robot.thrift/Battery");
  sub->add_option("service", command.service, "Name in the running mission, or an address");
  sub->add_option("method", command.method);
  sub->add_option("arguments", command.arguments, "name=value …, or one JSON object");
  sub->add_option("--interface", command.interface, "FILE.thrift/SERVICE, when calling an address");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(CLI::PositiveNumber);
  sub->add_option("--deadline", command.deadline)->capture_default_str();
}

void add_init(CLI::App& app, InitCommand& command) {
  auto* sub = app.add_subcommand("init", "Start a new project: small, and it runs");
  sub->footer("Example:\n  sentree init my_robot && sentree run my_robot --clock virtual");
  sub->add_option("folder", command.folder)->required();
}

void add_import(CLI::App& app, ImportCommand& command) {
  auto* sub = app.add_subcommand("import", "Make a project of somebody else's system");
  sub->footer(
      "Examples:\n"
      "  sentree import ~/bt-implementation -o my_robot     Behavior Trees, Qt SCXML skills with C++ snippets, YARP\n"
      "  sentree import museum/main.xml -o museum_project   an AS2FM system; or its folder, if files lie beside "
      "main.xml\n"
      "  sentree import museum --main Main/main.xml -o museum_project\n"
      "What has no counterpart stays as a comment at its place, and is listed here and in IMPORT.md with file and "
      "line.\n"
      "Exit code: 0 everything was translated, 1 something is left to do by hand, 3 no such system, or the output is\n"
      "not empty, 4 it cannot be written.");
  sub->add_option("system", command.system, "Folder of the system, or the main file of an AS2FM system")->required();
  sub->add_option("--output,-o", command.output, "Folder of the new project")->required();
  sub->add_option("--main", command.main, "Of a folder with several AS2FM systems: the main file");
  sub->add_flag("--force", command.force, "Replace files of the same names in a folder that is not empty");
  sub->add_flag("--json", command.json, "Print files and findings as JSON");
}

void add_skill(CLI::App& app, SkillCommand& command) {
  auto* sub = app.add_subcommand("skill", "Run one skill in a process of its own");
  sub->footer(
      "Example:\n"
      "  sentree skill examples/recharge GoToLocation --listen unix:/tmp/goto.sock --at "
      "navigation=tcp://127.0.0.1:9090");
  sub->add_option("project", command.project)->required();
  sub->add_option("leaf", command.leaf, "ID or name of the leaves that it runs")->required();
  sub->add_option("--listen", command.listen, "unix:PATH, tcp://HOST:PORT (port 0: any), yarp:/PORT")->required();
  sub->add_option("--of-run", command.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  sub->add_option("--observer", command.observer, "Where the run listens for what is observed here");
  sub->add_option("--at", command.at, "SERVICE=ADDRESS, instead of what sentree.yaml says");
  sub->add_option("--factor", command.factor, "Run seconds per wall second")->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed);
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

void add_services(CLI::App& app, ServicesCommand& command) {
  auto* sub = app.add_subcommand("services", "List the services of a running mission");
  sub->footer(
      "Examples:\n"
      "  sentree services\n"
      "  sentree services --on yarp:        the ports that the name server of YARP knows\n"
      "  sentree services --on ros:         topics, services and actions of ROS 2");
  sub->add_option("--on", command.on, "A network instead of a run: yarp: or ros:, or yarp:/robot for what is named so");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(CLI::PositiveNumber);
  sub->add_flag("--json", command.json, "Print the list as JSON");
}

void add_ping(CLI::App& app, PingCommand& command) {
  auto* sub = app.add_subcommand("ping", "Ask whether a running mission, its services, or an address answer");
  sub->footer(
      "Examples:\n"
      "  sentree ping                                  the run and every service elsewhere\n"
      "  sentree ping navigation\n"
      "  sentree ping tcp://127.0.0.1:9090/battery\n"
      "  sentree ping yarp:/battery/rpc:i\n"
      "Exit code: 0 all answer, 4 one does not.");
  sub->add_option("target", command.target, "Service or address; default: all");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(CLI::PositiveNumber);
  sub->add_flag("--json", command.json, "Print the round trips as JSON");
}

void add_echo(CLI::App& app, EchoCommand& command) {
  auto* sub = app.add_subcommand("echo", "Show the observations of a running mission as they come");
  sub->footer(
      "Examples:\n"
      "  sentree echo\n"
      "  sentree echo 'battery.*'\n"
      "  sentree echo yarp:/battery/state:o            what a port of YARP sends\n"
      "  sentree echo ros:/battery_state               what is published on a topic of ROS 2\n"
      "  sentree echo '*.tick.reply' --json -n 10");
  sub->add_option("pattern", command.pattern, "Of names; * stands for any characters")->capture_default_str();
  sub->add_option("--count,-n", command.count, "End after so many");
  sub->add_option("--run", command.run, "Process id of the run, where several run")->check(CLI::PositiveNumber);
  sub->add_flag("--json", command.json, "A line of JSON for each");
}

void add_bench(CLI::App& app, BenchRpcCommand& command) {
  auto* sub = app.add_subcommand("bench", "Measure this machine");
  sub->require_subcommand(1);
  auto* rpc = sub->add_subcommand("rpc", "An empty call between two processes, over a Unix socket or YARP");
  rpc->footer("Examples:\n  sentree bench rpc --json\n  sentree bench rpc --over yarp");
  rpc->add_option("--over", command.over, "unix: a Unix socket; yarp: ports of YARP, tcp")
      ->check(CLI::IsMember({"unix", "yarp"}));
  rpc->add_option("--calls", command.calls)->check(CLI::Range(1, 10'000'000))->capture_default_str();
  rpc->add_option("--listen", command.listen)->group("");
  rpc->add_flag("--json", command.json, "Print median and 99th percentile as JSON [µs]");
}

CLI::App* add_monitor(CLI::App& app, MonitorServeCommand& command, MonitorCheckCommand& check,
                      SynthCommand& synth_command) {
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
  synth->add_option("file", synth_command.file, "Requirements (.req)")->required();
  synth->add_option("--output,-o", synth_command.output, "Folder for the charts, NAME.scxml each")->required();
  synth->add_option("--project", synth_command.project,
                    "Whose services, leaves and units they are about (default: the sentree.yaml above the file)");
  sub->add_option("--project", command.project, "Project or scenario");
  sub->add_option("--name", command.name, "Which of its monitors");
  sub->add_option("--listen", command.listen, "unix:PATH, tcp://HOST:PORT (port 0: any)");
  sub->add_option("--of-run", command.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  auto* on = sub->add_subcommand("check", "Say what monitors make of a recording");
  on->footer(
      "Examples:\n"
      "  sentree monitor check runs/recharge-20260102-101500.mcap\n"
      "  sentree monitor check RUN.mcap --project my_robot\n"
      "  sentree monitor check RUN.mcap --monitor monitors/battery.scxml --violated failure\n"
      "Exit code: 0 none is violated, 1 one is, 3 not a recording.");
  on->add_option("recording", check.file, "MCAP file of sentree run")->required();
  on->add_option("--project", check.project, "Its monitors, instead of the recorded project's");
  on->add_option("--monitor", check.monitors, "Charts, instead of a project's monitors");
  on->add_option("--req", check.requirements, "Requirement files, instead of a project's monitors");
  on->add_option("--violated", check.violated, "States of the charts whose entry is a violation");
  on->add_flag("--json", check.json, "Print verdicts and witnesses as JSON");
  add_allow_plugins(*on, check.allow_plugins);
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
  return synth;
}

void add_component(CLI::App& app, ComponentCommand& command) {
  auto* sub = app.add_subcommand("component", "Serve a component from a process of its own");
  sub->footer(
      "Example:\n  sentree component sim --world examples/recharge/world/world.yaml --listen tcp://127.0.0.1:9090");
  sub->add_option("name", command.name, "sim: the simulated robot")->required();
  sub->add_option("--project", command.project, "Project or scenario whose simulated services to serve");
  sub->add_option("--world", command.world, "World file; all services are served");
  sub->add_option("--listen", command.listen, "unix:PATH, tcp://HOST:PORT (port 0: any), yarp:/PREFIX/, ros:/PREFIX/")
      ->required();
  sub->add_option("--of-run", command.of_run, "Given by durable runs: end when that run is not resumed in time")
      ->group("");
  sub->add_option("--factor", command.factor, "Run seconds per wall second")->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed);
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

void add_sim(CLI::App& app, SimCommand& command) {
  auto* sub = app.add_subcommand("sim", "Run the simulated robot alone, and show it");
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
  sub->add_option("--seed", command.seed, "Of all that is random");
  sub->add_option("--duration", command.duration, "Of simulated time, e.g. 90 s; else until Ctrl-C");
  sub->add_option("--goto", command.stops, "Send a robot there, PLACE or ROBOT=PLACE; several in their order");
  sub->add_flag("--json", command.json, "Print a line of JSON every simulated second");
  sub->add_flag("--headless", command.headless, "Print lines instead of the map");
  sub->add_flag("--insecure", command.insecure, "Allow other machines to connect without TLS");
}

void add_bug_report(CLI::App& app, BugReportCommand& command) {
  auto* sub = app.add_subcommand("bug-report", "Pack into one file what others need to understand an error");
  sub->footer(
      "Examples:\n"
      "  sentree bug-report\n"
      "  sentree bug-report runs/recharge-20260102-101500.mcap -o report.tar.gz\n"
      "Packs version, commit, compiler, libraries, what sentree doctor says, and the recording, with which come the\n"
      "project's files. Exit code: 0, 3 no such recording, 4 the file cannot be written.");
  sub->add_option("recording", command.recording, "MCAP file of the run that went wrong");
  sub->add_option("--output,-o", command.output, "Default: sentree-bug-report-DATE-TIME.tar.gz");
}

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
  RunCommand run_command;
  std::string run_vary;
  InfoCommand info_command;
  TestCommand test_command;
  CoverageOptions test_coverage_options;
  VerifyCommand verify_command;
  CampaignCommand campaign_command;
  CheckCommand check_command;
  GraphCommand graph_command;
  ChartCommand chart_command;
  CallCommand call_command;
  InitCommand init_command;
  AddCommand add_command;
  ImportCommand import_command;
  SkillCommand skill_command;
  ComponentCommand component_command;
  FmtCommand fmt_command;
  DiffCommand diff_command;
  ModelCommand model_command;
  std::string shell;
  SimCommand sim_command;
  ServicesCommand services_command;
  PingCommand ping_command;
  EchoCommand echo_command;
  MonitorServeCommand monitor_command;
  MonitorCheckCommand monitor_check_command;
  ReplayCommand replay_command;
  ExportCommand export_command;
  ReportCommand report_command;
  BenchRpcCommand bench_command;
  SynthCommand synth_command;
  StudioCommand studio_command;
  WatchCommand watch_command;
  app.add_subcommand("lsp", "Help editors with missions, charts, requirements and interfaces (docs/editors.md)")
      ->add_flag("--stdio")
      ->description("Over standard input and output, as it always is");
  DoctorCommand doctor_command;
  BugReportCommand bug_report_command;
  add_init(app, init_command);
  add_add(app, add_command);
  add_import(app, import_command);
  add_check(app, check_command);
  add_run(app, run_command, run_vary);
  add_test(app, test_command, test_coverage_options);
  add_verify(app, verify_command);
  const CLI::App* merge = add_campaign(app, campaign_command);
  add_studio(app, studio_command);
  add_watch(app, watch_command);
  add_info(app, info_command);
  add_replay(app, replay_command);
  add_export(app, export_command);
  add_report(app, report_command);
  add_graph(app, graph_command);
  add_fmt(app, fmt_command);
  add_diff(app, diff_command);
  add_model(app, model_command);
  add_chart(app, chart_command);
  add_call(app, call_command);
  add_services(app, services_command);
  add_ping(app, ping_command);
  add_echo(app, echo_command);
  add_skill(app, skill_command);
  const CLI::App* synth = add_monitor(app, monitor_command, monitor_check_command, synth_command);
  add_component(app, component_command);
  add_sim(app, sim_command);
  app.add_subcommand("doctor", "Say whether this machine has what Sentree needs")
      ->add_flag("--json", doctor_command.json);
  add_bug_report(app, bug_report_command);
  add_bench(app, bench_command);
  add_completion(app, shell);
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
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  if (app.got_subcommand("init")) return init(init_command);
  if (app.got_subcommand("add")) return add(add_command);
  if (app.got_subcommand("import")) return import_project(import_command);
  if (app.got_subcommand("check")) return check(check_command);
  if (app.got_subcommand("run")) return leave(run_vary.empty() ? run(run_command) : run_drawn(run_command, run_vary));
  if (app.got_subcommand("test")) {
    const bool covers = test_coverage_options.wanted || !test_coverage_options.min.empty();
    return leave(covers ? test_coverage(test_command, test_coverage_options.min) : test(test_command));
  }
  if (app.got_subcommand("verify")) return leave(verify(verify_command));
  if (merge->parsed()) return campaign_merge(campaign_command);
  if (app.got_subcommand("campaign")) return campaign(campaign_command);
  if (app.got_subcommand("studio")) return studio(studio_command);
  if (app.got_subcommand("watch")) return watch(watch_command);
  if (app.got_subcommand("info")) return info(info_command);
  if (app.got_subcommand("graph")) return graph(graph_command);
  if (app.got_subcommand("fmt")) return sentree::cli::fmt(fmt_command);
  if (app.got_subcommand("lsp")) return lsp();
  if (app.got_subcommand("diff")) return diff(diff_command);
  if (app.got_subcommand("model")) return model(model_command);
  if (app.got_subcommand("completion")) {
    print(completion_script(shell));
    return kOk;
  }
  if (app.got_subcommand("chart")) return chart(chart_command);
  if (app.got_subcommand("call")) return call(call_command);
  if (app.got_subcommand("services")) return services(services_command);
  if (app.got_subcommand("ping")) return ping(ping_command);
  if (app.got_subcommand("echo")) return echo(echo_command);
  if (app.got_subcommand("export")) return export_recording(export_command);
  if (app.got_subcommand("report")) return report(report_command);
  if (app.got_subcommand("replay")) return leave(replay(replay_command));
  if (synth->parsed()) return monitor_synth(synth_command);
  if (app.got_subcommand("monitor")) {
    if (app.get_subcommand("monitor")->got_subcommand("check")) return monitor_check(monitor_check_command);
    if (!monitor_command.project.empty() && !monitor_command.name.empty() && !monitor_command.listen.empty())
      return monitor_serve(monitor_command);
    say("sentree monitor needs --project, --name and --listen, or the subcommand check or synth");
    return kUsage;
  }
  if (app.got_subcommand("bench")) return bench_rpc(bench_command);
  if (app.got_subcommand("skill")) return skill(skill_command);
  if (app.got_subcommand("component")) return component(component_command);
  if (app.got_subcommand("sim")) return sim(sim_command);
  if (app.got_subcommand("bug-report")) return bug_report(bug_report_command);
  return doctor(doctor_command);
}

}  // namespace

int main(int argc, char** argv) {
  sentree::rpc::register_middleware(sentree::yarp::make_middleware());
  sentree::rpc::register_middleware(sentree::ros::make_middleware(
      {.find = sentree::cli::ros_interface, .warn = [](const std::string& what) { sentree::cli::say("! " + what); }}));
  return finished(command_line(argc, argv));
}
