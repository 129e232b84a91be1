#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/serve.h"
#include "sentree/processes/remote_skill.h"

namespace sentree::cli {

int skill(const SkillCommand& command) {
  auto scenario = load_file(command.project);
  if (!scenario) return kInvalidInput;
  for (const std::string& text : command.at) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    bool known = false;
    for (project::ServiceEntry& service : scenario->project.services) {
      if (equals == std::string::npos || service.name != name) continue;
      service.at = text.substr(equals + 1);
      known = true;
    }
    if (known) continue;
    say(fmt::format("--at {}: must be SERVICE=ADDRESS with a service of the project", text));
    return kUsage;
  }
  auto plan = project::prepare_skill(scenario->project, command.leaf);
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  // What its chart never calls need not be reached.
  std::erase_if(plan.value->services,
                [&](const auto& service) { return !project::may_call(plan.value->chart, service.first); });
  for (const auto& [name, service] : plan.value->services) {
    if (service.at != "sim" && service.at != "model") continue;
    say(fmt::format("service \"{}\" is at: {}, which is inside another process; give its address with --at {}=ADDRESS",
                    name, service.at, name));
    return kInvalidInput;
  }
  const auto interface = processes::served_skill_interface();
  const auto observers = processes::observer_interface();
  if (!interface || !observers) {
    say(to_string(interface ? observers.error() : interface.error()));
    return kEnvironment;
  }
  const auto problem = [](const std::string& what) { say("! " + what); };
  std::unique_ptr<runtime::Publisher> publisher = processes::make_silent_publisher();
  if (!command.observer.empty()) {
    const auto address = rpc::Address::parse(command.observer);
    if (!address) {
      say("--observer: " + address.error().message);
      return kUsage;
    }
    auto remote = processes::make_remote_publisher(*address, *observers, command.leaf, problem);
    if (!remote) {
      say(to_string(remote.error()));
      return kEnvironment;
    }
    publisher = std::move(*remote);
  }
  const auto scheduler = runtime::make_real_scheduler(command.factor);
  processes::SkillServerOptions options;
  options.factor = command.factor;
  options.seed = command.seed;
  options.delays = scenario->delays;
  options.problem = problem;
  options.log = [](const std::string& leaf, const scxml::LogLine& line) {
    say(fmt::format("{}: {} {}", leaf, line.label, line.text));
  };
  const auto service =
      processes::make_skill_service(*plan.value, *interface, *publisher, *scheduler, std::move(options));
  std::thread actors([&] {
    if (const auto error = scheduler->run()) problem(*error);
  });
  const int code = serve_until_signal(command.listen, {{"skill", service}}, command.insecure, command.of_run);
  scheduler->stop();
  actors.join();
  return leave(code);
}

}  // namespace sentree::cli
