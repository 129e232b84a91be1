#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "sentree/rpc/server.h"
#include "sentree/runtime/elsewhere.h"
#include "sentree/runtime/local_skill.h"

namespace sentree::processes {

/// The interfaces in interfaces/skill.thrift, robot.thrift and observer.thrift. Error: file.not-found where Sentree is
/// not installed whole.
[[nodiscard]] Result<idl::ServicePtr> skill_interface();
/// What this program serves of a skill: `skill_interface`, the ticks of programs that know neither leaves nor runs,
/// steps for runs that keep its state, and what it remembers for those that are recorded.
[[nodiscard]] Result<idl::ServicePtr> served_skill_interface();
/// What `sentree component sim` serves as test control.
[[nodiscard]] Result<idl::ServicePtr> kept_simulation_interface();
[[nodiscard]] Result<idl::ServicePtr> observer_interface();
[[nodiscard]] Result<idl::ServicePtr> kept_observer_interface();

/// Carries a leaf's ticks and halts to a skill in another process. A skill that cannot be reached fails its leaf.
struct RemoteSkillOptions {
  std::string leaf;
  bool condition = false;
  rpc::Address address;
  idl::ServicePtr interface;
  idl::ServicePtr memory_interface = {};  ///< With a method `remember`; null: it is not asked what it remembers.
  Duration tick_deadline{};               ///< Wall time.
  Duration halt_deadline{};               ///< Wall time.
};
/// Its answers come from a thread of its own.
class RemoteLeafDriver : public runtime::LeafDriver {
 public:
  /// Once this returns, nobody is answered any more. When the mission's actor has stopped.
  virtual void close() = 0;
  /// Asks the skill what it remembers, over a connection of its own. `told` is called once, within a second, from any
  /// thread; not after `close`.
  virtual void remember(std::function<void(runtime::ToldMemory)> told) = 0;
};
[[nodiscard]] Result<std::unique_ptr<RemoteLeafDriver>> make_remote_skill(RemoteSkillOptions options,
                                                                          runtime::LeafReplies replies);

/// Lets other processes publish into the run's stream: serves interfaces/observer.thrift.
[[nodiscard]] std::shared_ptr<rpc::Service> make_observer_service(idl::ServicePtr interface,
                                                                  runtime::Publisher& publisher);

/// Publishes into the stream of a run elsewhere, so that a request is in the run's total order before it is sent:
/// through the run's ObservationInbox if that is on this machine and nobody gates the request, else by calls.
[[nodiscard]] Result<std::unique_ptr<runtime::Publisher>> make_remote_publisher(
    const rpc::Address& observer, idl::ServicePtr interface, std::string_view self,
    std::function<void(const std::string&)> problem);

/// A publisher for a skill that nobody observes.
[[nodiscard]] std::unique_ptr<runtime::Publisher> make_silent_publisher();

/// Serves the skill of a plan: one actor a leaf, made when the leaf first ticks.
struct SkillServerOptions {
  double factor = 1.0;
  std::uint64_t seed = 1;
  std::vector<project::DelayFault>
      delays;  ///< Of the scenario; those that concern calls and halts of this skill apply.
  std::function<void(const std::string&)> problem;
  std::function<void(const std::string& leaf, const scxml::LogLine&)> log;
};
/// Leaves that one skill server runs at most.
inline constexpr std::size_t kServedLeavesMax = 1000;
[[nodiscard]] std::shared_ptr<rpc::Service> make_skill_service(const project::SkillPlan& plan,
                                                               idl::ServicePtr interface, runtime::Publisher& publisher,
                                                               runtime::Scheduler& scheduler,
                                                               SkillServerOptions options);

}  // namespace sentree::processes
