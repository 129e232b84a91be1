#include "sentree/cli/commands.h"

#include <fmt/format.h>

#include "sentree/cli/call_goal.h"
#include "sentree/cli/output.h"
#include "sentree/idl/conform.h"
#include "sentree/processes/control.h"
#include "sentree/processes/remote_service.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/plan.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/json.h"
#include "sentree/text/yaml.h"

namespace sentree::cli {

namespace {

// name=value, the value as YAML has it (10, true, text, {x: 1}); or one JSON object.
std::optional<Value> parse_arguments(const std::vector<std::string>& arguments) {
  if (arguments.size() == 1 && arguments.front().starts_with('{')) {
    auto value = text::parse_json(arguments.front(), "arguments");
    if (value) return *value;
    say(to_string(value.error()));
    return std::nullopt;
  }
  Map map;
  for (const std::string& argument : arguments) {
    const auto equals = argument.find('=');
    if (equals == std::string::npos || equals == 0) {
      say(fmt::format("argument \"{}\" must be name=value, e.g. percent=10", argument));
      return std::nullopt;
    }
    const auto value = text::parse_yaml(argument.substr(equals + 1), argument.substr(0, equals));
    if (!value) {
      say(to_string(value.error()));
      return std::nullopt;
    }
    const std::string name = argument.substr(0, equals);
    if (map.find(name) != nullptr) {
      say(fmt::format("argument \"{}\" is given twice", name));
      return std::nullopt;
    }
    // An empty text; what is of another type cannot be nothing.
    map[name] = equals + 1 == argument.size() ? Value("") : value->value();
  }
  return map;
}

int finish(bool ok, const std::string& result, const std::string& kind, const std::string& message) {
  if (ok) {
    print(result + "\n");
    return kOk;
  }
  say(fmt::format("{}: {}", kind, message));
  return kind == "arguments" ? kUsage : kind == "exception" ? kFindings : kEnvironment;
}

// The interface of ROS that the network has at the address; nothing, and it is said: nobody is there.
std::optional<std::string> interface_there(const rpc::Address& address) {
  // A busy machine's first look at its network may be too short.
  constexpr std::chrono::seconds kDiscoveries[] = {std::chrono::seconds(1), std::chrono::seconds(3)};
  const std::string options = address.path.substr(std::min(address.path.find('?'), address.path.size()));
  const std::string name = address.path.substr(0, address.path.size() - options.size());
  rpc::Address everywhere = address;
  everywhere.path = "/" + options;
  std::vector<std::string> names;
  std::string silence;
  for (const std::chrono::seconds discovery : kDiscoveries) {
    const auto listed = rpc::middleware_of(address).list(everywhere, discovery);
    names.clear();
    silence = listed ? "" : listed.error().message;
    if (!listed) continue;
    for (const rpc::NetworkEntry& entry : *listed) {
      // "action nav2_msgs/action/Spin"
      if (entry.kind.find('/') == std::string::npos) continue;
      if (entry.name == name) return entry.kind.substr(entry.kind.rfind(' ') + 1);
      names.push_back(entry.name);
    }
  }
  say(!silence.empty() ? silence
                       : fmt::format("nobody has {} there{}; `sentree services --on ros:{}` lists what is", name,
                                     did_you_mean(name, names), everywhere.path));
  return std::nullopt;
}

int call_address(const CallCommand& command, const rpc::Address& address, const Value& arguments, Duration deadline) {
  std::string interface = command.interface;
  if (interface.empty() && address.scheme == "ros") {
    auto said = interface_there(address);
    if (!said) return kEnvironment;
    interface = std::move(*said);
  }
  const auto [name, of] = project::interface_name(interface);
  if (name.empty()) {
    say("calling an address needs --interface FILE.thrift/SERVICE, or PACKAGE/srv/NAME of ROS");
    return kUsage;
  }
  std::error_code error;
  const bool is_here = std::filesystem::is_regular_file(name, error);
  const auto file = is_here ? std::optional<std::filesystem::path>(name) : project::find_interface("interfaces", name);
  if (!is_here && !file) {
    const std::string way = project::missing_form("interfaces", name, of);
    say(way.empty() ? fmt::format("no file {} is in this folder, in interfaces/, {}or among those of Sentree", name,
                                  name.ends_with(".thrift") ? "" : "in share/ of AMENT_PREFIX_PATH, ")
                    : fmt::format("there is no interface \"{}\"{}", interface, way));
    return kInvalidInput;
  }
  const auto schema = project::load_interface(*file, name);
  say(schema.diagnostics);
  if (!schema.ok()) return kInvalidInput;
  const idl::ServicePtr service = schema.value->service(of);
  if (!service) {
    const auto names = schema.value->service_names();
    say(fmt::format("{}: no service \"{}\"{}", name, of, names.empty() ? "; it has none" : did_you_mean(of, names)));
    return kInvalidInput;
  }
  // What is wrong with the arguments else, the call itself says.
  if (const idl::Method* method = service->find(command.method)) {
    const auto conformed = idl::conform_arguments(*method, arguments);
    if (const auto can_be = rpc::middleware_of(address).check_called(address, *service, *method); !can_be)
      return finish(false, "", "arguments", can_be.error().message);
    const auto checked = conformed ? idl::check_ranges(*method, *conformed) : Result<void>();
    if (!checked) return finish(false, "", "arguments", checked.error().message);
  }
  if (sends_goal(address, *service, command.method))
    return call_goal(address, service, arguments, deadline, command.feedback);
  const auto outcome = processes::call_once(address, service, address.service, command.method, arguments, deadline,
                                            [](const std::string& what) { say("! " + what); });
  return finish(outcome.ok, to_json(outcome.result), std::string(outcome.kind_word()), outcome.message);
}

}  // namespace

int call(const CallCommand& command) {
  const auto arguments = parse_arguments(command.arguments);
  if (!arguments) return kUsage;
  const auto deadline = project::parse_duration(command.deadline);
  if (!deadline) {
    say(fmt::format("--deadline {}: not a duration such as 500 ms", command.deadline));
    return kUsage;
  }
  if (command.service.find(':') != std::string::npos) {
    const auto address = rpc::Address::parse(command.service);
    if (address) return call_address(command, *address, *arguments, *deadline);
    say(address.error().message);
    return kUsage;
  }
  int pid = 0;
  if (!command.run.empty()) pid = std::atoi(command.run.c_str());
  const auto client = processes::connect_control(pid);
  if (!client) {
    say(client.error().message);
    return kEnvironment;
  }
  const rpc::Deadline until = std::chrono::steady_clock::now() + *deadline;
  if (command.service.empty()) {
    const auto services = (*client)->call("services", Map(), until);
    return services ? finish(true, std::string(services->text()), "", "")
                    : finish(false, "", "unreachable", services.error().message);
  }
  const auto reply = (*client)->call(
      "call", Map{{"target", command.service}, {"method", command.method}, {"arguments", to_json(*arguments)}}, until);
  if (!reply) return finish(false, "", "unreachable", reply.error().message);
  const Value* ok = reply->find("ok");
  return finish(ok != nullptr && ok->as_bool() != nullptr && *ok->as_bool(), std::string(reply->find("result")->text()),
                std::string(reply->find("kind")->text()), std::string(reply->find("message")->text()));
}

}  // namespace sentree::cli
