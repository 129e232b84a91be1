#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "sentree/cli/campaign_command.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/coverage_command.h"
#include "sentree/cli/output.h"

// Runs, and what is made of their recordings.

namespace sentree::cli {

namespace {

// Of a variable of the shell that is not set.
std::string not_empty(const std::string& moment) { return moment.empty() ? "is empty; write for example '52 s'" : ""; }

void add_run(CLI::App& app, Commands& commands) {
  struct Wanted {
    RunCommand run;
    std::string vary;
  };
  const auto kept = std::make_shared<Wanted>();
  RunCommand& command = kept->run;
  auto* sub = app.add_subcommand("run", "Execute a mission");
  sub->footer(
      "Examples:\n"
      "  sentree run examples/recharge --scenario recharge --clock virtual\n"
      "  sentree run examples/recharge --scenario experiment1 --clock virtual --seed 7 --json\n"
      "  sentree run examples/recharge --clock real --factor 8 --live\n"
      "  sentree run examples/recharge --scenario experiment1 --factor 4 --studio --open\n"
      "  sentree run examples/recharge --scenario experiment2 --processes --factor 20\n"
      "  sentree run examples/recharge --scenario experiment1 --factor 4 --groot\n"
      "  sentree run examples/recharge --scenario recharge --clock real --durable\n"
      "                                                            and when it was killed: sentree run --resume\n"
      "Exit code: 0 the mission did as expected, 1 it did not or a monitor is violated, 3 invalid project,\n"
      "4 environment (port taken), 124 time limit, 130 interrupted.");
  auto* project = sub->add_option("project", command.project, "Folder with a sentree.yaml, or a scenario file");
  project->capture_default_str();
  auto* scenario =
      sub->add_option("--scenario", command.scenario, "Name of a file in the project's scenarios/, or the file");
  sub->add_option("--vary", kept->vary, "The run of that campaign with this --seed, as a scenario file in campaign/")
      ->excludes(scenario);
  sub->add_option_function<std::string>(
         "--clock", [&](const std::string& clock) { command.virtual_clock = clock == "virtual"; },
         "virtual: as fast as the machine allows, the same every time; real")
      ->check(CLI::IsMember({"virtual", "real"}));
  sub->add_option("--factor", command.factor,
                  "Run seconds per wall second, with the real clock, --studio, --groot or --foxglove")
      ->check(CLI::Range(0.01, 1000.0));
  sub->add_option("--seed", command.seed, "Of all that is random; same seed, same run in virtual time")
      ->check(whole_number(0));
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
  add_allow_plugins(*sub, command.recorded_code)->needs(resume);
  sub->add_option_function<std::string>(
         "--project",
         // A folder that is named is another one than the folder that nobody named.
         [&](const std::string& other) { command.project = std::filesystem::absolute(other).string(); },
         "With --resume: the project or scenario with which the mission goes on, instead of its own")
      ->needs(resume);
  commands.push_back(
      {sub, [kept] { return leave(kept->vary.empty() ? run(kept->run) : run_drawn(kept->run, kept->vary)); }});
}

void add_test(CLI::App& app, Commands& commands) {
  struct Wanted {
    TestCommand test;
    bool coverage = false;
    std::string min;
  };
  const auto kept = std::make_shared<Wanted>();
  TestCommand& command = kept->test;
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
                "A monitor that got none of its events, or was never triggered, and what went wrong on the way, are "
                "failures too");
  sub->add_flag(
      "--coverage", kept->coverage,
      "Say what the scenarios have reached: statuses of nodes, states and transitions of skills, outcomes of calls, "
      "requirements");
  sub->add_option("--min", kept->min, "Less of it is a failure, e.g. 90%");
  sub->add_flag("--json", command.json, "Print the results as JSON");
  commands.push_back({sub, [kept] {
                        const bool covers = kept->coverage || !kept->min.empty();
                        return leave(covers ? test_coverage(kept->test, kept->min) : test(kept->test));
                      }});
}

void add_verify(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand(
      "verify", "Prove or refute requirements over every behaviour of a mission with models of its components");
  VerifyCommand& command =
      options_for<VerifyCommand>(sub, commands, [](const VerifyCommand& read) { return leave(verify(read)); });
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
      "explored, 4 what is found cannot be written, 124 not everything was tried and nothing is refuted,\n"
      "130 interrupted. See docs/verification.md.");
  sub->add_option("project", command.project, "Folder with a sentree.yaml")->capture_default_str();
  sub->add_option("--scenario", command.scenario,
                  "A scenario whose overrides and timeline apply: its file, or its name in scenarios/");
  sub->add_option("--only", command.only, "Only this requirement or monitor; several: again for each")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->add_option("--order", command.order, "Of what happens at one instant: any, or as in virtual time")
      ->check(CLI::IsMember({"any", "virtual"}))
      ->capture_default_str();
  CLI::Option* const all_orders =
      sub->add_flag("--all-orders", command.all_orders, "Try also orders that no monitor and no part can tell apart");
  sub->add_option("--faults", command.faults,
                  "none: without the faults of `verify:`; FILE: with those of a file that is written as its `faults:`");
  CLI::Option* const fair =
      sub->add_flag("--fair", command.fair,
                    "Each alternative of a model's choice that is offered again and again is taken again and again");
  sub->add_option("--ticks", command.ticks, "Stop behind so many ticks")->check(whole_number(1));
  CLI::Option* const states =
      sub->add_option("--states", command.states, "Stop behind so many states")->check(whole_number(1));
  sub->add_option("--memory", command.memory,
                  "Stop when the states of the mission take about so much, e.g. \"2 GB\" (default: 4 GB, or three "
                  "eighths of what is free); judging may take as much again");
  CLI::Option* const time = sub->add_option("--time", command.time, "Stop after that time, e.g. \"30 s\"");
  sub->add_option("--out", command.out, "Folder of counterexamples (default: verify/ in the project)");
  CLI::Option* const graph =
      sub->add_option("--graph", command.graph, "Write the graph of the mission: FILE.aut (Aldebaran) or FILE.dot");
  CLI::Option* const runs =
      sub->add_option("--runs", command.runs, "Statistics: so many runs, drawn, instead of every behaviour")
          ->check(whole_number(1));
  CLI::Option* const confidence =
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
  CLI::Option* const seed =
      sub->add_option("--seed", command.seed, "Of the runs")->check(whole_number(0))->capture_default_str();
  sub->parse_complete_callback([=] {
    if (runs->count() + at_least->count() + split->count() > 0) return;
    for (const CLI::Option* const one : {confidence, seed}) {
      if (one->count() > 0) throw CLI::RequiresError(one->get_name(), "--runs, --at-least or --split");
    }
  });
  sub->add_option("--threads", command.threads,
                  "Explore, judge requirements or make runs in so many threads; the result is the same")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  sub->add_flag("--no-memo", command.no_memory, "Execute every step, also those that are known");
  CLI::Option* const exact = sub->add_flag(
      "--exact", command.exact,
      "Compare states, not 128 bits of their hashes, and execute every step; with --against, compare replies "
      "as they are, not as the mission tells them apart");
  CLI::Option* const model =
      sub->add_flag("--model", command.model, "Write models/SERVICE.scxml for services without a model: any reply");
  CLI::Option* const mutate =
      sub->add_flag("--mutate", command.mutate, "Tell which small changes of the mission no requirement notices");
  CLI::Option* const against =
      sub->add_option("--against", command.against, "A recording: tell which of its replies the models do not allow");
  // One thing at a time.
  CLI::Option* const explain = sub->add_flag("--explain", command.explain, "Tell counterexamples tick by tick");
  for (CLI::Option* const one : {model, mutate, against, graph, all_orders, fair, states, time, exact, explain}) {
    for (CLI::Option* const other : {runs, at_least, split}) one->excludes(other);
  }
  model->excludes(mutate)->excludes(against)->excludes(graph);
  mutate->excludes(against)->excludes(graph);
  against->excludes(graph);
  sub->add_option("--tolerance", command.tolerance,
                  "With --against: how much earlier or later than the model a reply may be (default: the period)")
      ->needs(against);
  sub->add_flag("--json", command.json, "Print the results as JSON");
}

void add_campaign(CLI::App& app, Commands& commands) {
  const auto kept = std::make_shared<CampaignCommand>();
  CampaignCommand& command = *kept;
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
      "undecided; 3 invalid input; 4 something cannot be written, or another campaign has the folder; 130 interrupted. "
      "See\n"
      "docs/campaigns.md.");
  sub->add_option("project", command.project, "Folder with a sentree.yaml")->capture_default_str();
  sub->add_option("--vary", command.vary, "What is varied (default: campaign.yaml in the project, if it is there)");
  sub->add_option("--runs,-n", command.runs,
                  "Most runs (default: as the file says; else 1000, or 100000 that end early)");
  sub->add_option("--seed", command.seed, "Of everything that is drawn; run N has the seed S000000 + N")
      ->check(whole_number(0, 9'000'000'000'000));
  sub->add_option("--jobs,-j", command.jobs, "Processes at a time (default: one a core); the result is the same")
      ->check(whole_number(1, 1024));
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
  auto* resume = sub->add_flag("--resume", command.resume,
                               "Go on behind the runs that the folder has, as they were asked for; -n may be more");
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
    with->add_option("--confidence", command.confidence,
                     with == merge ? "Of intervals and decisions (default: as the shards were made)"
                                   : "Of intervals and decisions (default: 95 %)");
    with->add_option("--out", command.out, "Folder of what is written (default: campaign/ in the project)");
    with->add_flag("--json", command.json, "Print the result as JSON");
    with->add_flag("--no-shrink", command.no_shrink, "Write no least scenarios");
  }
  commands.push_back({merge, [kept] { return campaign_merge(*kept); }});
  commands.push_back({sub, [kept] { return campaign(*kept); }});
}

void add_studio(CLI::App& app, Commands& commands) {
  auto* sub =
      app.add_subcommand("studio", "Design a project, or show a recording or a run that goes on, in a web page");
  StudioCommand& command = options_for<StudioCommand>(sub, commands, studio);
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
  add_allow_plugins(*sub, command.recorded_code);
  sub->add_flag("--open", command.open, "Open the page in a browser");
}

void add_watch(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("watch", "Watch a program with BehaviorTree.CPP that runs, and record it");
  WatchCommand& command = options_for<WatchCommand>(sub, commands, watch);
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

void add_info(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("info", "Say what a recording holds");
  InfoCommand& command = options_for<InfoCommand>(sub, commands, info);
  sub->footer(
      "Examples:\n  sentree info runs/recharge-20260102-101500.mcap\n  sentree info RUN.mcap --json\n"
      "Any MCAP file can be asked. Exit code: 0, 3 not a recording.");
  sub->add_option("recording", command.file, "MCAP file")->required();
  sub->add_flag("--json", command.json, "Print it as JSON");
}

void add_replay(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("replay", "Run a recorded mission again against the replies that it got then");
  ReplayCommand& command =
      options_for<ReplayCommand>(sub, commands, [](const ReplayCommand& read) { return leave(replay(read)); });
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
  auto* from =
      sub->add_option("--from", command.from, "Go on in the simulator from this moment of the run")->check(not_empty);
  sub->add_option("--at", command.at, "Print tree, skills, monitors and world as they were at this moment of the run")
      ->check(not_empty)
      ->excludes(go_on)
      ->excludes(from);
  sub->add_flag("--verbose,-v", command.verbose, "Print every observation");
  sub->add_flag("--json", command.json, "Print what differs as JSON");
  add_allow_plugins(*sub, command.recorded_code);
}

void add_export(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("export", "Turn a recording into another format");
  ExportCommand& command = options_for<ExportCommand>(sub, commands, export_recording);
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
  add_allow_plugins(*sub, command.recorded_code);
}

void add_report(CLI::App& app, Commands& commands) {
  auto* sub =
      app.add_subcommand("report", "Tell a recorded run on one web page: verdicts, witness, timeline, coverage");
  ReportCommand& command = options_for<ReportCommand>(sub, commands, report);
  sub->footer("Example:\n  sentree report RUN.mcap -o report.html");
  sub->add_option("recording", command.file, "MCAP file of sentree run")->required();
  sub->add_option("--output,-o", command.output, "Default: standard output");
  add_allow_plugins(*sub, command.recorded_code);
}

}  // namespace

void add_run_commands(CLI::App& app, Commands& commands) {
  add_run(app, commands);
  add_test(app, commands);
  add_verify(app, commands);
  add_campaign(app, commands);
  add_studio(app, commands);
  add_watch(app, commands);
  add_info(app, commands);
  add_replay(app, commands);
  add_export(app, commands);
  add_report(app, commands);
}

}  // namespace sentree::cli
