#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <thread>

#include "sentree/cli/commands.h"
#include "sentree/cli/live_view.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/run_recording.h"
#include "sentree/runtime/distribute.h"

namespace sentree::cli {

namespace {

// Turns Ctrl-C and SIGTERM into an orderly end. The signals are blocked in all threads and awaited in one.
class Interrupts {
 public:
  /// Before anything that starts threads, which must not take the signals.
  static void block() {
    const sigset_t awaited = signals();
    pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  }

  explicit Interrupts(runtime::Run& run) : run_(run) {
    block();
    thread_ = std::thread([this] { wait(); });
  }
  ~Interrupts() {
    done_ = true;
    pthread_kill(thread_.native_handle(), SIGUSR1);
    thread_.join();
  }

 private:
  static sigset_t signals() {
    sigset_t awaited;
    sigemptyset(&awaited);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&awaited, signal);
    return awaited;
  }

  void wait() {
    const sigset_t awaited = signals();
    for (int received = 0;;) {
      int signal = 0;
      sigwait(&awaited, &signal);
      if (done_) return;
      if (signal == SIGUSR1) continue;
      if (++received > 1) _exit(kInterrupted);  // asked twice: at once
      run_.interrupt();
    }
  }

  runtime::Run& run_;
  std::atomic<bool> done_ = false;
  std::thread thread_;
};

int exit_code(const runtime::Scenario& scenario, const runtime::RunReport& report) {
  if (!report.given_up.empty()) return kFindings;
  if (!report.error.empty()) return kEnvironment;
  if (report.interrupted) return kInterrupted;
  if (report.any_violated()) return kFindings;
  if (scenario.mission) return report.unmet.empty() ? kOk : kFindings;
  if (report.timed_out) return kTimeLimit;
  return report.mission == bt::Status::kSuccess ? kOk : kFindings;
}

bool apply_options(const RunCommand& command, runtime::Scenario& scenario) {
  if (command.virtual_clock) scenario.virtual_time = *command.virtual_clock;
  if (command.factor) scenario.factor = *command.factor;
  if (scenario.virtual_time) scenario.factor = 1.0;
  if (command.seed) scenario.seed = *command.seed;
  if (command.duration) {
    const auto duration = runtime::parse_duration(*command.duration);
    if (!duration) {
      say("--duration " + *command.duration + ": not a duration such as 90 s or 5 min");
      return false;
    }
    scenario.duration = *duration;
  }
  return true;
}

}  // namespace

int run(const RunCommand& command) {
  std::optional<text::ReadLog> files;
  if (!command.no_record) files.emplace();
  auto scenario = load(command.project, command.scenario);
  if (!scenario) return kInvalidInput;
  if (command.processes && command.virtual_clock.value_or(false)) {
    say("--processes needs the real clock: other processes have no virtual time");
    return kUsage;
  }
  if (command.processes) scenario->virtual_time = false;
  if (!apply_options(command, *scenario)) return kUsage;
  auto plan = runtime::prepare(std::move(*scenario));
  if (plan.ok() && command.processes) plan = runtime::prepare(runtime::in_processes(*plan.value));
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;

  Interrupts::block();
  const bool live = command.live && !command.headless && !command.json;
  std::unique_ptr<LiveView> view;
  Narrator narrator;
  runtime::RunOptions options;
  options.listen = command.listen;
  options.insecure = command.insecure;
  if (live) {
    view = std::make_unique<LiveView>(*plan.value);
    options.listeners.push_back([&](const Message& message) { view->observe(message); });
    options.on_decision = [&](const runtime::MonitorReport& report) { view->decided(report); };
    options.on_problem = [&](const std::string& what) { view->note("! " + what); };
    options.on_view = [&](runtime::RunView* run_view) { view->attach(run_view); };
  } else if (!command.json) {
    options.listeners.push_back([&](const Message& message) {
      const std::string text = command.verbose ? line(message) : narrator.tell(message);
      if (!text.empty()) print(text + "\n");
    });
    options.on_decision = [](const runtime::MonitorReport& report) { print(story(report)); };
    options.on_problem = [](const std::string& what) { say("! " + what); };
  }
  std::unique_ptr<RunRecording> recording;
  if (files) {
    bool ok = true;
    recording = RunRecording::begin(command.record, *plan.value, files->files(), ok);
    if (!ok) return kEnvironment;
    if (recording) recording->install(options);
    files.reset();
  }
  runtime::Run run(*plan.value, std::move(options));
  runtime::RunReport report;
  {
    const Interrupts interrupts(run);
    report = run.execute();
  }
  view.reset();
  if (recording) recording->finish(report);
  if (command.json) {
    print(to_json(to_value(report)) + "\n");
  } else {
    if (live) {
      for (const auto& monitor : report.monitors) {
        if (monitor.decision) print(story(monitor));
      }
    }
    print(summary(report));
  }
  if (!report.error.empty()) say(report.error);
  return exit_code(plan.value->scenario, report);
}

}  // namespace sentree::cli
