#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/pattern.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"
#include "sentree/project/intervention.h"
#include "sentree/project/loop.h"
#include "sentree/text/yaml.h"

namespace sentree::project {

/// Where a part of the project lives, as written, with its place for messages.
struct FileRef {
  std::string path;  ///< Relative to the project's folder.
  SourceSpan span;
  friend bool operator==(const FileRef&, const FileRef&) = default;
};

/// A topic that the simulator publishes again and again.
struct PublishedTopic {
  std::string method;
  Duration period{};
  SourceSpan span;
};

struct ServiceEntry {
  std::string name;
  std::string idl;        ///< Interface file: in the project's interfaces/, or one that Sentree ships.
  std::string interface;  ///< Name of the Thrift service in it.
  std::string at;         ///< "sim", "model", "topics" (nobody: all its methods are one-way), or an address.
  std::string robot;      ///< Of the world, for a service of the simulator; empty: the first.
  std::string observed;   ///< Where others are overheard, an address; `at` is "topics" then. Empty: it is a service.
  std::vector<PublishedTopic> publish = {};
  /// Methods that do the same when they are asked twice, beside those that the interface says are idempotent.
  std::vector<std::string> idempotent = {};
  SourceSpan idempotent_span = {};
  SourceSpan span;
};

/// Whether a service that is `at` there is part of the run, and no other program: "sim", "model", "topics".
[[nodiscard]] bool is_inside(std::string_view at);

/// When what a durable run has written reaches the disk itself, and so outlives the machine too.
enum class JournalSync : std::uint8_t {
  kNever,     ///< When the system likes: it outlives the process only.
  kInterval,  ///< Once a second.
  kEach,      ///< Before anything leaves the run that follows from it.
};
/// "never", "interval", "each"; else nothing.
[[nodiscard]] std::optional<JournalSync> parse_journal_sync(std::string_view text);

/// The topics that a chart subscribes to: SERVICE.METHOD of one-way methods.
struct Subscriptions {
  std::vector<std::string> topics;
  std::vector<std::string> latest = {};  ///< Those of them whose latest publication each run of a skill begins with.
  SourceSpan span;
  friend bool operator==(const Subscriptions&, const Subscriptions&) = default;
};

/// A chart that stands for components: it serves services that are at: model.
struct ModelEntry {
  std::string name;  ///< Default: the file's stem.
  FileRef file;
  std::vector<std::string> serves;  ///< Names of services.
  SourceSpan serves_span;
  Subscriptions subscribes;
  SourceSpan span;
  friend bool operator==(const ModelEntry&, const ModelEntry&) = default;
};

/// `verify:` what is tried beside what models leave open.
struct VerifySection {
  std::vector<Intervention> faults;  ///< That may come at any tick, and go again.
  std::vector<SourceSpan> fault_spans;
  std::size_t faults_at_most = 1;  ///< At a time.
  std::vector<std::string> fair;   ///< Choices "MODEL.NAME" that are fair.
  SourceSpan fair_span;
  SourceSpan span;
};

/// How a chart that was written for another runtime is ticked, and how it answers. It lives on between the runs of its
/// leaf.
struct SkillProtocol {
  using Meanings = std::vector<std::pair<std::string, bt::Status>>;

  // Events that it gets; empty: none.
  std::string start;        ///< When a run begins, before its first tick.
  std::string tick;         ///< With the input ports' present values.
  std::string halt;         ///< None: a halt leaves the chart where it is.
  std::string acknowledge;  ///< When SUCCESS or FAILURE has been told.
  // What answers a tick: an event that it sends to itself, or a state.
  std::string answer;
  std::string param;  ///< Of that event: the status. Empty: the event's data are the status.
  Meanings values;    ///< What the param's values, as text, mean.
  Meanings states;    ///< What it means that a state is entered, or active when a tick has been taken.
  /// Event that it sends, or state that it enters, when a halt is over. Empty: it is over at once.
  std::string halted;
  /// Where each is written, by its key in the file: "tick", "answer", "states.success" …
  std::map<std::string, SourceSpan> places;

  [[nodiscard]] std::optional<bt::Status> meaning(const Value& status) const;
  friend bool operator==(const SkillProtocol&, const SkillProtocol&) = default;
};

/// An entry of the main tree's blackboard that is there before the first tick: a number, true, false or a text.
struct MissionEntry {
  std::string name;
  Value value;
  SourceSpan span;
};

/// A constant of sentree.yaml that a chart's <data> of that id begins with.
struct SkillConstant {
  std::string id;
  Value value;
  SourceSpan span;
};
[[nodiscard]] Map initial_data(const std::vector<SkillConstant>& constants);

struct SkillEntry {
  std::string leaf;  ///< Name or ID of leaves.
  FileRef file;      ///< Empty path: skills/<leaf>.scxml.
  std::string at;    ///< Empty: a thread of the run; else an address.
  std::vector<SkillConstant> data = {};
  std::optional<SkillProtocol> protocol = {};  ///< Nothing: the chart is written for Sentree.
  Subscriptions subscribes = {};
  SourceSpan span;
};

/// Gives a chart written elsewhere the event names it knows: a source of its event `event`.
struct EventRename {
  std::string event;
  std::vector<std::string> on;    ///< Names of observations; '*' stands for any text.
  std::vector<std::string> from;  ///< Whose they must be, likewise; empty: anybody's.
  /// Members of the event's data and the ECMAScript expression, over the observation's data, of each.
  std::vector<std::pair<std::string, std::string>> data;
  std::string when;  ///< Empty: always; "changed", or an expression over `value` and `last`.
  SourceSpan span;
  SourceSpan from_span;
  friend bool operator==(const EventRename&, const EventRename&) = default;
};

struct MonitorEntry {
  std::string name;  ///< Default: the file's stem.
  FileRef file;
  std::string requirement;            ///< Which requirement of a .req file; empty: the file is a chart.
  std::vector<std::string> violated;  ///< States whose entry is a violation, besides <final id="violated">.
  std::vector<EventRename> events;
  /// Requests that it may refuse before they are sent, "<service>.<method>"; '*' stands for any text.
  std::vector<std::string> gate;
  SourceSpan gate_span;
  std::string at;  ///< Empty: in the run; else the address of the process that runs it (`sentree monitor`).
  SourceSpan span;
  friend bool operator==(const MonitorEntry&, const MonitorEntry&) = default;
};

/// An observer in another process: interfaces/observer.thrift.
struct ObserverEntry {
  std::string name;
  std::string at;
  SourceSpan span;
};

/// How long the machine may take, in wall time; they bound faults, not the mission. A loaded project has all of them.
struct Deadlines {
  Duration call{0};                         ///< One service call; by default 40 % of the budget.
  Duration condition{0};                    ///< A condition's run; past it, FAILURE. By default 80 % of the budget.
  Duration budget{0};                       ///< A whole tick; by default one period.
  Duration halt = std::chrono::seconds(2);  ///< From `halt` to `halted`; past it, the run is cancelled.
  Duration unresponsive = std::chrono::seconds(2);  ///< An action that does not answer ticks; past it, FAILURE.
  /// Processor time of one step of a chart; past it, its skill or monitor is given up.
  Duration script = std::chrono::seconds(2);
};

/// `sentree.yaml`, read but not yet followed: what belongs together.
struct Project {
  std::filesystem::path folder;
  std::string file;  ///< As shown in messages: "examples/recharge/sentree.yaml".

  FileRef mission;
  /// All files with trees of the mission, `mission` among them, if `mission: {files: …}` gives several: SubTrees are
  /// found in each of them.
  std::vector<FileRef> mission_files;
  std::string tree;  ///< Tree to execute; empty: the file's main_tree_to_execute.
  Duration period = std::chrono::milliseconds(100);
  bool repeat = false;
  std::vector<MissionEntry> entries;  ///< Each name once.
  /// Who executes the mission, if that is another program, which is only watched: its leaves need no skills here.
  std::string executed_by;
  std::vector<ServiceEntry> services;
  std::vector<ModelEntry> models;
  VerifySection verify;
  std::vector<SkillEntry> skills;
  std::map<std::string, SkillProtocol> protocols;  ///< Those that several skills share, by name.
  std::vector<MonitorEntry> monitors;
  std::vector<ObserverEntry> observers;
  std::vector<FileRef> palettes;  ///< Files whose TreeNodesModel says what nodes are.
  std::vector<FileRef> packages;  ///< Folders with ROS packages, for `<include ros_pkg=…>`; beside those of ROS itself.
  std::vector<FileRef> plugins;  ///< Shared libraries with C++ nodes for the tree.
  Deadlines deadlines;
  std::optional<FileRef> world;
  /// Where runs in real time are shown to Groot: "true" for the usual place, a port, or HOST:PORT; empty: nowhere.
  std::string groot;
  SourceSpan groot_span;
  std::string foxglove;  ///< Likewise, to Foxglove.
  SourceSpan foxglove_span;
  /// Where runs in real time bring a name server of YARP, if none answers: "true" for where one is configured, or
  /// HOST:PORT; empty: they bring none.
  std::string yarp_server;
  SourceSpan yarp_server_span;
  /// Runs keep a journal, from which `sentree run --resume` goes on; nothing: only if the command says so.
  std::optional<JournalSync> durable;
  /// Changes to the world file's content, from a scenario: merged over it, mapping by mapping.
  std::optional<text::YamlNode> world_overrides;
  /// Hashes of the files that were read for it, with the scenario's.
  std::set<std::uint64_t> contents;

  [[nodiscard]] const ServiceEntry* service(std::string_view name) const;
  /// The entry for a leaf: by its name, else by its ID, else null.
  [[nodiscard]] const SkillEntry* skill(std::string_view leaf_name, std::string_view leaf_id) const;
  /// `path` as shown in messages, with the project's folder before it.
  [[nodiscard]] std::string shown(std::string_view path) const;
};

/// What happens at a given time of a scenario.
struct Injection {
  TimePoint at{};
  Intervention what;
  std::string source = "scenario";  ///< Who did it, as its observation says.
  SourceSpan span;
  bool again = false;  ///< In a later round of the scenario's loop: see `unroll`.
};

/// Which alternative of a choice of a model comes.
struct ScenarioChoice {
  std::string model;
  std::uint64_t number = 0;  ///< Among the model's choices in the run, from 1.
  std::string name;          ///< Of pick('NAME', …); for people.
  Value value;
  std::uint64_t tick = 0;  ///< In which it is made; for people.
  std::string place = {};  ///< Where it stands, "models/robot.scxml:31"; for people.
  SourceSpan span;
  friend bool operator==(const ScenarioChoice&, const ScenarioChoice&) = default;
};

/// Which part gets its message first where several parts have messages that are due at one instant.
struct ScenarioOrder {
  std::uint64_t number = 0;  ///< Among such instants of the run, from 1.
  std::string first;         ///< A leaf, a model or the mission, by name.
  std::uint64_t tick = 0;    ///< In which it is; for people.
  SourceSpan span;
  friend bool operator==(const ScenarioOrder&, const ScenarioOrder&) = default;
};

/// A message held back, as a slow machine or network would.
struct DelayFault {
  std::string message;  ///< As that of `intervention::Delay`.
  Duration by{};
  SourceSpan span;
};

/// Files that the patterns of `mission: {files: …}` may name together.
inline constexpr std::size_t kMissionFilesMax = 1'000;
/// Most restarts of one process within a minute that a scenario may allow.
inline constexpr int kRestartsMax = 100;

/// A part of the scenario that runs in a process of its own.
struct ProcessEntry {
  std::string name;
  std::string component;  ///< "sim", or empty.
  std::string skill;      ///< Leaf name or ID, or empty.
  std::string monitor;    ///< Name of a monitor of the project, or empty.
  int restarts = 0;       ///< How often it is started again when it ends, within a minute.
  std::string listen;     ///< Address; what is "{run}" in it becomes a private folder of the run.
  SourceSpan span;
};

/// A project plus a timeline of injections, and what to expect.
struct Scenario {
  std::string name;
  std::string description;
  std::string file;
  Project project;  ///< With the scenario's overrides applied.

  bool virtual_time = true;
  double factor = 1.0;  ///< Run seconds per wall second, in real time.
  std::uint64_t seed = 1;
  Duration duration = std::chrono::minutes(10);  ///< The run ends here if nothing ended it before.
  bool stop_when_violated = false;
  std::vector<Injection> timeline;
  std::vector<DelayFault> delays;
  /// What models choose: where nothing is said, the first alternative. Nothing: all of it is drawn.
  std::optional<std::vector<ScenarioChoice>> choices;
  /// Where nothing is said: the order of virtual time.
  std::vector<ScenarioOrder> orders;
  std::optional<ScenarioLoop> loop;
  std::vector<ProcessEntry> processes;

  /// Expected mission status (SUCCESS, FAILURE, RUNNING) and verdicts by monitor (violated, satisfied, undecided, or
  /// owed: undecided, and something is owed in the end).
  std::optional<std::string> mission;
  std::string mission_reason;  ///< Text that some output `reason` of the failed leaf must contain; empty: any.
  std::map<std::string, std::string> verdicts;
  bool distinct_processes = false;  ///< Every process of `processes`, and the run itself, has a process id of its own.
  SourceSpan expect_span;
  /// From now on anything may come out.
  void expect_nothing();

  /// The file as it was read; null for a project without one.
  text::YamlNode source;
};

/// The file `sentree.yaml` of a folder, or the file itself. All problems at once.
/// Codes: project.*, yaml.*, file.*.
[[nodiscard]] Loaded<Project> load_project(const std::filesystem::path& folder_or_file);

/// A scenario file with its project (default: the sentree.yaml one folder above the scenario's). Where that is `known`,
/// which has been read and told of already, it is not read again.
[[nodiscard]] Loaded<Scenario> load_scenario(const std::filesystem::path& file, const Project* known = nullptr);

/// The same over a project that it does not lie in, whatever project it names.
[[nodiscard]] Loaded<Scenario> load_scenario_of(const Project& project, const std::filesystem::path& file);

/// The scenario of a project that has no timeline and expects nothing.
[[nodiscard]] Scenario plain_scenario(Project project);

/// The scenario files of a project's `scenarios/` folder, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> scenario_files(const Project& project);

/// "10 Hz" as a period, "40 ms" / "2 s" / "5 min" as a duration of up to ten years.
[[nodiscard]] std::optional<Duration> parse_rate(std::string_view text);
[[nodiscard]] std::optional<Duration> parse_duration(std::string_view text);

using sentree::matches_pattern;

}  // namespace sentree::project
