#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sentree/processes/control.h"
#include "sentree/project/plan.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/tap.h"

namespace sentree::processes {

/// What the simulator serves from a process of its own: its services by name.
struct SimComponent {
  std::shared_ptr<const sim::World> world;
  struct Served {
    std::string name;       ///< As clients ask for it.
    std::string interface;  ///< In robot.thrift.
    std::string robot;      ///< Of the world; empty: the first.
    idl::ServicePtr service;
    idl::ServicePtr kept = {};  ///< What is served of test control beside: `service` and `remember`; null: nothing.
  };
  std::vector<Served> services;  ///< Test control among them.
};

/// The simulated services of a project, by their names in it.
[[nodiscard]] Loaded<SimComponent> prepare_sim(const project::Project& project);
/// All services that the simulator has, by their interfaces' names in lower case: "battery"; with several robots in the
/// world "ROBOT/battery" for each.
[[nodiscard]] Loaded<SimComponent> prepare_sim_world(const std::string& world_file);

/// A simulator with its own clock, ready to be served.
class SimServer {
 public:
  /// @param say  Hears, from a thread of the server, that simulated time falls behind the clock.
  SimServer(
      SimComponent component, std::uint64_t seed, double factor,
      std::function<void(const std::string&)> say = [](const std::string&) {});
  [[nodiscard]] std::vector<rpc::NamedService> services() const { return services_; }
  /// For the control socket, by the same names; valid while this lives. What is observed are the calls, from there and
  /// of `services()`.
  [[nodiscard]] runtime::ControlHandler control(std::string world_file);
  /// That service is served there too, which the control socket tells from now on. From any thread.
  void tell_address(const std::string& service, std::string address);
  [[nodiscard]] runtime::SimHost& host() { return *host_; }
  [[nodiscard]] const Clock& clock() const { return *clock_; }

 private:
  // One that is checked.
  [[nodiscard]] mission::CallOutcome call(const SimComponent::Served& served, const idl::Method& method,
                                          const Value& arguments, const std::string& source);
  void observe(Message message);
  // "sim", if it is served nowhere else.
  [[nodiscard]] std::string addresses_of(const std::string& service) const;

  std::unique_ptr<Clock> clock_;
  std::unique_ptr<runtime::SimHost> host_;
  runtime::Tap tap_;
  mutable std::mutex mutex_;  // of what follows
  std::uint64_t observed_ = 0;
  std::uint64_t calls_ = 0;
  std::map<std::string, std::string> addresses_;  // by service

  std::vector<SimComponent::Served> served_;
  std::vector<rpc::NamedService> services_;
};

}  // namespace sentree::processes
