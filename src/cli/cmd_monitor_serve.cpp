#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/serve.h"
#include "sentree/runtime/plan.h"
#include "sentree/runtime/remote_observer.h"
#include "sentree/runtime/remote_skill.h"

namespace sentree::cli {

int monitor_serve(const MonitorServeCommand& command) {
  const auto scenario = load_file(command.project);
  if (!scenario) return kInvalidInput;
  auto plan = runtime::prepare_monitor(scenario->project, command.name);
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  auto interface = runtime::observer_interface();
  if (!interface) {
    say(to_string(interface.error()));
    return kEnvironment;
  }
  const auto service =
      runtime::make_monitor_service(std::move(*interface), std::move(plan.value->model), std::move(plan.value->gate),
                                    [name = command.name](const monitor::Decision& decision) {
                                      runtime::MonitorReport report;
                                      report.name = name;
                                      report.verdict = decision.verdict;
                                      report.decision = decision;
                                      say(story(report));
                                    });
  return serve_until_signal(command.listen, {{"observer", service}}, command.insecure);
}

}  // namespace sentree::cli
