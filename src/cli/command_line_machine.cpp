#include "sentree/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "sentree/cli/commands.h"
#include "sentree/cli/completion.h"
#include "sentree/cli/output.h"

// The machine, shells and editors.

namespace sentree::cli {

namespace {

void add_doctor(CLI::App& app, Commands& commands) {
  const auto kept = std::make_shared<DoctorCommand>();
  auto* sub = app.add_subcommand("doctor", "Say whether this machine has what Sentree needs");
  sub->add_flag("--json", kept->json);
  commands.push_back({sub, [kept] { return doctor(*kept); }});
}

void add_bug_report(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("bug-report", "Pack into one file what others need to understand an error");
  BugReportCommand& command = options_for<BugReportCommand>(sub, commands, bug_report);
  sub->footer(
      "Examples:\n"
      "  sentree bug-report\n"
      "  sentree bug-report runs/recharge-20260102-101500.mcap -o report.tar.gz\n"
      "Packs version, commit, compiler, libraries, what sentree doctor says, and the recording, with which come the\n"
      "project's files. Exit code: 0, 3 no such recording, 4 the file cannot be written.");
  sub->add_option("recording", command.recording, "MCAP file of the run that went wrong");
  sub->add_option("--output,-o", command.output, "Default: sentree-bug-report-DATE-TIME.tar.gz");
}

void add_bench(CLI::App& app, Commands& commands) {
  auto* sub = app.add_subcommand("bench", "Measure this machine");
  BenchRpcCommand& command = options_for<BenchRpcCommand>(sub, commands, bench_rpc);
  sub->require_subcommand(1);
  auto* rpc = sub->add_subcommand("rpc", "An empty call between two processes, over a Unix socket or YARP");
  rpc->footer("Examples:\n  sentree bench rpc --json\n  sentree bench rpc --over yarp");
  rpc->add_option("--over", command.over, "unix: a Unix socket; yarp: ports of YARP, tcp")
      ->check(CLI::IsMember({"unix", "yarp"}));
  rpc->add_option("--calls", command.calls)->check(CLI::Range(1, 10'000'000))->capture_default_str();
  rpc->add_option("--listen", command.listen)->group("");
  rpc->add_flag("--json", command.json, "Print median and 99th percentile as JSON [µs]");
}

void add_completion(CLI::App& app, Commands& commands) {
  const auto shell = std::make_shared<std::string>();
  auto* sub = app.add_subcommand("completion", "Print the script by which a shell completes commands, files and names");
  sub->footer(
      "Examples:\n"
      "  source <(sentree completion bash)                        in ~/.bashrc\n"
      "  source <(sentree completion zsh)                         in ~/.zshrc, behind compinit\n"
      "  sentree completion fish | source                         in ~/.config/fish/config.fish");
  sub->add_option("shell", *shell)->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  commands.push_back({sub, [shell] {
                        print(completion_script(*shell));
                        return kOk;
                      }});
}

void add_lsp(CLI::App& app, Commands& commands) {
  auto* sub =
      app.add_subcommand("lsp", "Help editors with missions, charts, requirements and interfaces (docs/editors.md)");
  sub->add_flag("--stdio")->description("Over standard input and output, as it always is");
  commands.push_back({sub, [] { return lsp(); }});
}

}  // namespace

void add_machine_commands(CLI::App& app, Commands& commands) {
  add_doctor(app, commands);
  add_bug_report(app, commands);
  add_bench(app, commands);
  add_completion(app, commands);
  add_lsp(app, commands);
}

}  // namespace sentree::cli
