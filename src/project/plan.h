#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/idl/schema.h"
#include "sentree/monitor/monitor.h"
#include "sentree/project/project.h"
#include "sentree/scxml/chart.h"
#include "sentree/sim/world.h"

namespace sentree::project {

/// Name under which scenarios, and nobody else, reach the simulator's test control.
inline constexpr std::string_view kTestControl = "simulation";
/// Names of the test control of a world: `kTestControl`, and where there are several robots "ROBOT/simulation" for
/// each. The robot that a name means (empty: the first), or nothing if it is no such name.
[[nodiscard]] std::optional<std::string> test_control_of(std::string_view name, const sim::World& world);
[[nodiscard]] std::vector<std::string> test_control_names(const sim::World& world);
/// Names that observations use for themselves: neither leaves nor services may have them.
inline constexpr std::string_view kReservedNames[] = {"mission", "scenario",   "monitor", "node",
                                                      "process", kTestControl, "error",   "done"};

struct LeafPlan {
  bt::NodeId node = bt::kNoNode;
  std::string name;  ///< In messages: `bt::Tree::event_name`.
  std::string id;
  bool condition = false;
  /// Nothing for a skill at an address that the project has no chart of: one in another language.
  std::optional<scxml::Chart> chart;
  std::string at;  ///< Address of the process that runs it; empty: a thread of this one.
  std::vector<SkillConstant> constants = {};
  std::optional<SkillProtocol> protocol = {};
  std::vector<std::string> subscribes = {};  ///< Topics.
  std::vector<std::string> latest = {};      ///< Those of them whose latest publication each run begins with.
};

struct ServicePlan {
  std::string name;
  idl::ServicePtr service;
  std::string interface;
  std::string at;                            ///< "sim", "model", "topics" or an address.
  std::string robot;                         ///< Of the simulated world; empty: the first.
  std::vector<std::string> idempotent = {};  ///< Methods, beside those that the interface says are.
  std::string observed = {};                 ///< Where others are overheard, an address; empty: it is a service.

  [[nodiscard]] bool is_idempotent(const idl::Method& method) const;
  /// At an address of another scheme than those of Thrift: "yarp:", "ros:".
  [[nodiscard]] bool uses_other_middleware() const;
};

/// Whether the chart, or one that it invokes, may call the service.
[[nodiscard]] bool may_call(const scxml::Chart& chart, std::string_view service);

/// A chart that serves services of the run, or publishes and subscribes to topics.
struct ModelPlan {
  std::string name;
  std::string file;  ///< As the project names it.
  scxml::Chart chart;
  std::vector<std::string> serves;      ///< Those of its services that are at: model.
  std::vector<std::string> subscribes;  ///< Topics.
};

/// A monitor that is asked before requests are sent.
struct GatePlan {
  std::size_t monitor = 0;            ///< Index in `Plan::monitors`.
  std::vector<std::string> requests;  ///< "<service>.<method>" with '*' for any text.
};

/// An observer, or a monitor, that runs in another process.
struct ObserverPlan {
  std::string name;
  std::string at;
  bool is_monitor = false;
};

/// A scenario with everything that its project names, loaded and checked against each other.
struct Plan {
  Scenario scenario;
  bt::Tree tree;
  std::vector<LeafPlan> leaves;  ///< External leaves, in the order of the tree.
  std::map<std::string, ServicePlan> services;
  std::vector<ModelPlan> models;  ///< But for those whose services are all elsewhere.
  idl::ServicePtr test_control;   ///< The Simulation interface; null without a world.
  std::vector<monitor::Model> monitors;
  std::vector<GatePlan> gates;
  std::vector<ObserverPlan> observers;
  std::shared_ptr<const sim::World> world;  ///< Null: the project has none.
  Diagnostics warnings;
  /// Of the contents of all files that were read for it, wherever they lie, the seed and the speed of time: plans of
  /// one identity run alike. Plug-ins, which are code, are not looked at.
  std::uint64_t identity = 0;
};

/// Follows a scenario's project: mission, skills, interfaces, monitors and world, and checks what each says of the
/// others. Reports every problem of the project at once, sorted by place.
/// Codes: those of the libraries, and check.*.
[[nodiscard]] Loaded<Plan> prepare(Scenario scenario);

/// Everything that is wrong with a project and its scenarios, each finding once. Codes: those of `load_project`,
/// `load_scenario` and `prepare`.
[[nodiscard]] Diagnostics check_project(const std::filesystem::path& folder_or_file);

/// Registers the C++ nodes of the project's plug-ins. False: one of them cannot be loaded.
/// Codes: those of `bt::Registry::plugin`, where sentree.yaml names the file.
bool load_plugins(const Project& project, bt::Registry& registry, Diagnostics& diagnostics);

/// The project's world with the scenario's changes to it. Codes: sim.*, map.*, file.*.
[[nodiscard]] Loaded<sim::World> load_project_world(const Project& project);

/// What a project observes: its services, leaves and nodes, and the calls of its skills. Codes: as `prepare`.
[[nodiscard]] Loaded<monitor::Vocabulary> load_vocabulary(const Project& project);

/// The parts of a plan that one skill in a process of its own needs: the chart and the services.
struct SkillPlan {
  scxml::Chart chart;
  std::map<std::string, ServicePlan> services;
  bool condition = false;
  std::string id;
  Deadlines deadlines;
  std::vector<SkillConstant> constants = {};
  std::optional<SkillProtocol> protocol = {};
  /// What the tree gives its input ports as constants; of an ID, what all its leaves are given alike.
  Map inputs = {};
  /// Input ports that have no value there, nor one of the chart's own.
  std::vector<std::string> without = {};
};
/// @param leaf  Name or ID of a leaf.
[[nodiscard]] Loaded<SkillPlan> prepare_skill(const Project& project, const std::string& leaf);

/// The parts of a plan that one monitor in a process of its own needs.
struct MonitorPlan {
  monitor::Model model;
  std::vector<std::string> gate;
};
[[nodiscard]] Loaded<MonitorPlan> prepare_monitor(const Project& project, const std::string& name);

/// Where the interfaces, skills and examples that come with Sentree are: share/sentree beside the program's bin/, else
/// in one of $XDG_DATA_DIRS. Empty if they are not found.
[[nodiscard]] std::filesystem::path shipped_folder(std::string_view what);

}  // namespace sentree::project
