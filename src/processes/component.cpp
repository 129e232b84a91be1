#include "sentree/processes/component.h"

#include <algorithm>

#include <fmt/format.h>

#include "sentree/idl/conform.h"
#include "sentree/mission/memory_elsewhere.h"
#include "sentree/processes/wire_message.h"
#include "sentree/sim/services.h"
#include "sentree/text/file.h"

namespace sentree::processes {

using runtime::ControlHandler;

namespace {

// Half of a call's deadline where the project says nothing.
constexpr std::chrono::milliseconds kWork{20};
// Wall time by which what calls see may lag behind the clock.
constexpr double kLag_s = 0.25;

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

void add_service(const idl::Schema& schema, const std::string& name, const std::string& interface,
                 const std::string& robot, SimComponent& component) {
  if (auto service = schema.service(interface))
    component.services.push_back({name, interface, robot, std::move(service)});
}

std::optional<idl::Schema> robot_schema(Diagnostics& diagnostics) {
  const auto source = text::read_file(project::shipped_folder("interfaces") / "robot.thrift", "robot.thrift");
  if (!source) {
    diagnostics.push_back(source.error());
    return std::nullopt;
  }
  auto schema = idl::Schema::load(*source, "robot.thrift");
  diagnostics.insert(diagnostics.end(), schema.diagnostics.begin(), schema.diagnostics.end());
  return std::move(schema.value);
}

}  // namespace

Loaded<SimComponent> prepare_sim(const project::Project& project) {
  Loaded<SimComponent> prepared;
  SimComponent component;
  if (!project.world) {
    prepared.diagnostics.push_back(
        {Severity::kError, "check.no-world", "the project has no world: FILE to simulate", SourceSpan{project.file}});
    return prepared;
  }
  auto world = project::load_project_world(project);
  prepared.diagnostics = std::move(world.diagnostics);
  const auto schema = robot_schema(prepared.diagnostics);
  if (!world.ok() || !schema) return prepared;
  component.world = std::make_shared<const sim::World>(std::move(*world.value));
  for (const project::ServiceEntry& service : project.services) {
    const auto* info = sim::find_service(service.interface);
    if (info != nullptr && !info->is_test_control)
      add_service(*schema, service.name, service.interface, service.robot, component);
  }
  for (const std::string& name : project::test_control_names(*component.world))
    add_service(*schema, name, "Simulation", *project::test_control_of(name, *component.world), component);
  for (SimComponent::Served& served : component.services) {
    if (served.interface == "Simulation") served.kept = schema->service("KeptSimulation");
  }
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
  const bool several = component.world->robots.size() > 1;
  for (const sim::RobotSpec& robot : component.world->robots) {
    for (const sim::ServiceInfo& info : sim::services()) {
      add_service(*schema, (several ? robot.name + "/" : "") + lower(info.name), std::string(info.name), robot.name,
                  component);
    }
  }
  prepared.value = std::move(component);
  return prepared;
}

SimServer::SimServer(SimComponent component, std::uint64_t seed, double factor,
                     std::function<void(const std::string&)> say)
    : clock_(runtime::make_real_clock(factor)),
      host_(std::make_unique<runtime::SimHost>(component.world, seed, *clock_)) {
  host_->keep_up({kWork, from_seconds(kLag_s * factor)},
                 [say = std::move(say)](Duration behind) { say(runtime::falls_behind(behind)); });
  served_ = std::move(component.services);
  for (const SimComponent::Served& served : served_) {
    auto service = std::make_shared<rpc::FunctionService>(
        served.kept ? served.kept : served.service,
        [this, &served](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
          if (method.name == "remember") {
            const TimePoint now = clock_->now();
            return octets_of(mission::remember(host_->snapshot(), now));
          }
          // Who calls is not known here.
          mission::CallOutcome outcome = call(served, method, arguments, "client");
          if (outcome.ok) return std::move(outcome.result);
          return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, outcome.message, {}, {}});
        });
    services_.push_back({served.name, std::move(service)});
  }
}

void SimServer::observe(Message message) {
  message.time = clock_->now();
  const std::lock_guard lock(mutex_);
  message.stamp = message.sequence = ++observed_;
  tap_.observe(message);
}

mission::CallOutcome SimServer::call(const SimComponent::Served& served, const idl::Method& method,
                                     const Value& arguments, const std::string& source) {
  // A map or a scan is not copied for nobody.
  if (!tap_.is_wanted()) return host_->call(served.interface, method.name, arguments, served.robot);
  Message message;
  {
    const std::lock_guard lock(mutex_);
    message.call = ++calls_;
  }
  const std::string name = fmt::format("{}.{}", served.name, method.name);
  message.source = source;
  message.target = served.name;
  message.kind = MessageKind::kRequest;
  message.name = name + ".request";
  message.data = Map{{"args", arguments}};
  observe(message);
  mission::CallOutcome outcome = host_->call(served.interface, method.name, arguments, served.robot);
  message.kind = outcome.ok ? MessageKind::kReply : MessageKind::kError;
  message.name = name + (outcome.ok ? ".reply" : ".error");
  message.data =
      outcome.ok ? Map{{"result", outcome.result}} : Map{{"kind", outcome.kind_word()}, {"message", outcome.message}};
  observe(std::move(message));
  return outcome;
}

void SimServer::tell_address(const std::string& service, std::string address) {
  const std::lock_guard lock(mutex_);
  std::string& all = addresses_[service];
  all += (all.empty() ? "" : ", ") + std::move(address);
}

std::string SimServer::addresses_of(const std::string& service) const {
  const std::lock_guard lock(mutex_);
  const auto found = addresses_.find(service);
  return found == addresses_.end() ? "sim" : found->second;
}

ControlHandler SimServer::control(std::string world_file) {
  ControlHandler handler;
  handler.tap = &tap_;
  handler.scenario = [file = std::move(world_file)] { return file; };
  handler.now = [this] { return clock_->now(); };
  handler.services = [this] {
    std::vector<ControlHandler::ServiceEntry> entries;
    for (const SimComponent::Served& served : served_)
      entries.push_back({served.name, served.service, addresses_of(served.name)});
    return entries;
  };
  handler.call = [this](const std::string& name, const std::string& method, const Value& arguments) {
    const auto refused = [](std::string message) {
      return mission::CallOutcome::failed(rpc::CallErrorKind::kArguments, std::move(message));
    };
    const auto served =
        std::find_if(served_.begin(), served_.end(), [&](const SimComponent::Served& s) { return s.name == name; });
    if (served == served_.end()) {
      std::vector<std::string> names;
      for (const SimComponent::Served& each : served_) names.push_back(each.name);
      return refused(fmt::format("the simulator has no service \"{}\"{}", name, did_you_mean(name, names)));
    }
    const auto found = idl::find_method(*served->service, method, name);
    if (!found) return refused(found.error().message);
    const auto args = idl::conform_arguments(**found, arguments);
    if (!args) return refused(args.error().message);
    if (const auto checked = idl::check_ranges(**found, *args); !checked) return refused(checked.error().message);
    return call(*served, **found, *args, "control");
  };
  return handler;
}

}  // namespace sentree::processes
