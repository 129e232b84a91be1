#include <fmt/format.h>

#include <map>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/serve.h"
#include "sentree/processes/component.h"

namespace sentree::cli {

int component(const ComponentCommand& command) {
  if (command.name != "sim") {
    say(fmt::format("component \"{}\" is not known; there is \"sim\", the simulated robot", command.name));
    return kUsage;
  }
  if (command.project.empty() == command.world.empty()) {
    say("give either --project PROJECT or --world FILE");
    return kUsage;
  }
  Loaded<processes::SimComponent> loaded;
  if (command.world.empty()) {
    const auto scenario = load_file(command.project);
    if (!scenario) return kInvalidInput;
    loaded = processes::prepare_sim(scenario->project);
  } else {
    loaded = processes::prepare_sim_world(command.world);
  }
  say(loaded.diagnostics);
  if (!loaded.ok()) return kInvalidInput;
  const processes::SimServer server(std::move(*loaded.value), command.seed, command.factor,
                                    [](const std::string& what) { say(what); });
  return serve_until_signal(command.listen, server.services(), command.insecure, command.of_run);
}

}  // namespace sentree::cli
