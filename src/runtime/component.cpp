#include "sentree/runtime/component.h"

#include <algorithm>

#include "sentree/sim/services.h"
#include "sentree/text/file.h"

namespace sentree::runtime {

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

// Adds what robot.thrift says of the simulator's interfaces: those in `wanted`, under these names, and test control.
void add_services(const idl::Schema& schema, const std::vector<std::pair<std::string, std::string>>& wanted,
                  SimComponent& component) {
  for (const auto& [name, interface] : wanted) {
    if (auto service = schema.service(interface)) component.services.push_back({name, interface, std::move(service)});
  }
  if (auto control = schema.service("Simulation"))
    component.services.push_back({std::string(kTestControl), "Simulation", std::move(control)});
}

std::optional<idl::Schema> robot_schema(Diagnostics& diagnostics) {
  const auto source = text::read_file(shipped_folder("interfaces") / "robot.thrift", "robot.thrift");
  if (!source) {
    diagnostics.push_back(source.error());
    return std::nullopt;
  }
  auto schema = idl::Schema::load(*source, "robot.thrift");
  diagnostics.insert(diagnostics.end(), schema.diagnostics.begin(), schema.diagnostics.end());
  return std::move(schema.value);
}

}  // namespace

Loaded<SimComponent> prepare_sim(const Project& project) {
  Loaded<SimComponent> prepared;
  SimComponent component;
  if (!project.world) {
    prepared.diagnostics.push_back(
        {Severity::kError, "check.no-world", "the project has no world: FILE to simulate", SourceSpan{project.file}});
    return prepared;
  }
  auto world = load_project_world(project);
  prepared.diagnostics = std::move(world.diagnostics);
  const auto schema = robot_schema(prepared.diagnostics);
  if (!world.ok() || !schema) return prepared;
  component.world = std::make_shared<const sim::World>(std::move(*world.value));
  std::vector<std::pair<std::string, std::string>> wanted;
  for (const ServiceEntry& service : project.services) {
    const auto* info = sim::find_service(service.interface);
    if (info != nullptr && !info->is_test_control) wanted.emplace_back(service.name, service.interface);
  }
  add_services(*schema, wanted, component);
  prepared.value = std::move(component);
  return prepared;
}

Loaded<SimComponent> prepare_sim_world(const std::string& world_file) {
  Loaded<SimComponent> prepared;
  SimComponent component;
  auto world = sim::load_world(world_file);
  prepared.diagnostics = std::move(world.diagnostics);
  const auto schema = robot_schema(prepared.diagnostics);
  if (!world.ok() || !schema) return prepared;
  component.world = std::make_shared<const sim::World>(std::move(*world.value));
  std::vector<std::pair<std::string, std::string>> wanted;
  for (const sim::ServiceInfo& info : sim::services()) {
    if (!info.is_test_control) wanted.emplace_back(lower(info.name), std::string(info.name));
  }
  add_services(*schema, wanted, component);
  prepared.value = std::move(component);
  return prepared;
}

SimServer::SimServer(SimComponent component, std::uint64_t seed, double factor)
    : clock_(make_real_clock(factor)), host_(std::make_unique<SimHost>(component.world, seed, *clock_)) {
  for (SimComponent::Served& served : component.services) {
    auto service = std::make_shared<rpc::FunctionService>(
        served.service,
        [host = host_.get(), interface = served.interface](const idl::Method& method, const Value& arguments,
                                                           const rpc::CallContext&) -> rpc::Outcome {
          CallOutcome outcome = host->call(interface, method.name, arguments);
          if (outcome.ok) return std::move(outcome.result);
          return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, outcome.message, {}, {}});
        });
    services_.push_back({served.name, std::move(service)});
  }
}

}  // namespace sentree::runtime
