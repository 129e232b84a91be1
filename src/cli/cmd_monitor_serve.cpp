#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/serve.h"
#include "sentree/processes/remote_observer.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

int monitor_serve(const MonitorServeCommand& command) {
  if (command.project.empty() || command.name.empty() || command.listen.empty()) {
    say("monitor needs --project, --name and --listen, or the command synth (see sentree monitor --help)");
    return kUsage;
  }
  const auto scenario = load_file(command.project);
  if (!scenario) return kInvalidInput;
  auto plan = project::prepare_monitor(scenario->project, command.name);
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  auto interface = processes::kept_observer_interface();
  if (!interface) {
    say(to_string(interface.error()));
    return kEnvironment;
  }
  const auto service =
      processes::make_monitor_service(std::move(*interface), plan.value->model, std::move(plan.value->gate),
                                      [model = plan.value->model](const monitor::Decision& decision) {
                                        runtime::MonitorReport report;
                                        report.name = model.name();
                                        report.explanation = monitor::explain(model, decision, "");
                                        report.verdict = decision.verdict;
                                        report.decision = decision;
                                        say(story(report));
                                      });
  return serve_until_signal(command.listen, {{"observer", service}}, command.insecure, command.of_run);
}

}  // namespace sentree::cli
