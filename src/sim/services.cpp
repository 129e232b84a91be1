#include "sentree/sim/services.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "sentree/sim/detail/service_handlers.h"
#include "sentree/sim/simulation.h"

namespace sentree::sim {

namespace {

struct Service {
  std::string_view name;
  std::span<const Method> methods;
  bool looks_at_scans = false;
  bool is_test_control = false;
};

std::span<const Service> table() {
  static const std::vector<Service> kServices{
      {"Navigation", navigation_methods()},
      {"Localization", localization_methods()},
      {"MapServer", map_server_methods()},
      {"Battery", battery_methods()},
      {"Laser", laser_methods(), true},
      {"Base", base_methods()},
      {"Simulation", simulation_methods(), true, true},
  };
  return kServices;
}

}  // namespace

std::span<const ServiceInfo> services() {
  static const std::vector<ServiceInfo> kInfos = [] {
    std::vector<ServiceInfo> infos;
    for (const Service& service : table()) {
      ServiceInfo info{.name = service.name, .is_test_control = service.is_test_control};
      for (const Method& method : service.methods) info.methods.push_back(method.name);
      infos.push_back(std::move(info));
    }
    return infos;
  }();
  return kInfos;
}

const ServiceInfo* find_service(std::string_view name) {
  for (const ServiceInfo& info : services()) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

Result<Value> call(const World& world, State& state, Call call, TimePoint now) {
  auto result = call_uncast(world, state, std::move(call), now);
  cast_scans(world, state);
  return result;
}

Result<Value> call_uncast(const World& world, State& state, Call call, TimePoint now) {
  const auto robot = world.robot(call.robot);
  if (!robot) {
    std::vector<std::string> names;
    for (const RobotSpec& spec : world.robots) names.push_back(spec.name);
    return fail("sim.unknown-robot",
                fmt::format("the world has no robot \"{}\"{}", call.robot, did_you_mean(call.robot, names)));
  }
  for (const Service& service : table()) {
    if (service.name != call.service) continue;
    for (const Method& method : service.methods) {
      if (method.name != call.method) continue;
      advance_uncast(world, state, now);
      if (service.looks_at_scans) cast_scans(world, state);
      Arguments arguments(call.args);
      Value result = method.handler({world, state, *robot, arguments, now, call.former});
      if (arguments.problem().empty()) return result;
      return fail("sim.bad-argument", fmt::format("{}.{}: {}", service.name, method.name, arguments.problem()));
    }
    std::vector<std::string> names;
    for (const Method& method : service.methods) names.emplace_back(method.name);
    return fail("sim.unknown-method", fmt::format("service {} has no method \"{}\"{}", service.name, call.method,
                                                  did_you_mean(call.method, names)));
  }
  std::vector<std::string> names;
  for (const Service& service : table()) names.emplace_back(service.name);
  return fail("sim.unknown-service",
              fmt::format("the simulator has no service \"{}\"{}", call.service, did_you_mean(call.service, names)));
}

}  // namespace sentree::sim
