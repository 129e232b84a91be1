#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/replay/recorded_code.h"

namespace sentree::cli {

/// Exit codes of every command.
inline constexpr int kOk = 0;
inline constexpr int kFindings = 1;  ///< Findings, a failed expectation, a violated monitor.
inline constexpr int kUsage = 2;
inline constexpr int kInvalidInput = 3;  ///< Unreadable or invalid input.
inline constexpr int kEnvironment = 4;   ///< Port taken, peer gone.
inline constexpr int kTimeLimit = 124;
inline constexpr int kInterrupted = 130;

struct RunCommand {
  std::string project = ".";
  std::string scenario;  ///< Name in the project's scenarios/; empty: none.
  std::optional<bool> virtual_clock;
  std::optional<double> factor;
  std::optional<std::uint64_t> seed;
  std::vector<std::string> choose;  ///< What models choose instead: "MODEL#NUMBER=VALUE".
  std::optional<std::string> duration;
  bool json = false;
  bool live = false;
  bool headless = false;
  bool verbose = false;
  std::string listen;  ///< Where skills on other machines publish; empty: nowhere.
  bool insecure = false;
  std::string record;  ///< Recording to write; empty: a new one in the folder of recordings.
  bool no_record = false;
  std::string durable;  ///< The run can be resumed: never, interval or each, when its journal reaches the disk; "true"
                        ///< for the usual way, empty as the project says.
  std::optional<std::string> resume;  ///< Go on with the run of this recording, or with the last one (empty).
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;  ///< With `resume`.
  bool processes = false;  ///< Each skill and component in a process of its own.
  std::string studio;  ///< Where the web page is served, [HOST:]PORT, or "true" for the usual place; empty: nowhere.
  bool studio_exit = false;  ///< The page ends with the run.
  bool open = false;         ///< Show the page in a browser.
  bool paused = false;       ///< The run stands at its beginning until the page lets it go on.
  std::string groot;     ///< Where the run is shown to Groot, [HOST:]PORT, or "true" for the usual place; empty: as the
                         ///< project says.
  std::string foxglove;  ///< Where the run is shown in Foxglove, [HOST:]PORT, or "true" for the usual place; empty:
                         ///< nowhere.
  std::string yarp_server;  ///< Where a name server of YARP listens, HOST:PORT, or "true" where it is configured;
                            ///< empty: nowhere.
};
int run(const RunCommand& command);

struct StudioCommand {
  std::string recording;              ///< Empty: with `attach`.
  std::optional<std::string> attach;  ///< A process id, the address of a page, or empty: the only run there is.
  std::vector<std::string> diff;      ///< Empty, or what was and what is: files, folders, recordings.
  std::string at;                     ///< Where the page is served, [HOST:]PORT; empty: the usual place.
  bool insecure = false;
  bool open = false;
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;
  std::string groot;    ///< Where the recording is played to Groot, as in `RunCommand`; empty: nowhere.
  double factor = 1.0;  ///< Recorded seconds per second, for Groot.
};
int studio(const StudioCommand& command);
/// Its `--attach`.
int attach(const StudioCommand& command);

/// A program with BehaviorTree.CPP that executes a tree.
struct WatchCommand {
  std::string address;  ///< Of its Groot 2 publisher.
  std::string studio;   ///< As in `RunCommand`.
  std::string record;
  bool no_record = false;
  std::string duration;  ///< Empty: until interrupted.
  bool open = false;
  bool insecure = false;
  bool verbose = false;
};
int watch(const WatchCommand& command);

struct InfoCommand {
  std::string file;
  bool json = false;
};
int info(const InfoCommand& command);

struct ExportCommand {
  std::string file;
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;
  std::string format;  ///< csv, ndjson, scenario, perfetto, btlog or fbl.
  std::string output;  ///< Empty: standard output.
};
int export_recording(const ExportCommand& command);

struct ReportCommand {
  std::string file;
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;
  std::string output;  ///< Empty: standard output.
};
int report(const ReportCommand& command);

struct ReplayCommand {
  std::string file;
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;
  std::string project;  ///< Empty: the recorded one.
  bool go_on = false;
  std::string at;    ///< Print the state at this moment; empty: replay.
  std::string from;  ///< Go on in the simulator from this moment.
  bool json = false;
  bool verbose = false;
};
int replay(const ReplayCommand& command);

struct MonitorCheckCommand {
  std::string file;
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;
  std::string project;                    ///< Whose monitors, if none are given; empty: the recorded one's.
  std::vector<std::string> monitors;      ///< Charts.
  std::vector<std::string> violated;      ///< States of them whose entry is a violation.
  std::vector<std::string> requirements;  ///< Requirement files.
  bool json = false;
};
int monitor_check(const MonitorCheckCommand& command);

struct TestCommand {
  std::vector<std::string> paths = {"."};  ///< Projects, and scenario files.
  std::vector<std::string> scenarios;      ///< Names in the projects; empty: all.
  bool strict = false;                     ///< A monitor that was not put to the test is a failure.
  bool json = false;
};
int test(const TestCommand& command);

struct VerifyCommand {
  std::string project = ".";
  std::string scenario;           ///< A file whose overrides and timeline apply; empty: none.
  std::vector<std::string> only;  ///< Requirements and monitors; empty: all.
  std::string order = "any";      ///< any or virtual.
  bool all_orders = false;        ///< Also those that nothing tells apart.
  std::string faults;  ///< "none": those of `verify:` are left out; a file: those of its `faults:` come instead.
  std::optional<std::uint64_t> ticks;
  std::optional<std::uint64_t> states;
  std::optional<std::string> memory;  ///< "2 GB".
  std::optional<std::string> time;
  bool fair = false;
  bool explain = false;
  bool json = false;
  std::string out;                    ///< Folder of counterexamples; empty: verify/ in the project.
  std::string graph;                  ///< File for the graph: .aut or .dot.
  std::optional<std::uint64_t> runs;  ///< Statistics instead: so many runs.
  std::string confidence = "95%";
  std::string at_least;  ///< A sequential test: that each requirement holds in at least that share of runs.
  std::uint64_t seed = 1;
  std::string split;        ///< Statistics of what is rare: MODEL.DATA or owed, by which runs are split; empty: not so.
  std::size_t threads = 1;  ///< For judging and statistics; what comes out is the same.
  bool no_memory = false;   ///< Every step of a chart is executed.
  bool exact = false;       ///< States are compared, not their hashes; replies as they are.
  bool model = false;       ///< Only write models of services that have none.
  bool mutate = false;      ///< Only tell which small changes no requirement notices.
  std::string against;      ///< A recording: only tell which of its replies the models do not allow.
  std::string tolerance;    ///< How much earlier or later they may be; empty: the mission's period.
};
int verify(const VerifyCommand& command);

/// What trees are looked at with, beside the files themselves.
struct TreeOptions {
  std::vector<std::string> palettes;  ///< Files whose TreeNodesModel says what nodes are.
  std::vector<std::string> packages;  ///< Folders with ROS packages, for `<include ros_pkg=…>`.
};

struct CheckCommand {
  std::vector<std::string> files;  ///< Projects, files of any kind, folders; none: the project here.
  TreeOptions trees;
  bool json = false;
};
int check(const CheckCommand& command);

struct GraphCommand {
  std::vector<std::string> files;  ///< A project, world or chart; or trees, which are drawn together.
  TreeOptions trees;
  std::string format;  ///< svg, png, dot, mermaid or plantuml; empty: by the output's ending, else svg.
  std::string output;  ///< Empty: standard output.
  std::string tree;
  std::string direction = "auto";  ///< Of a tree: down, right, or auto.
  std::vector<std::string> stops;  ///< World: where robots are sent, PLACE or ROBOT=PLACE …
  std::string after;               ///< … and how long after the start it is drawn.
  std::uint64_t seed = 1;
};
int graph(const GraphCommand& command);

struct FmtCommand {
  std::vector<std::string> files;  ///< Files, folders, or "-" for standard input.
  TreeOptions trees;
  bool check = false;
  bool json = false;
};
int fmt(const FmtCommand& command);

/// The language server, over standard input and output.
int lsp();

struct DiffCommand {
  std::string before;  ///< A file, a folder, or "-" for standard input.
  std::string after;
  TreeOptions trees;
  bool json = false;
};
int diff(const DiffCommand& command);

struct ModelCommand {
  std::vector<std::string> files;  ///< A project; or trees, folders of trees. None: the project here.
  TreeOptions trees;
  std::string output;  ///< Empty: standard output.
  std::string into;    ///< A tree whose TreeNodesModel is brought up to date.
  bool json = false;
};
int model(const ModelCommand& command);

struct ChartCommand {
  std::string file;
  std::vector<std::string> data;  ///< NAME=VALUE, the value as JSON or text.
  std::string script_max = "2 s";
  std::uint64_t seed = 1;
  bool json = false;
};
int chart(const ChartCommand& command);

struct CallCommand {
  std::string service;  ///< A service of a running mission, or an address.
  std::string method;
  std::vector<std::string> arguments;  ///< name=value, or one JSON object.
  std::string interface;               ///< FILE.thrift/SERVICE, for an address.
  std::string run;                     ///< Process id of the run; empty: the only one.
  std::string deadline = "1 s";
  bool feedback = false;  ///< Of the action whose goal is sent.
};
int call(const CallCommand& command);

/// What the services of a running mission are, and whether they answer.
struct ServicesCommand {
  std::string run;
  std::string on;  ///< A network, "yarp:"; empty: a run.
  bool json = false;
};
int services(const ServicesCommand& command);

struct PingCommand {
  std::string target;  ///< A service of the run, an address, or empty: the run and all its services.
  std::string run;
  bool json = false;
};
int ping(const PingCommand& command);

/// The observations of a running mission as they come.
struct EchoCommand {
  std::string pattern = "*";
  std::string run;
  std::uint64_t count = 0;  ///< Ends after so many; 0: with the run.
  bool json = false;
};
int echo(const EchoCommand& command);

struct MonitorServeCommand {
  std::string project;
  std::string name;
  std::string listen;
  std::string of_run;  ///< The file by which the durable run that started it is known; empty: none.
  bool insecure = false;
};
int monitor_serve(const MonitorServeCommand& command);

struct BenchRpcCommand {
  std::string over = "unix";  ///< Or "yarp".
  int calls = 20'000;
  std::string listen;  ///< Serves there instead; how it starts its other process.
  bool json = false;
};
int bench_rpc(const BenchRpcCommand& command);

struct SynthCommand {
  std::string file;
  std::string output;
  std::string project;  ///< Whose services and leaves the requirements are about; empty: the one above the file.
};
int monitor_synth(const SynthCommand& command);

struct InitCommand {
  std::string folder;
};
int init(const InitCommand& command);

struct AddCommand {
  std::string kind;  ///< skill, monitor, requirement, scenario or component.
  std::string name;
  std::string project = ".";
};
int add(const AddCommand& command);

struct SkillCommand {
  std::string project = ".";
  std::string leaf;
  std::string listen;
  std::string observer;
  std::vector<std::string> at;  ///< SERVICE=ADDRESS
  double factor = 1.0;
  std::uint64_t seed = 1;
  std::string of_run;  ///< The file by which the durable run that started it is known; empty: none.
  bool insecure = false;
};
int skill(const SkillCommand& command);

struct ComponentCommand {
  std::string name;
  std::string project;
  std::string world;
  std::string listen;
  double factor = 1.0;
  std::uint64_t seed = 1;
  std::string of_run;  ///< The file by which the durable run that started it is known; empty: none.
  bool insecure = false;
};
int component(const ComponentCommand& command);

struct SimCommand {
  std::string world;
  std::string at;      ///< Address for other programs; empty: the control socket only.
  double speed = 1.0;  ///< Simulated seconds per second; 0: as fast as the machine allows.
  std::uint64_t seed = 1;
  std::string duration;            ///< Of simulated time; empty: until interrupted.
  std::vector<std::string> stops;  ///< PLACE or ROBOT=PLACE.
  bool json = false;
  bool headless = false;
  bool insecure = false;
  bool yarp = false;  ///< Serve it as ports of YARP.
  bool ros = false;   ///< Serve it as services of ROS 2.
};
int sim(const SimCommand& command);

struct DoctorCommand {
  bool json = false;
};
int doctor(const DoctorCommand& command);
/// What `doctor` finds, as it prints it with --json.
[[nodiscard]] Value examine_machine();

struct BugReportCommand {
  std::string recording;  ///< Empty: none.
  std::string output;     ///< Empty: sentree-bug-report-DATE.tar.gz.
};
int bug_report(const BugReportCommand& command);

}  // namespace sentree::cli
